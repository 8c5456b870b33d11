"""The GPU makes the pictures that the CPU makes: of the same random numbers, so nearly the same in every pixel."""

from __future__ import annotations

import time
from dataclasses import replace
from threading import Timer

import numpy as np
import pytest
from on_device import DEVICE, FORM, FORMS, SCENES, load, picture, renderer

from vlp_bpt import Renderer, RenderSettings, denoise, devices
from vlp_bpt.memory import plan_memory
from vlp_bpt.render import load_native
from vlp_bpt.scene import Film
from vlp_bpt.upload import upload

MODES = ("PAPER", "BALANCED", "REFERENCE")


@pytest.fixture(autouse=True, scope="module")
def _there_is_such_a_device() -> None:
    assert any(device["kind"] == DEVICE for device in devices()), f"there is no device {DEVICE} here"


@pytest.fixture(autouse=True, params=FORMS[:1] if DEVICE == "CPU" else FORMS)
def form(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Every test runs with either form of the eye pass."""
    monkeypatch.setenv(FORM, request.param)
    return str(request.param)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("mode", MODES)
def test_paths_are_those_of_the_cpu(name: str, mode: str) -> None:
    """Arithmetic differs in the last bits, and now and then a path turns off at an edge: few pixels differ."""
    scene = load(name)
    ours, theirs = (picture(scene, device, 2, mode=mode) for device in (DEVICE, "CPU"))
    size = np.maximum(np.abs(theirs), 1e-2 * theirs.mean())
    differs = (np.abs(ours - theirs) > 1e-3 * size).any(axis=-1)
    assert differs.mean() < 0.03
    np.testing.assert_allclose(np.median(ours - theirs), 0, atol=1e-6)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("mode", MODES)
def test_means_are_those_of_the_cpu(name: str, mode: str) -> None:
    """z-test of the mean over 12 batches with seeds of their own each; a false alarm has a probability of 1e-6."""
    scene = load(name)
    ours, theirs = (
        np.array([picture(scene, device, 16, mode=mode, seed=seed + offset).mean() for seed in range(12)])
        for device, offset in ((DEVICE, 1), ("CPU", 101))
    )
    error = np.sqrt((ours.var(ddof=1) + theirs.var(ddof=1)) / 12)
    assert abs(ours.mean() - theirs.mean()) < 6.5 * error  # t with about 22 degrees of freedom


@pytest.mark.parametrize("name", SCENES)
def test_a_denoiser_gets_what_the_cpu_gives_it(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Colour with splats of one pixel, albedo and normal: few pixels differ."""
    monkeypatch.setattr(denoise, "load", lambda: None)  # gathering takes no library
    scene = load(name)
    ours, theirs = (renderer(scene, device, 2, denoise=True)._guided() for device in (DEVICE, "CPU"))
    for mine, other in zip(ours, theirs, strict=True):
        size = np.maximum(np.abs(other), 1e-2 * np.abs(other).mean())
        assert (np.abs(mine - other) > 1e-3 * size).any(axis=-1).mean() < 0.03
        assert np.abs(other).max() > 0


@pytest.mark.parametrize("mode", MODES)
def test_the_same_seed_makes_the_same_bits(mode: str) -> None:
    scene = load("cornell_box")
    first, second = (renderer(scene, mode=mode).film_state() for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_forms_make_the_same_picture_and_the_faster_is_taken(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """But for rounding, which the compiler is free to do elsewhere."""
    scene = load("indirect_room")
    one = picture(scene, iterations=16)
    monkeypatch.delenv(FORM)
    chosen = renderer(scene, iterations=16)
    assert chosen.statistics.eye_form in FORMS
    assert chosen.metadata()["eye_form"] == chosen.statistics.eye_form
    print(f"{form} and chosen: {chosen.statistics.eye_form}")
    other = chosen.read()[..., :3].astype(np.float64)
    size = np.maximum(np.abs(one), 1e-2 * one.mean())
    assert (np.abs(one - other) > 1e-3 * size).any(axis=-1).mean() < 0.1


def test_a_window_is_a_part_of_the_whole() -> None:
    whole = renderer(load("cornell_box"), splats=False).read()
    part = renderer(load("cornell_box", Film(48, 48, (5, 7, 20, 11))), splats=False).read()
    np.testing.assert_array_equal(part, whole[7:18, 5:25])


def test_ranges_add_up_to_the_whole() -> None:
    scene = load("indirect_room")
    whole = renderer(scene, iterations=6, adaptive=False)
    first = renderer(scene, iterations=2, adaptive=False)
    rest = renderer(scene, iterations=4, first=2, adaptive=False)
    first.add_film_state(rest.film_state(), 4)
    np.testing.assert_array_equal(first.film_state(), whole.film_state())


def test_both_devices_together_make_the_same_iterations() -> None:
    """What the CPU made differs in the last bits, and a few paths in more."""
    if DEVICE == "CPU":
        pytest.skip("needs a GPU")
    scene = load("cornell_box")
    both, alone = (renderer(scene, device, 64, adaptive=False) for device in ("HYBRID", DEVICE))
    assert both.metadata()["ranges"] == [[0, 64]]
    np.testing.assert_allclose(both.read()[..., :3].mean(), alone.read()[..., :3].mean(), rtol=1e-3)


def test_memory_that_cannot_be_had_is_named_and_the_cpu_renders(monkeypatch: pytest.MonkeyPatch) -> None:
    if DEVICE == "CPU":
        pytest.skip("needs a GPU")
    scene = load("cornell_box")
    for limit, what in ((1000, "the scene"), (200_000, "")):
        monkeypatch.setenv("VLP_BPT_GPU_MEMORY", str(limit))
        made = Renderer(scene, RenderSettings(samples=2, device="CUDA", light_paths=100_000))  # type: ignore[arg-type]
        (warning,) = made.warnings
        assert "device CUDA: allocating " in warning
        assert f" bytes for {what}" in warning
        assert warning.endswith("out of memory; rendering on the CPU")
        assert made.iterate(2) == 2
    monkeypatch.delenv("VLP_BPT_GPU_MEMORY")
    assert not Renderer(scene, RenderSettings(samples=2, device="CUDA")).warnings  # type: ignore[arg-type]


def test_memory_is_what_was_planned() -> None:
    scene = load("indirect_room")
    settings = RenderSettings.from_dict({"samples": 2, "device": DEVICE})
    native_scene = load_native().Scene()
    upload(scene, native_scene)
    native_scene.build(0)
    planned = plan_memory(scene, native_scene, settings)
    made = renderer(scene, filter="BLACKMAN_HARRIS")
    assert made.memory == planned
    print(planned)


def test_light_paths_are_halved_until_they_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the same random numbers as a render of so many light paths."""
    if DEVICE == "CPU":
        pytest.skip("needs a GPU")
    monkeypatch.setenv(FORM, "paths")  # a wavefront would make room first
    scene = load("cornell_box")
    settings = RenderSettings.from_dict({"samples": 4, "device": DEVICE, "light_paths": 64_000, "filter": "BOX"})
    asked = Renderer(scene, settings).memory["CUDA"]
    in_buffers = sum(size for part, size in asked.items() if part != "stacks")
    monkeypatch.setenv("VLP_BPT_GPU_MEMORY", str(in_buffers - asked["light_vertices"] * 3 // 5))
    made = Renderer(scene, settings)
    (warning,) = made.warnings
    assert warning == "device CUDA: out of memory for 64000 light paths; rendering with 16000"
    assert made.iterate(4) == 4
    assert made.metadata()["settings"]["light_paths"] == 16_000
    monkeypatch.delenv("VLP_BPT_GPU_MEMORY")
    np.testing.assert_array_equal(made.film_state(), renderer(scene, light_paths=16_000).film_state())


def test_updates_upload_what_has_changed() -> None:
    scene = load("cornell_box")
    made = renderer(scene)
    uploaded = made.uploaded_bytes
    assert (uploaded > 0) == (DEVICE != "CPU")
    assert scene.camera is not None
    scene.camera.half_width *= 0.8
    made.update(scene)
    assert made.uploaded_bytes == uploaded
    scene.materials[0] = replace(scene.materials[1], name="other")
    made.update(scene)
    assert made.uploaded_bytes - uploaded < 20_000
    assert made.iterate(4) == 4
    np.testing.assert_array_equal(made.film_state(), renderer(scene).film_state())


def test_a_picture_may_be_read_at_any_time() -> None:
    """Sums come from the device while it goes on: nothing is lost or counted twice."""
    scene = load("indirect_room")
    made = renderer(scene, iterations=1)
    for count in (1, 3, 2):
        made.read()
        assert made.iterate(count) == count
    made.read()
    assert made.iterations == 7
    np.testing.assert_array_equal(made.film_state(), renderer(scene, iterations=7).film_state())


def test_it_stops_at_once() -> None:
    """Within 50 ms of being told to, and 50 ms for the thread that asks."""
    scene = load("indirect_room", Film(1024, 1024))
    made = Renderer(scene, RenderSettings(samples=1 << 20, device=DEVICE))  # type: ignore[arg-type]
    told: list[float] = []

    def stop() -> None:
        told.append(time.perf_counter())
        made.cancel()

    Timer(1.0, stop).start()
    made.iterate(1 << 20)
    latency = time.perf_counter() - told[0]
    print(f"stopped after {1e3 * latency:.1f} ms")
    assert latency < 0.1
