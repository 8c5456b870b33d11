"""The command line on .blend files, through Blender as a Python module and the add-on of this source tree."""

from __future__ import annotations

import importlib.util
import json
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from terminals import OnTerminal

from vlp_bpt.images import read_image
from vlp_bpt.snapshot import load_snapshot

ROOT = Path(__file__).resolve().parents[2]

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("bpy") is None, reason="Blender's Python module is not installed"
)

# A small Cornell box that moves at frame 2, the same without a camera, and one with a texture and two view layers.
MAKE = """
import sys, bpy
source, folder = sys.argv[1:]
bpy.ops.wm.open_mainfile(filepath=source)
scene = bpy.context.scene
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 48, 64, 50
camera = scene.camera
camera.keyframe_insert("location", frame=1)
camera.location.z += 0.1
camera.keyframe_insert("location", frame=2)
scene.frame_set(1)
bpy.ops.wm.save_as_mainfile(filepath=folder + "/box.blend")
scene.camera = None
bpy.ops.wm.save_as_mainfile(filepath=folder + "/blind.blend")
scene.camera = camera
scene.view_layers.new("second")
material = next(m for m in bpy.data.materials if m.node_tree is not None)
tree = material.node_tree
shader = next(node for node in tree.nodes if node.type.startswith("BSDF"))
tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[1], shader.inputs[0])
bpy.ops.wm.save_as_mainfile(filepath=folder + "/layers.blend")
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("blends")
    source = ROOT / "scenes" / "cornell_box.blend"
    subprocess.run([sys.executable, "-c", MAKE, str(source), str(folder)], check=True, capture_output=True, timeout=300)
    (folder / "junk.blend").write_bytes(b"junk")
    yield folder


def vlp_bpt(folder: Path, *arguments: str, code: int = 0) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "vlp_bpt", *arguments]
    result = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=300)
    assert result.returncode == code, result.stdout + result.stderr
    assert "Traceback" not in result.stderr
    return result


def test_a_blend_is_rendered_by_blender_through_the_add_on(folder: Path) -> None:
    result = vlp_bpt(folder, "render", "box.blend", "-o", "a.png", "--samples", "4")
    assert re.fullmatch(r"a\.png: 4 iterations, \d+\.\d\d s, \d+\.\d{3} Msamples/s, .*\n", result.stdout)
    pixels = read_image(folder / "a.png").pixels
    assert pixels.shape == (32, 24, 4)
    assert pixels.std() > 0.02


def test_the_file_tells_how_it_was_made(folder: Path) -> None:
    more = ("--set", "mode=paper", "--set", "eye_path_length=3", "--samples", "2", "--seed", "7", "--depth", "half")
    vlp_bpt(folder, "render", "box.blend", "-o", "a.exr", *more)
    metadata = read_image(folder / "a.exr").metadata
    (settings,) = [json.loads(value) for name, value in metadata.items() if name.endswith(".settings")]
    found = {name: settings[name] for name in ("mode", "samples", "light_path_length", "eye_path_length", "seed")}
    assert found == {"mode": "PAPER", "samples": 2, "light_path_length": 1, "eye_path_length": 3, "seed": 7}


def test_an_exported_scene_renders_the_same_picture(folder: Path) -> None:
    vlp_bpt(folder, "render", "box.blend", "-o", "blender.exr", "--samples", "3")
    exported = vlp_bpt(folder, "export", "box.blend", "-o", "box.vlp.npz").stdout
    assert re.match(r"box\.vlp\.npz: \d+ triangles, 0 spheres, \d+ instances, \d+ materials, 1 lights, ", exported)
    vlp_bpt(folder, "render", "box.vlp.npz", "-o", "snapshot.exr", "--samples", "3")
    assert np.array_equal(read_image(folder / "snapshot.exr").pixels, read_image(folder / "blender.exr").pixels)
    vlp_bpt(folder, "render", "box.blend", "-o", "range.exr", "--iterations", "0:3")
    vlp_bpt(folder, "render", "box.vlp.npz", "-o", "same.exr", "--iterations", "0:3")
    assert np.array_equal(read_image(folder / "range.exr").pixels, read_image(folder / "same.exr").pixels)


def test_strategies_of_a_blend(folder: Path) -> None:
    more = ("--samples", "2", "--set", "eye_path_length=2", "--set", "light_path_length=1")
    result = vlp_bpt(folder, "render", "box.blend", "--debug-strategies", "strategies", *more)
    assert result.stdout.endswith("strategies: 12 pictures and strategies.png, 2 samples\n")
    assert read_image(folder / "strategies" / "s2_t2_weighted.exr").pixels.shape == (32, 24, 4)


def test_a_frame_can_be_chosen(folder: Path) -> None:
    for frame in ("1", "2"):
        vlp_bpt(folder, "export", "box.blend", "-o", f"{frame}.vlp.npz", "--frame", frame)
    first, second = (load_snapshot(folder / f"{frame}.vlp.npz") for frame in ("1", "2"))
    assert first.scene.camera is not None
    assert second.scene.camera is not None
    moved = second.scene.camera.transform - first.scene.camera.transform
    assert moved[2, 3] == pytest.approx(0.1, abs=1e-5)
    assert second.metadata["frame"] == 2


def test_every_view_layer_is_told_of_and_warnings_come_once(folder: Path) -> None:
    result = vlp_bpt(folder, "render", "layers.blend", "-o", "a.exr", "--samples", "1")
    assert result.stdout.count("1 iterations") == 2
    *memory, warning = result.stderr.splitlines()
    assert len(memory) == 2
    assert all(line.startswith("layers.blend: takes CPU ") for line in memory)
    assert warning.startswith("vlp-bpt: warning: ")
    assert "Noise Texture" in warning


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("render", "blind.blend", "-o", "x.png"), "'blind.blend': Cannot render, no camera"),
        (("export", "blind.blend", "-o", "x.vlp.npz"), "'blind.blend': Cannot render, no camera"),
        (("render", "junk.blend", "-o", "x.png"), "'junk.blend': Blender cannot open it: "),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_failures_are_said_in_one_line(folder: Path, arguments: tuple[str, ...], message: str) -> None:
    result = vlp_bpt(folder, *arguments, code=1)
    assert result.stderr.startswith(f"vlp-bpt: {message}"), result.stderr
    assert result.stderr.count("\n") == 1
    assert not (folder / "x.png").exists()


def test_interrupting_before_the_first_picture_leaves_none(folder: Path) -> None:
    slow = ("light_samples=1024", "vlp_connections=1024", "light_paths=2000000", "adaptive=off")
    settings = [word for value in slow for word in ("--set", value)]
    terminal = OnTerminal(folder, "render", "box.blend", "-o", "none.exr", "--samples", "6", *settings)
    terminal.read_until(b" 0/6 iterations")
    terminal.process.send_signal(signal.SIGINT)
    terminal.read_until(None)
    terminal.process.communicate(timeout=30)
    assert terminal.process.returncode == 130
    assert terminal.shown.rstrip().endswith(b"vlp-bpt: interrupted")
    assert not (folder / "none.exr").exists()
