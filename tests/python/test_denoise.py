"""The denoiser: less error and the same light, any size, and a clear word or a noisy picture where it cannot work."""

from __future__ import annotations

import ctypes.util
import subprocess
import sys
import time
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import pytest
from small_scenes import room

from vlp_bpt import Cancelled, DeviceError, Renderer, RenderSettings, cli, denoise, metrics
from vlp_bpt.images import ALBEDO, NOISY, NORMAL, Image, read_image, write_image
from vlp_bpt.merge import merge_images
from vlp_bpt.snapshot import Snapshot, save_snapshot, scene_digest

FAST: dict[str, Any] = {"denoise": True, "denoise_prefilter": False}


def grey(height: int, width: int, channels: int = 3) -> Any:
    return np.full((height, width, channels), 0.5, np.float32)


@pytest.fixture(scope="module")
def truth() -> Any:
    """(64, 64, 3): about a fiftieth of the relMSE of 8 samples."""
    return Renderer(room(64, 64), RenderSettings(samples=400, seed=1)).render().pixels[..., :3]


@pytest.mark.parametrize("prefilter", [False, True])
def test_the_error_falls_and_the_light_stays(prefilter: bool, truth: Any) -> None:
    image = Renderer(room(64, 64), RenderSettings(samples=8, denoise=True, denoise_prefilter=prefilter)).render()
    noisy, clean = (metrics.rel_mse(pixels[..., :3], truth) for pixels in (image.layers[NOISY], image.pixels))
    ratio = image.pixels[..., :3].mean() / truth.mean()
    print(f"relMSE {noisy:.2e} noisy, {clean:.2e} denoised; mean {ratio - 1:+.3%}")
    assert clean < 0.2 * noisy
    assert abs(ratio - 1) < 0.02


def test_the_result_says_what_was_done() -> None:
    renderer = Renderer(room(), RenderSettings(samples=2, **FAST))
    image = renderer.render()
    assert image.metadata["denoised"] is True
    assert renderer.statistics.denoise_seconds > 0
    assert not np.array_equal(image.pixels, image.layers[NOISY])
    assert np.array_equal(image.pixels[..., 3], image.layers[NOISY][..., 3])
    assert renderer.warnings == []


@pytest.mark.parametrize("size", [(1, 1), (3, 7), (1, 200), (33, 31)])
@pytest.mark.parametrize("guided", [False, True])
def test_any_size_works(size: tuple[int, int], guided: bool) -> None:
    normal = np.zeros((*size, 3), np.float32)
    clean = denoise.denoise(grey(*size), *((grey(*size), normal) if guided else ()))
    assert clean.shape == (*size, 3)
    assert np.abs(clean - 0.5).max() < 0.1  # the library's corners
    assert np.abs(clean - 0.5).mean() < 0.01


def test_an_empty_picture_stays_empty() -> None:
    assert denoise.denoise(grey(0, 5)).shape == (0, 5, 3)


def test_numbers_that_are_not_finite_do_not_spread() -> None:
    pixels = grey(64, 64, 4)
    pixels[10, 10, 0], pixels[40, 40, 1], pixels[20, 30, 2] = np.nan, np.inf, -np.inf
    clean = denoise.denoise(pixels, grey(64, 64), np.full((64, 64, 3), np.nan, np.float32))
    assert np.isfinite(clean).all()
    assert np.abs(clean - 0.5).mean() < 0.02
    assert np.isnan(pixels[10, 10, 0])  # the noisy picture is left alone


def test_alpha_is_kept_and_rows_are_where_they_were() -> None:
    pixels = grey(48, 64, 4)
    pixels[:24, :, :3] = 2.0
    pixels[..., 3] = np.linspace(0, 1, 64)
    clean = denoise.denoise(pixels)
    assert np.array_equal(clean[..., 3], pixels[..., 3])
    assert np.abs(clean[:20, :, :3] - 2).max() < 0.1
    assert np.abs(clean[28:, :, :3] - 0.5).max() < 0.1


def test_one_thread_gives_what_all_give() -> None:
    noisy = np.random.default_rng(1).exponential(1, (80, 90, 3)).astype(np.float32)
    assert np.allclose(denoise.denoise(noisy, threads=1), denoise.denoise(noisy), rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize(
    ("pixels", "options"),
    [
        (grey(4, 4, 2), {}),
        (grey(4, 4), {"normal": grey(4, 4)}),
        (grey(4, 4), {"albedo": grey(4, 5)}),
        (grey(4, 4), {"albedo": grey(4, 4, 4)}),
    ],
    ids=["channels", "normal alone", "size", "channels of a guide"],
)
def test_other_shapes_are_refused(pixels: Any, options: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="shape"):
        denoise.denoise(pixels, **options)


# Stopping


def test_it_stops_when_asked() -> None:
    big = grey(1500, 1500)
    started = time.perf_counter()
    with pytest.raises(Cancelled):
        denoise.denoise(big, big, big, cancelled=lambda: time.perf_counter() - started > 0.1)
    took = time.perf_counter() - started
    with pytest.raises(Cancelled):
        denoise.denoise(grey(8, 8), cancelled=lambda: True)
    print(f"stopped after {took:.2f} s")
    assert took < 10  # the whole takes a minute


def test_a_cancelled_render_stays_noisy() -> None:
    flag = Event()
    renderer = Renderer(room(), RenderSettings(samples=1000, **FAST))
    image = renderer.render(lambda now: flag.set() if now.iterations else None, flag)
    assert "denoised" not in image.metadata
    assert np.array_equal(image.pixels, image.layers[NOISY])


def test_ctrl_c_while_denoising_keeps_the_noisy_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(denoise, "denoise", interrupted)
    renderer = Renderer(room(), RenderSettings(samples=2, **FAST))
    image = renderer.render()
    assert renderer.interrupted
    assert np.array_equal(image.pixels, image.layers[NOISY])


# Where there is no library, or it fails


def test_a_missing_library_is_said_before_the_render(no_denoiser: None) -> None:
    with pytest.raises(DeviceError, match=r"Open Image Denoise 2, which is not here: pip install 'vlp-bpt\[denoise\]'"):
        Renderer(room(), RenderSettings(samples=1, denoise=True))
    Renderer(room(), RenderSettings(samples=1)).render()


def test_the_command_line_says_it_too(no_denoiser: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save_snapshot(tmp_path / "room.vlp.npz", Snapshot(room(), None, {}))
    out = tmp_path / "room.exr"
    assert cli.main(["render", str(tmp_path / "room.vlp.npz"), "-o", str(out), "--set", "denoise=on"]) == cli.FAILED
    assert "Open Image Denoise" in capsys.readouterr().err
    assert not out.exists()


def test_another_library_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    other = ctypes.util.find_library("m")
    assert other is not None
    monkeypatch.setattr(denoise, "_candidates", lambda: iter([other, "/nowhere/libOpenImageDenoise.so.2"]))
    denoise.load.cache_clear()
    with pytest.raises(DeviceError, match=f"'{other}' cannot be used: .*'/nowhere/lib.*' cannot be used"):
        denoise.load()
    denoise.load.cache_clear()


def test_a_failure_keeps_the_noisy_picture_with_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: Any, **__: Any) -> None:
        raise DeviceError("denoising failed: out of memory")

    monkeypatch.setattr(denoise, "denoise", fails)
    renderer = Renderer(room(), RenderSettings(samples=2, **FAST))
    image = renderer.render()
    assert renderer.warnings == ["denoising failed: out of memory"]
    assert np.array_equal(image.pixels, image.layers[NOISY])


def test_the_librarys_own_errors_are_told() -> None:
    stop = Event()
    with denoise._Device(denoise.load(), 1, stop) as device, pytest.raises(DeviceError, match="error"):
        device.run({"nothing": grey(8, 8)})


def test_blenders_library_is_found_and_only_one_is_loaded() -> None:
    """In a process that has imported Blender, the one that Blender mapped."""
    code = "import bpy; from vlp_bpt import denoise; denoise.load(); print(open('/proc/self/maps').read())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    found = {line.split()[-1] for line in done.stdout.splitlines() if "/libOpenImageDenoise.so" in line}
    assert len(found) == 1, done.stderr
    assert "bpy" in found.pop()


# Files


def test_an_exr_keeps_the_noisy_picture_and_the_guides(tmp_path: Path) -> None:
    image = Renderer(room(12, 9), RenderSettings(samples=2, **FAST)).render()
    write_image(tmp_path / "a.exr", image)
    back = read_image(tmp_path / "a.exr")
    assert np.array_equal(back.pixels, image.pixels)
    assert list(back.layers) == [NOISY, ALBEDO, NORMAL]
    for name, picture in image.layers.items():
        assert np.array_equal(back.layers[name], picture)
    assert back.metadata["denoised"] is True
    write_image(tmp_path / "a.png", image)
    assert read_image(tmp_path / "a.png").layers == {}


def test_denoised_parts_merge_to_the_bits_of_the_whole(tmp_path: Path) -> None:
    scene = room(20, 14)

    def part(begin: int, end: int) -> Path:
        settings = RenderSettings(samples=end - begin, adaptive=False, **FAST)
        renderer = Renderer(scene, settings, first_iteration=begin)
        image = renderer.render()
        image.metadata["scene"], image.film_state = scene_digest(scene), renderer.film_state()
        write_image(tmp_path / f"{begin}_{end}.exr", image)
        return tmp_path / f"{begin}_{end}.exr"

    whole, merged = read_image(part(0, 6)), merge_images([part(4, 6), part(0, 4)])
    assert merged.film_state is not None and whole.film_state is not None
    assert np.array_equal(merged.film_state, whole.film_state)
    for name in whole.layers:
        assert np.array_equal(merged.layers[name], whole.layers[name])
    assert np.allclose(merged.pixels, whole.pixels, atol=1e-4)
    assert merged.metadata["denoised"] is True


def test_the_command_denoises_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    image = Renderer(room(40, 40), RenderSettings(samples=4, **FAST)).render()
    write_image(tmp_path / "a.exr", image)
    write_image(tmp_path / "plain.exr", Image(image.layers[NOISY]))
    for name, words in (("a", "with guides"), ("plain", "with no guides")):
        out = tmp_path / f"{name}_clean.exr"
        assert cli.main(["denoise", str(tmp_path / f"{name}.exr"), "-o", str(out), "--no-prefilter"]) == 0
        assert words in capsys.readouterr().out
        assert cli.main(["info", str(out)]) == 0
        assert f"layers: {NOISY}" in capsys.readouterr().out
        clean = read_image(out)
        assert np.array_equal(clean.layers[NOISY], image.layers[NOISY])
        assert not np.array_equal(clean.pixels, image.layers[NOISY])
