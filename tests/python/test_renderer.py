"""The renderer: progress, limits and cancellation on a core made of sleep, pictures and ranges on the real one."""

from __future__ import annotations

import _thread
import itertools
import threading
import time
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from small_scenes import everything, room

import vlp_bpt
from vlp_bpt import Cancelled, DeviceError, Mode, Renderer, RenderSettings, SceneError, SettingsError
from vlp_bpt.render import Progress
from vlp_bpt.scene import Mesh, Scene


def make(samples: int = 10, scene: Scene | None = None, first: int = 0, **settings: Any) -> Renderer:
    return Renderer(scene or room(), RenderSettings(samples=samples, **settings), first_iteration=first)


# What goes to the core


def test_everything_is_uploaded(fake: Any) -> None:
    scene = everything()
    native = make(scene=scene)._native.scene
    ((positions, triangles, normals, uvs, slots),) = native.arguments("add_mesh")
    mesh = scene.geometries[0]
    assert isinstance(mesh, Mesh)
    assert positions is mesh.positions
    assert (triangles is mesh.triangles, normals is mesh.corner_normals, slots is mesh.material_index) == (True,) * 3
    assert uvs is mesh.uvs["UVMap"]
    assert len(native.arguments("add_spheres")) == 1
    assert len(native.arguments("add_material")) == 2
    kinds, fresnels, weights, *_, emission = native.arguments("add_material")[0]
    assert (kinds.tolist(), fresnels.tolist(), weights.shape, emission) == ([2, 0], [3, 0], (2, 3), (1.5, 0.0, 0.25))
    assert native.arguments("add_material")[1][2].shape == (0, 3)
    placed = native.arguments("add_instance")  # the empty mesh is left out, and its instance with it
    assert [(geometry, slots.tolist(), seen) for geometry, _, slots, seen in placed] == [(0, [1, 0, 1], 0), (0, [0], 1)]
    assert native.arguments("add_point_light") == [((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), 0.25, 1)]
    assert native.arguments("add_spot_light")[0][1:] == ((1.0, 1.0, 1.0), 1.0, 0.5, 0.1, 1)
    assert native.arguments("add_sun_light")[0][1:] == ((2.0, 2.0, 2.0), 0.01, 1)
    assert native.arguments("add_area_light")[0][1:] == ((3.0, 3.0, 3.0), 0.5, 0.25, True, 1.5, 1)
    ((texels, to_image),) = native.arguments("set_world_image")
    assert scene.world.image is not None
    assert texels == pytest.approx(scene.world.image * (0.1, 0.2, 0.4))
    assert to_image.tolist() == [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
    assert native.arguments("set_film") == [(64, 48, 3, 5, 20, 10, True)]
    assert native.calls[-1][0] == "build"


def test_the_camera_goes_without_its_scale(fake: Any) -> None:
    scene = room()
    assert scene.camera is not None
    scene.camera.transform = np.array([[2, 0, 0, 5], [0, 0.5, 0, 6], [0, 0, -3, 7]], dtype=np.float32)
    ((transform, *_),) = make(scene=scene)._native.scene.arguments("set_camera")
    assert transform.dtype == np.float32
    assert transform.tolist() == [[1, 0, 0, 5], [0, 1, 0, 6], [0, 0, -1, 7]]


def test_settings_go_resolved(fake: Any) -> None:
    sent = make(first=30, mode=Mode.PAPER)._native.settings
    assert sent["iteration_begin"] == 30
    assert (sent["mode"], sent["weighting"], sent["light_path_length"], sent["light_paths"]) == (
        "PAPER",
        "UNIFORM",
        1,
        192,
    )
    assert all(type(value) in (str, int, float, bool) for value in sent.values())


# The flow of a render


def test_all_iterations_are_rendered_and_averaged(fake: Any) -> None:
    renderer = make(5, first=10)
    image = renderer.render()
    assert (image.pixels == 13).all()  # mean of 11 to 15
    assert image.pixels.shape == (12, 16, 4)
    assert image.metadata["ranges"] == [[10, 15]]
    assert image.metadata["iterations"] == 5
    assert image.metadata["version"] == vlp_bpt.__version__
    assert image.metadata["settings"]["samples"] == 5
    assert threading.current_thread().name not in renderer._native.threads


def test_a_render_goes_on_where_the_last_one_ended(fake: Any) -> None:
    renderer = make(5)
    renderer.render()
    assert (renderer.render().pixels == 5.5).all()
    assert renderer.iterations == 10
    assert renderer.metadata()["ranges"] == [[0, 10]]


def test_statistics_count_what_was_rendered(fake: Any) -> None:
    fake.seconds = 0.001
    renderer = make(8, light_paths=100)
    renderer.render()
    found = renderer.statistics
    assert (found.iterations, found.eye_samples, found.light_paths, found.vlps) == (8, 8 * 192, 800, 7)
    assert found.memory_bytes == 120
    assert found.seconds >= 0.008
    assert found.eye_samples_per_second == pytest.approx(8 * 192 / found.seconds)


def test_iterations_that_a_device_loses_at_the_end_are_rendered_again(fake: Any) -> None:
    renderer = make(8)
    fake.loses = 3
    image = renderer.render()
    assert image.metadata["ranges"] == [[0, 8]]
    assert (image.pixels == 4.5).all()  # mean of 1 to 8
    assert sum(renderer._native.asked) == 11


def test_the_light_paths_that_there_was_room_for_are_told(fake: Any) -> None:
    renderer = make(2, light_paths=100)
    assert renderer.metadata()["settings"]["light_paths"] == 100
    renderer._native.light_paths = 25
    assert renderer.metadata()["settings"]["light_paths"] == 25
    renderer._native.light_paths, renderer._native.light_rounds = 4 * 25, 4
    assert renderer.metadata()["settings"]["light_paths"] == 25, "those of one round"
    renderer._native.light_paths = 0  # none are needed
    assert renderer.metadata()["settings"]["light_paths"] == 100


def test_progress_is_told_often_and_ends_at_one(fake: Any) -> None:
    fake.seconds = 0.01
    told: list[tuple[float, Progress]] = []
    renderer = make(100)
    renderer.render(lambda progress: told.append((time.perf_counter(), progress)))
    assert max(later - sooner for (sooner, _), (later, _) in itertools.pairwise(told)) < 0.5
    assert max(renderer._native.asked) > 4  # several short iterations a call
    fractions = [progress.fraction for _, progress in told]
    assert fractions[-1] == 1
    counts = [progress.iterations for _, progress in told]
    assert counts == sorted(counts)
    assert told[-1][1].remaining == 0


def test_progress_goes_on_within_a_long_iteration(fake: Any) -> None:
    fake.seconds = 1.2
    told: list[Progress] = []
    make(1).render(told.append)
    within = [progress for progress in told if not progress.picture]
    assert len(within) >= 3
    assert all((progress.iterations, progress.fraction) == (0, 0.5) for progress in within)
    assert told[-1].picture


def test_reading_waits_for_the_iteration_under_way(fake: Any) -> None:
    fake.seconds = 0.3
    renderer = make(2)
    seen: list[float] = []

    def look(progress: Progress) -> None:
        seen.append(float(renderer.read()[0, 0, 0]))

    renderer.render(lambda progress: look(progress) if progress.picture else None)
    assert seen == [1, 1.5]


def test_the_time_limit_ends_a_render(fake: Any) -> None:
    fake.seconds = 0.02
    renderer = make(100_000, time_limit=0.5)
    started = time.perf_counter()
    renderer.render()
    assert 0.3 < time.perf_counter() - started < 1.5
    assert 1 < renderer.iterations <= 25
    assert renderer._native.deadline == float("inf")


def test_one_iteration_is_rendered_whatever_the_limit(fake: Any) -> None:
    fake.seconds = 0.2
    renderer = make(10, time_limit=0.001)
    renderer.render()
    assert renderer.iterations == 1


def test_a_flag_cancels_and_keeps_the_picture(fake: Any) -> None:
    fake.seconds = 0.02
    flag = threading.Event()
    threading.Timer(0.3, flag.set).start()
    started = time.perf_counter()
    renderer = make(100_000)
    assert renderer.render(cancel=flag).pixels.min() >= 1
    assert time.perf_counter() - started < 1.5
    assert renderer.metadata()["ranges"] == [[0, renderer.iterations]]


def test_cancel_from_another_thread_stops_a_long_iteration(fake: Any) -> None:
    fake.seconds = 60
    renderer = make()
    threading.Timer(0.2, renderer.cancel).start()
    started = time.perf_counter()
    with pytest.raises(Cancelled, match="before its first iteration was complete"):
        renderer.render()
    assert time.perf_counter() - started < 1.5


def test_a_cancelled_renderer_can_render_again(fake: Any) -> None:
    renderer = make(3)
    renderer.cancel()
    assert (renderer.render().pixels == 2).all()


def test_poll_stops_iterate(fake: Any) -> None:
    fake.seconds = 60
    calls: list[int] = []

    def poll() -> bool:
        calls.append(1)
        return len(calls) == 3

    assert make().iterate(5, poll) == 0
    assert len(calls) >= 3


def test_an_exception_of_the_callback_stops_the_render(fake: Any) -> None:
    fake.seconds = 0.05
    renderer = make(1000)

    def fail(progress: Progress) -> None:
        raise KeyError("callback")

    with pytest.raises(KeyError, match="callback"):
        renderer.render(fail)
    count = renderer.iterations
    time.sleep(0.2)
    assert renderer.iterations == count  # nothing runs on behind


def test_keyboard_interrupt_keeps_the_picture(fake: Any) -> None:
    fake.seconds = 0.05
    renderer = make(100_000)
    threading.Timer(0.4, _thread.interrupt_main).start()
    started = time.perf_counter()
    image = renderer.render()
    assert time.perf_counter() - started < 1.5
    assert renderer.interrupted
    assert image.metadata["iterations"] == renderer.iterations >= 1


def test_keyboard_interrupt_before_the_first_picture(fake: Any) -> None:
    fake.seconds = 60
    threading.Timer(0.2, _thread.interrupt_main).start()
    with pytest.raises(Cancelled):
        make().render()


# Errors


@pytest.mark.parametrize(
    ("raised", "expected", "message"),
    [
        (ValueError("film state of another size"), SceneError, "film state of another size"),
        (RuntimeError("CUDA: out of memory"), DeviceError, "CUDA: out of memory"),
        (MemoryError("std::bad_alloc"), DeviceError, "out of memory: std::bad_alloc"),
    ],
)
def test_errors_of_the_core_become_this_packages(fake: Any, raised: Exception, expected: Any, message: str) -> None:
    renderer = make()
    fake.fails = raised
    with pytest.raises(expected) as error:
        renderer.render()
    assert str(error.value) == message
    assert error.value.__cause__ is raised


def test_faults_are_found_before_anything_is_uploaded(fake: Any) -> None:
    with pytest.raises(SettingsError, match="samples = 0"):
        make(0)
    scene = room()
    scene.camera = None
    with pytest.raises(SceneError, match="scene: has no camera"):
        make(scene=scene)
    with pytest.raises(SceneError, match="first_iteration -1 must be from 0"):
        make(first=-1)


def test_warnings_are_kept(fake: Any) -> None:
    scene = room()
    scene.lights = []
    assert make(scene=scene).warnings == ["scene: nothing emits light, the picture will be black"]


def test_a_missing_core_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "vlp_bpt._native", None)
    with pytest.raises(DeviceError, match="the native core of VLP-BPT cannot be loaded"):
        vlp_bpt.devices()
    with pytest.raises(DeviceError, match="the native core of VLP-BPT cannot be loaded"):
        make()


# The real core


def test_there_is_a_processor() -> None:
    (cpu,) = [device for device in vlp_bpt.devices() if device["kind"] == "CPU"]
    assert {"name", "memory", "isa"} <= cpu.keys()


def test_a_room_is_rendered() -> None:
    renderer = make(16, room(32, 24))
    image = renderer.render()
    assert image.pixels.shape == (24, 32, 4)
    assert np.isfinite(image.pixels).all()
    assert (image.pixels[..., 3] == 1).all()
    assert 0.05 < image.pixels[..., :3].mean() < 1
    assert renderer.statistics.vlps > 0
    assert renderer.statistics.memory_bytes > 0
    # The lamp is under the ceiling: rows count from the bottom, so the floor, in the lower half, is lit directly.
    assert image.pixels[:12, :, :3].mean() > image.pixels[12:, :, :3].mean()


def test_the_window_is_a_part_of_the_whole_picture() -> None:
    whole = make(4, room(32, 24), filter=vlp_bpt.Filter.BOX, filter_width=1.0).render().pixels
    scene = room(32, 24)
    scene.film.window = (5, 3, 9, 7)
    part = make(4, scene, filter=vlp_bpt.Filter.BOX, filter_width=1.0).render().pixels
    assert np.array_equal(part, whole[3:10, 5:14])


def test_ranges_add_up_bit_for_bit_in_any_order() -> None:
    whole = make(12, adaptive=False).render().pixels
    parts = [
        make(samples, first=first, threads=threads, adaptive=False)
        for first, samples, threads in ((7, 5, 1), (0, 3, 2), (3, 4, 0))
    ]
    for part in parts:
        part.render()
    states = [(part.film_state(), part.iterations) for part in parts]
    for order in ((0, 1, 2), (2, 0, 1)):
        merged = make(1, adaptive=False)
        for i in order:
            merged.add_film_state(*states[i])
        assert merged.iterations == 12
        assert np.array_equal(merged.read(), whole)


def test_the_real_core_cancels_within_an_iteration() -> None:
    renderer = make(10, room(1024, 1024))
    flag = threading.Event()
    started: list[float] = []

    def stop(progress: Progress) -> None:
        if not flag.is_set():
            flag.set()
            started.append(time.perf_counter())

    with suppress(Cancelled):  # the first report may come before or after the first iteration is complete
        renderer.render(stop, flag)
    assert renderer.iterations < 10
    assert time.perf_counter() - started[0] < 1
