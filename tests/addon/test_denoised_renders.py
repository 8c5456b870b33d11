"""Denoising through Blender: passes, the picture, Esc, and a Blender without the library."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import bpy
import bpy_scenes as scenes
import numpy as np
import OpenImageIO
import pytest

from addon import figures, final
from vlp_bpt import Cancelled, denoise
from vlp_bpt.images import ALBEDO, NOISY, NORMAL, read_image

PASSES = (NOISY, ALBEDO, NORMAL)


@pytest.fixture(autouse=True)
def floor() -> None:
    """An orange floor under a lamp, seen from above, in quick settings."""
    made, (node,) = scenes.material("floor", "ShaderNodeBsdfDiffuse")
    scenes.socket(node, "Color").default_value = (0.8, 0.4, 0.1, 1)
    scenes.plane(made, 4)
    scenes.camera(type="ORTHO", ortho_scale=3)
    scenes.light("AREA", energy=50)
    settings = bpy.context.scene.vlp_bpt
    settings.samples, settings.denoise, settings.denoise_prefilter = 4, True, False


@pytest.fixture
def reports(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The warnings of the renders."""
    said: list[str] = []
    report = final._report

    def noting(engine: Any, renderer: Any, notes: Any) -> None:
        report(engine, renderer, notes)
        said.extend(warning for warning in notes.warnings if warning not in said)

    monkeypatch.setattr(final, "_report", noting)
    return said


def render(path: Path, layers: bool = True) -> Any:
    """What Blender writes: `vlp_bpt.images.Image`."""
    scene = bpy.context.scene
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE" if layers else "IMAGE"
    image.file_format = "OPEN_EXR_MULTILAYER" if layers else "OPEN_EXR"
    image.color_depth = "32"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return read_image(path)


def sockets() -> list[str]:
    """Outputs of a Render Layers node in the compositor."""
    scene = bpy.context.scene
    if hasattr(scene, "compositing_node_group"):  # from Blender 5.0 on
        tree = bpy.data.node_groups.new("compositing", "CompositorNodeTree")
        scene.compositing_node_group = tree
    else:
        scene.use_nodes = True
        tree = scene.node_tree
    node = tree.nodes.new("CompositorNodeRLayers")
    return [output.name for output in node.outputs if output.enabled]


def test_the_passes_are_in_the_file(tmp_path: Path) -> None:
    image = render(tmp_path / "a.exr")
    assert set(image.layers) == set(PASSES)
    assert np.allclose(image.layers[ALBEDO], (0.8, 0.4, 0.1), atol=1e-5)
    assert np.allclose(image.layers[NORMAL], (0, 0, 1), atol=1e-5)
    noisy = image.layers[NOISY]
    assert not np.array_equal(image.pixels, noisy)
    assert image.pixels[..., :3].std() < noisy[..., :3].std()
    assert abs(image.pixels[..., :3].mean() / noisy[..., :3].mean() - 1) < 0.03
    assert "Denoising" in dict(figures.last[("Scene", "ViewLayer")])


def test_the_noisy_pass_is_the_picture_without_denoising(tmp_path: Path) -> None:
    noisy = render(tmp_path / "a.exr").layers[NOISY]
    bpy.context.scene.vlp_bpt.denoise = False
    plain = render(tmp_path / "b.exr")
    assert plain.layers == {}
    assert np.array_equal(plain.pixels, noisy)


def test_a_plain_file_has_the_denoised_picture(tmp_path: Path) -> None:
    image = render(tmp_path / "a.exr")
    assert np.array_equal(render(tmp_path / "b.exr", layers=False).pixels, image.pixels)


def test_the_compositor_sees_the_passes_while_they_are_asked_for() -> None:
    scene = bpy.context.scene
    assert set(PASSES) <= set(sockets())
    scene.vlp_bpt.denoise = False
    assert not set(PASSES) & set(sockets())
    scene.vlp_bpt.denoise = True
    assert set(PASSES) <= set(sockets())


def test_a_border_is_denoised_where_it_lies(tmp_path: Path) -> None:
    settings = bpy.context.scene.render
    settings.use_border = True
    settings.border_min_x, settings.border_max_x, settings.border_min_y, settings.border_max_y = 0.25, 0.5, 0.5, 0.75
    image = render(tmp_path / "a.exr")
    inside = np.zeros((48, 64), bool)
    inside[24:36, 16:32] = True
    for picture in (image.pixels[..., :3], image.layers[ALBEDO], image.layers[NOISY][..., :3]):
        assert (picture[inside] > 0).any(axis=1).all()
        assert (picture[~inside] == 0).all()


def test_a_transparent_film_keeps_its_alpha(tmp_path: Path) -> None:
    bpy.context.scene.render.film_transparent = True
    bpy.context.scene.camera.data.ortho_scale = 8
    image = render(tmp_path / "a.exr")
    assert np.array_equal(image.pixels[..., 3], image.layers[NOISY][..., 3])
    assert image.pixels[0, 0, 3] == 0
    assert image.pixels[24, 32, 3] == 1
    assert (image.layers[ALBEDO][0, 0] == 0).all()


def test_without_the_library_the_picture_stays_noisy_with_a_warning(
    tmp_path: Path, no_denoiser: None, reports: list[str]
) -> None:
    image = render(tmp_path / "a.exr")
    assert len(reports) == 1
    assert "stays noisy" in reports[0]
    assert "Open Image Denoise" in reports[0]
    assert image.pixels[..., :3].mean() > 0
    assert np.array_equal(image.layers[NOISY], image.pixels)


def test_esc_while_it_denoises_keeps_the_noisy_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Esc comes once the denoiser has begun."""
    begun: list[float] = []
    monkeypatch.setattr(final._Break, "is_set", lambda _: bool(begun))

    def slow(*_: Any, cancelled: Any, **__: Any) -> Any:
        begun.append(time.monotonic())
        while not cancelled():
            time.sleep(0.01)
        raise Cancelled("denoising was cancelled")

    monkeypatch.setattr(denoise, "denoise", slow)
    image = render(tmp_path / "a.exr")
    assert len(begun) == 1
    assert image.pixels[..., :3].mean() > 0
    assert np.array_equal(image.layers[NOISY], image.pixels)
    assert np.allclose(image.layers[ALBEDO], (0.8, 0.4, 0.1), atol=1e-5)


def test_the_command_line_keeps_the_passes_in_an_exr(tmp_path: Path) -> None:
    from vlp_bpt import cli

    blend = tmp_path / "floor.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    for name in ("a.exr", "a.png"):
        assert cli.main(["render", str(blend), "-o", str(tmp_path / name), "--set", "denoise=on", "--quiet"]) == 0
    file = OpenImageIO.ImageInput.open(str(tmp_path / "a.exr"))
    names, part = set(), 0
    while file.seek_subimage(part, 0):
        names |= set(file.spec().channelnames)
        part += 1
    file.close()
    assert {f"ViewLayer.{name}" for name in ("Combined.R", f"{NOISY}.A", f"{ALBEDO}.B", f"{NORMAL}.Z")} <= names
    assert set(read_image(tmp_path / "a.exr").layers) == set(PASSES)
    assert read_image(tmp_path / "a.png").pixels.shape == (48, 64, 4)
