"""The life of a final render, with a renderer that needs no native core."""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy
import bpy_scenes as scenes
import numpy as np
import OpenImageIO
import pytest
from fake_renderer import FakeRenderer

import addon
import vlp_bpt
from addon import figures, final
from vlp_bpt.errors import DeviceError
from vlp_bpt.render import Progress, Statistics


@pytest.fixture(autouse=True)
def fake(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[FakeRenderer]]:
    monkeypatch.setattr(vlp_bpt, "Renderer", FakeRenderer)
    monkeypatch.setattr(FakeRenderer, "error", None)
    FakeRenderer.made.clear()
    yield FakeRenderer.made
    FakeRenderer.made.clear()


class Spy:
    """The engine that Blender made, its reports noted and Esc pressed when we say: RNA functions cannot be patched."""

    def __init__(self, real: Any, watch: Watch) -> None:
        self._real, self._watch = real, watch

    def __getattr__(self, name: str) -> Any:
        return getattr(self._real, name)

    def report(self, kind: set[str], text: str) -> None:
        self._watch.reports.append((next(iter(kind)), text))
        self._real.report(kind, text)

    def test_break(self) -> bool:
        return time.perf_counter() >= self._watch.esc_at

    def update_stats(self, stats: str, info: str) -> None:
        self._watch.lines.append(info)
        self._real.update_stats(stats, info)

    def end_result(self, result: Any, **options: Any) -> None:
        self._watch.ends.append(options)
        self._real.end_result(result, **options)


@dataclass
class Watch:
    reports: list[tuple[str, str]] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    ends: list[dict[str, bool]] = field(default_factory=list)
    esc_at: float = float("inf")

    def count(self, text: str, kind: str = "WARNING") -> int:
        return sum(text in said and reported == kind for reported, said in self.reports)


@pytest.fixture
def watch(monkeypatch: pytest.MonkeyPatch) -> Watch:
    """What the engine says to Blender."""
    watched = Watch()
    render_layer = final.render
    monkeypatch.setattr(final, "render", lambda real, depsgraph: render_layer(Spy(real, watched), depsgraph))
    return watched


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """Where the picture goes: 32-bit EXR, so that pixels come back as they were."""
    settings = bpy.context.scene.render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    bpy.context.scene.render.filepath = str(tmp_path / "picture.exr")
    return tmp_path / "picture.exr"


def render(**options: Any) -> None:
    bpy.ops.render.render(write_still=True, **options)


def pixels(path: Path) -> Any:
    """(height, width, 4) of a file, row 0 at the bottom."""
    image = OpenImageIO.ImageInput.open(str(path))
    values = image.read_image("float")
    image.close()
    return values[::-1]


def metadata(path: Path) -> dict[str, str]:
    image = OpenImageIO.ImageInput.open(str(path))
    attributes = {item.name: item.value for item in image.spec().extra_attribs}
    image.close()
    return attributes


def expected(width: int, height: int, window: tuple[int, int, int, int]) -> Any:
    x, y, w, h = window
    red = np.broadcast_to((x + np.arange(w)) / width, (h, w))
    green = np.broadcast_to(((y + np.arange(h)) / height)[:, None], (h, w))
    return np.stack([red, green], axis=-1)


def test_a_picture_arrives_the_right_way_up(out: Path, watch: Watch) -> None:
    scenes.camera()
    scenes.light("POINT")
    render()
    picture = pixels(out)
    assert np.allclose(picture[..., :2], expected(64, 48, (0, 0, 64, 48)))
    assert np.allclose(picture[..., 2:], (2, 1))
    assert not watch.reports


def test_resolution_percentage_and_pixel_aspect(out: Path, fake: list[FakeRenderer]) -> None:
    scenes.camera()
    settings = bpy.context.scene.render
    settings.resolution_percentage = 50
    settings.pixel_aspect_y = 2.0
    render()
    film, camera = fake[0].scene.film, fake[0].scene.camera
    assert (film.width, film.height, film.window) == (32, 24, None)
    assert camera.half_height / camera.half_width == pytest.approx(2 * 24 / 32)


def test_borders_and_crops(out: Path, fake: list[FakeRenderer]) -> None:
    """Any border gives the pixels of its own place, in the whole picture or cut out of it."""
    scenes.camera()
    settings = bpy.context.scene.render
    settings.use_border = True
    random = np.random.default_rng(7)
    for case in range(12):
        settings.resolution_x, settings.resolution_y = (int(size) for size in random.integers(20, 120, 2))
        low, high = np.sort(random.random((2, 2)), axis=0)
        high = np.maximum(high, low + 0.2)
        settings.border_min_x, settings.border_min_y = low
        settings.border_max_x, settings.border_max_y = np.minimum(high, 1)
        settings.use_crop_to_border = bool(case % 2)
        fake.clear()
        render()
        film = fake[0].scene.film
        assert (film.width, film.height) == (settings.resolution_x, settings.resolution_y)
        x, y, width, height = film.window
        picture = pixels(out)
        if settings.use_crop_to_border:
            assert picture.shape[:2] == (height, width)
        else:
            assert picture.shape[:2] == (film.height, film.width)
            outside = np.ones(picture.shape[:2], bool)
            outside[y : y + height, x : x + width] = False
            assert not picture[outside].any()
            picture = picture[y : y + height, x : x + width]
        assert np.allclose(picture[..., :2], expected(film.width, film.height, film.window)), settings.resolution_x


def test_a_border_sees_what_the_whole_picture_sees_there(out: Path, fake: list[FakeRenderer]) -> None:
    scenes.camera(shift_x=0.1)
    render()
    settings = bpy.context.scene.render
    settings.use_border, settings.border_min_x, settings.border_max_y = True, 0.5, 0.25
    render()
    assert fake[0].scene.camera.half_width == fake[1].scene.camera.half_width
    assert fake[0].scene.camera.shift == fake[1].scene.camera.shift


def test_view_layers_in_turn(out: Path, fake: list[FakeRenderer]) -> None:
    scenes.camera()
    scene = bpy.context.scene
    collection = bpy.data.collections.new("only first")
    scene.collection.children.link(collection)
    collection.objects.link(bpy.data.objects.new("first", scenes.mesh()))
    scenes.link("both", scenes.mesh("both"))
    second = scene.view_layers.new("second")
    second.layer_collection.children["only first"].exclude = True
    scene.view_layers.new("off").use = False
    render()
    assert [sorted(item.name for item in made.scene.instances) for made in fake] == [["both", "first"], ["both"]]
    stamps = metadata(out)
    for layer in ("ViewLayer", "second"):
        assert stamps[f"VLP_BPT.{layer}.render_time"] == "00:00:03.00"
    assert "VLP_BPT.off.render_time" not in stamps


def test_what_the_render_took_is_stamped_into_the_file(out: Path) -> None:
    scenes.camera()
    render()
    stamps = metadata(out)
    assert stamps["VLP_BPT.ViewLayer.iterations"] == "2"
    assert stamps["VLP_BPT.ViewLayer.version"] == vlp_bpt.__version__
    assert json.loads(stamps["VLP_BPT.ViewLayer.settings"])["samples"] == 2
    hours, minutes, seconds = stamps["VLP_BPT.ViewLayer.total_time"].split(":")
    assert 0 <= int(hours) * 3600 + int(minutes) * 60 + float(seconds) < 60
    assert dict(figures.last[("Scene", "ViewLayer")])["Iterations"] == "2"


@pytest.mark.parametrize("seconds, text", [(0, "00:00:00.00"), (59.999, "00:01:00.00"), (3723.456, "01:02:03.46")])
def test_times_are_hours_minutes_seconds(seconds: float, text: str) -> None:
    assert figures.duration(seconds) == text


def test_noise_is_shown_where_it_is_known() -> None:
    taken = Statistics(64, 1.0, 0.1, 1000, 500, 42, 0, {}, noise=0.01234)
    assert ("Noise", "0.012") in figures.lines(taken, 2.0, (0.0, 0.0), [])
    assert "Noise 0.02 |" in figures.status(taken, Progress(32, 64, 0.5, 1.0, 1.0, True, noise=0.02))
    taken = Statistics(64, 1.0, 0.1, 1000, 500, 42, 0, {})
    assert "Noise" not in dict(figures.lines(taken, 2.0, (0.0, 0.0), []))
    assert "Noise" not in figures.status(taken, Progress(32, 64, 0.5, 1.0, 1.0, True))


@pytest.mark.parametrize(
    "portals, lights, text", [(0, 0, None), (1, 0, "1 window"), (0, 2, "2 lights"), (2, 1, "2 windows, 1 light")]
)
def test_it_shows_where_light_is_sent(portals: int, lights: int, text: str | None) -> None:
    taken = Statistics(64, 1.0, 0.1, 1000, 500, 42, 0, {}, portals=portals, favoured_lights=lights)
    assert dict(figures.lines(taken, 2.0, (0.0, 0.0), [])).get("Light Sent To") == text


@pytest.mark.parametrize("persistent", [False, True])
def test_animations(tmp_path: Path, fake: list[FakeRenderer], persistent: bool, watch: Watch) -> None:
    scenes.camera()
    scenes.link("hair", bpy.data.hair_curves.new("hair"))
    shown = scenes.link("mover", scenes.mesh())
    for frame in (1, 3):
        shown.location.x = frame
        shown.keyframe_insert("location", frame=frame)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 3
    scene.render.use_persistent_data = persistent
    scene.render.filepath = str(tmp_path / "frame_")
    bpy.ops.render.render(animation=True)
    assert [made.scene.instances[0].transform[0, 3] for made in fake] == pytest.approx([1, 2, 3])
    assert len(list(tmp_path.glob("frame_*"))) == 3
    assert watch.count("'hair'") == 1


def test_render_visibility_is_that_of_renders(out: Path, fake: list[FakeRenderer]) -> None:
    """What is instanced on vertices is hidden itself in renders, and modifiers have their render levels."""
    scenes.camera()
    points = scenes.link("points", scenes.mesh("points", ([(x, 0, 0) for x in range(4)], [], [])))
    scenes.link("child", scenes.mesh("child")).parent = points
    points.instance_type = "VERTS"
    scenes.link("hidden", scenes.mesh()).hide_render = True
    divided = scenes.link("divided", scenes.mesh("divided"))
    modifier = divided.modifiers.new("divide", "SUBSURF")
    modifier.levels, modifier.render_levels = 1, 2
    render()
    exported = fake[0].scene
    names = sorted(item.name for item in exported.instances)
    assert names == ["child"] * 4 + ["divided"]
    (placed,) = (item for item in exported.instances if item.name == "divided")
    assert len(exported.geometries[placed.geometry].triangles) == 3 * 2 * 4


def test_the_status_line_says_how_it_goes(out: Path, watch: Watch) -> None:
    scenes.camera()
    render()
    assert watch.lines[-1] == ("Iteration 2/2 | 0.00 Mpaths/s | 42 VLPs | Mem 1.0 MB | 0:00:02 left | 1 warning")


def test_without_a_window_the_console_is_not_flooded(out: Path, watch: Watch, monkeypatch: pytest.MonkeyPatch) -> None:
    scenes.camera()
    bpy.context.scene.vlp_bpt.samples = 40
    monkeypatch.setattr(FakeRenderer, "seconds_per_iteration", 0.05)
    monkeypatch.setattr(final, "SECONDS_BETWEEN_PRINTED_LINES", 0.5)
    render()
    lines = [line for line in watch.lines if line.startswith("Iteration")]
    assert 3 <= len(lines) <= 6
    assert lines[-1].startswith("Iteration 40/40")


def test_esc_keeps_the_picture_so_far(
    out: Path, fake: list[FakeRenderer], watch: Watch, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenes.camera()
    bpy.context.scene.vlp_bpt.samples = 1000
    monkeypatch.setattr(FakeRenderer, "seconds_per_iteration", 0.1)
    watch.esc_at = time.perf_counter() + 0.5
    render()
    assert fake[0].finished_at - watch.esc_at < 0.3
    assert watch.ends == [{"cancel": True, "do_merge_results": True}]
    assert pixels(out)[0, 0, 2] == fake[0].iterations >= 2


def test_disabling_the_add_on_first_ends_its_renders(
    out: Path, fake: list[FakeRenderer], watch: Watch, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenes.camera()
    bpy.context.scene.vlp_bpt.samples = 1000
    monkeypatch.setattr(FakeRenderer, "seconds_per_iteration", 0.1)
    threading.Timer(0.5, final.stop_all).start()
    render()
    assert 2 <= fake[0].iterations == pixels(out)[0, 0, 2] < 20
    assert watch.ends == [{"cancel": True, "do_merge_results": True}]
    time.sleep(0.5)
    bpy.context.scene.vlp_bpt.samples = 1
    render()  # the next one is not stopped
    assert pixels(out)[0, 0, 2] == 1


def test_esc_before_the_first_iteration(out: Path, watch: Watch) -> None:
    scenes.camera()
    watch.esc_at = 0.0
    render()
    assert not watch.count("", kind="ERROR")
    assert watch.ends == [{"cancel": True, "do_merge_results": True}]


@pytest.mark.parametrize(
    "error, text",
    [(DeviceError("GPU 0: out of memory"), "GPU 0: out of memory"), (ZeroDivisionError("oops"), "internal error")],
)
def test_errors_while_rendering_are_reported(
    out: Path, error: Exception, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenes.camera()
    monkeypatch.setattr(FakeRenderer, "error", error)
    with pytest.raises(RuntimeError, match=text):
        render()
    monkeypatch.setattr(FakeRenderer, "error", None)
    render()  # the next one works
    assert pixels(out)[0, 0, 3] == 1


def test_no_camera(out: Path) -> None:
    with pytest.raises(RuntimeError, match=r"[Nn]o camera"):
        render()


def test_panoramic_cameras_are_refused_by_name(out: Path) -> None:
    scenes.camera(type="PANO").name = "Dome"
    with pytest.raises(RuntimeError, match=r"'Dome'.*PANO"):
        render()


def test_vertices_that_are_not_numbers_are_named(out: Path) -> None:
    scenes.camera()
    bad = scenes.mesh()
    bad.vertices[1].co.x = float("nan")
    scenes.link("Broken", bad)
    with pytest.raises(RuntimeError, match=r"'Broken'.*vertex 1"):
        render()


def test_wrong_settings_are_named(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scenes.camera()
    bpy.context.scene.vlp_bpt.light_path_length = 64
    settings = sys.modules["vlp_bpt.settings"]
    monkeypatch.setitem(settings.RANGES, "light_path_length", (0, 8))
    with pytest.raises(RuntimeError, match="light_path_length"):
        render()


def test_a_scene_without_light_renders_with_a_warning(out: Path, watch: Watch) -> None:
    scenes.camera()
    render()
    assert watch.count("emits light") == 1


def test_warnings_come_once_a_picture(out: Path, watch: Watch) -> None:
    scenes.camera()
    scenes.link("hair", bpy.data.hair_curves.new("hair"))
    bpy.context.scene.view_layers.new("second")
    for expected_count in (1, 2):
        render()
        assert watch.count("'hair'") == expected_count


def test_stereo_gives_every_view_a_picture(out: Path, watch: Watch) -> None:
    scenes.camera()
    scenes.light("POINT")
    bpy.context.scene.render.use_multiview = True
    render()
    for view in ("_L", "_R"):
        assert pixels(out.with_name(f"picture{view}.exr"))[0, 0, 3] == 1
    assert watch.count("Stereo") == 1


def test_a_core_that_cannot_be_loaded_is_one_clear_line(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scenes.camera()
    for name in [name for name in sys.modules if name.split(".")[0] == "vlp_bpt"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "vlp_bpt", None)  # import vlp_bpt raises ImportError
    addon.unregister()
    addon.register()
    assert bpy.context.scene.vlp_bpt.mode == "BALANCED"
    bpy.context.scene.vlp_bpt.mode = "PAPER"  # the presets live in the core: nothing happens
    with pytest.raises(RuntimeError, match="core cannot be loaded"):
        render()


def test_film_transparent(out: Path, fake: list[FakeRenderer]) -> None:
    scenes.camera()
    bpy.context.scene.render.film_transparent = True
    render()
    assert fake[0].scene.film.transparent
