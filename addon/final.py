"""Final renders (F12 and the command line): exports a view layer, renders it, and fills Blender's picture as it comes.

Whatever happens, the picture is begun and ended and errors are reported: an exception that reaches Blender would give
a blank file and the exit code of success.
"""

from __future__ import annotations

import contextlib
import json
import threading
import time
import traceback
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from . import core, figures

if TYPE_CHECKING:
    from .export.notes import Notes

# Showing the picture costs up to a second at 4K: this share of the time at most goes into it.
SHARE_OF_SHOWING = 0.1
LEAST_SECONDS_BETWEEN_PICTURES = 0.25

# Without a window Blender prints every status line: a few are enough to see that it goes on.
SECONDS_BETWEEN_PRINTED_LINES = 5.0

# Warnings already reported in this picture or animation.
_reported: set[str] = set()

# Engines that render at this moment, and whether they are to stop.
_running: list[Any] = []
_stop = threading.Event()


def render(engine: Any, depsgraph: Any) -> None:
    """Renders one view layer into Blender's result, and reports what went wrong or was left out."""
    started = time.perf_counter()
    picture = None
    _running.append(engine)
    try:
        picture = Picture(engine, depsgraph)
        _render(engine, depsgraph, picture, started)
    except Exception as error:
        engine.report({"ERROR"}, explain(error))
    finally:
        if picture is not None:
            picture.end(_Break(engine).is_set())
        _running.remove(engine)


def stop_all(most_seconds: float = 5.0) -> None:
    """Ends what renders on other threads and keeps its picture, before the engine's class goes.

    Blender goes on with an engine whose class is gone, and crashes.
    """
    if not _running:
        return
    _stop.set()
    ends = time.monotonic() + most_seconds
    while _running and time.monotonic() < ends:
        time.sleep(0.01)
    time.sleep(0.2)  # Blender's own last steps with the engine
    _stop.clear()


def explain(error: Exception) -> str:
    """An error in one line: the message of those that we expect, the kind of the others, which the console details."""
    from .export.notes import ExportError

    expected: tuple[type[Exception], ...] = (core.CoreMissing, ExportError)
    with contextlib.suppress(core.CoreMissing):
        expected += (core.load("vlp_bpt.errors").Error,)
    if isinstance(error, expected):
        return f"VLP-BPT: {error}"
    traceback.print_exception(error)
    return f"VLP-BPT: internal error, {type(error).__name__}: {error} (the console has more)"


def _render(engine: Any, depsgraph: Any, picture: Picture, started: float) -> None:
    vlp_bpt = core.load()
    from .export.scene import Notes, export_scene
    from .export.settings import export_settings

    engine.update_stats("", "Reading the scene")
    notes = Notes()
    settings = export_settings(depsgraph.scene_eval)
    scene = export_scene(
        depsgraph, width=engine.resolution_x, height=engine.resolution_y, window=picture.window, notes=notes
    )
    _without_missing_denoiser(settings, notes)
    if picture.views > 1:
        notes.warn("Stereoscopy is not there yet: every view gets the same picture")
    if _Break(engine).is_set():
        return
    engine.update_stats("", "Building the scene")
    renderer = vlp_bpt.Renderer(scene, settings)
    _forget_reports(engine, depsgraph)
    _report(engine, renderer, notes)
    try:
        image = renderer.render(_Watcher(engine, depsgraph, renderer, picture, len(notes.warnings)), _Break(engine))
    except vlp_bpt.Cancelled:
        return
    finally:
        _report(engine, renderer, notes)  # of a device that has failed
    picture.fill(image.pixels, image.layers)
    _record(engine, depsgraph, renderer, time.perf_counter() - started, notes.warnings)


def _without_missing_denoiser(settings: Any, notes: Notes) -> None:
    """The picture stays noisy, with a warning, where this Blender has no denoiser."""
    if settings.denoise:
        try:
            core.load("vlp_bpt.denoise").load()
        except core.load("vlp_bpt.errors").DeviceError as error:
            notes.warn(f"The picture stays noisy: {error}")
            settings.denoise = False


class Picture:
    """Blender's render result while it is open: its window of the full picture, and the pixels of every view."""

    def __init__(self, engine: Any, depsgraph: Any) -> None:
        self._engine = engine
        self._name = depsgraph.view_layer.name
        width, height = engine.resolution_x, engine.resolution_y
        self._result = engine.begin_result(0, 0, width, height, layer=self._name)
        if self._result is None or not self._result.layers:
            raise RuntimeError(f"Blender has no result for view layer '{self._name}'")
        self._size = (self._result.resolution_x, self._result.resolution_y)
        self.window = window(depsgraph.scene.render, (width, height), self._size)
        self.views = len(self._result.views)
        self._pixels: Any = None
        self._filled = False
        self._shown = 0.0
        self._cost = 0.0

    def due(self) -> bool:
        """Whether enough time went by since the picture was last shown. Nobody looks when there is no window."""
        if bpy.app.background:
            return False
        pause = max(LEAST_SECONDS_BETWEEN_PICTURES, self._cost / SHARE_OF_SHOWING)
        return not self._filled or time.perf_counter() - self._shown >= pause

    def show(self, renderer: Any) -> None:
        """Fills the picture and has Blender draw it."""
        began = time.perf_counter()
        width, height = self._size
        if self._pixels is None:
            self._pixels = np.empty((height, width, 4), np.float32)
        self.fill(renderer.read(self._pixels), renderer.layers())
        self._engine.update_result(self._result)
        self._shown = time.perf_counter()
        self._cost = self._shown - began

    def fill(self, pixels: Any, layers: dict[str, Any]) -> None:
        """Writes the picture, (height, width, 4), and further passes by name: rows from the bottom, as Blender's."""
        images = {"Combined": pixels, "Noisy Image": pixels} | layers
        for render_pass in self._result.layers[0].passes:
            if render_pass.name in images:
                render_pass.rect.foreach_set(images[render_pass.name].reshape(-1))
        self._filled = True

    def end(self, cancelled: bool) -> None:
        """Hands the result back to Blender with what was rendered before a cancel.

        Always merged: a picture that was never filled makes Blender crash when it is written to an EXR file.
        """
        self._engine.end_result(self._result, cancel=cancelled, do_merge_results=True)


def window(settings: Any, full: tuple[int, int], size: tuple[int, int]) -> tuple[int, int, int, int] | None:
    """(x, y, width, height) of a border render in the full picture, or None where all of it is rendered.

    Blender gives the size of the result but not its corner, which it cuts to whole pixels in single precision.
    """
    if not settings.use_border:
        return None
    corner = (
        int(np.float32(border) * np.float32(pixels))
        for border, pixels in zip((settings.border_min_x, settings.border_min_y), full, strict=True)
    )
    x, y = (max(min(start, whole - part), 0) for start, whole, part in zip(corner, full, size, strict=True))
    return (x, y, *size)


class _Break:
    """Esc or `stop_all`, as a flag that the renderer asks about."""

    def __init__(self, engine: Any) -> None:
        self._engine = engine

    def is_set(self) -> bool:
        return _stop.is_set() or bool(self._engine.test_break())


class _Watcher:
    """Called as the render goes on: progress bar, status line and, now and then, the picture."""

    def __init__(self, engine: Any, depsgraph: Any, renderer: Any, picture: Picture, warnings: int) -> None:
        self._engine, self._renderer, self._picture = engine, renderer, picture
        self._layer, self._layers = _place_of_layer(depsgraph)
        self._warnings = f" | {warnings} warning{'s' if warnings > 1 else ''}" if warnings else ""
        self._pause = SECONDS_BETWEEN_PRINTED_LINES if bpy.app.background else 0.0
        self._told = float("-inf")

    def __call__(self, progress: Any) -> None:
        taken = self._renderer.statistics
        self._engine.update_progress((self._layer + progress.fraction) / self._layers)
        if progress.fraction >= 1 or time.perf_counter() - self._told >= self._pause:
            self._told = time.perf_counter()
            ends = progress.fraction >= 1 and self._renderer.settings.denoise
            text = "Denoising" if ends else figures.status(taken, progress)
            self._engine.update_stats("", text + self._warnings)
        megabytes = taken.memory_bytes / 2**20
        self._engine.update_memory_stats(memory_used=megabytes, memory_peak=megabytes)
        if progress.picture and self._picture.due():
            self._picture.show(self._renderer)


def _place_of_layer(depsgraph: Any) -> tuple[int, int]:
    """Which of the view layers to render this is, and how many there are."""
    scene = depsgraph.scene
    names = [layer.name for layer in scene.view_layers if layer.use]
    name = depsgraph.view_layer.name
    if scene.render.use_single_layer or name not in names:
        return 0, 1
    return names.index(name), len(names)


def _forget_reports(engine: Any, depsgraph: Any) -> None:
    """At the first layer of a picture or of an animation."""
    scene = depsgraph.scene
    starts = not engine.is_animation or scene.frame_current == scene.frame_start
    if starts and _place_of_layer(depsgraph)[0] == 0:
        _reported.clear()


def _report(engine: Any, renderer: Any, notes: Notes) -> None:
    """Reports each warning, the renderer's too, once in a picture or animation."""
    for warning in renderer.warnings:
        notes.warn(warning)
    for warning in notes.warnings:
        if warning not in _reported:
            _reported.add(warning)
            engine.report({"WARNING"}, f"VLP-BPT: {warning}")


def _record(engine: Any, depsgraph: Any, renderer: Any, seconds: float, warnings: list[str]) -> None:
    """Keeps the statistics for the panel, and stamps them into the result for the files that are written from it."""
    taken = renderer.statistics
    layer = depsgraph.view_layer.name
    figures.last[(depsgraph.scene.name, layer)] = figures.lines(taken, seconds, renderer.lost_light(), warnings)
    result = engine.get_result()
    if result is None:
        return
    stamps = {
        "render_time": figures.duration(taken.seconds),
        "total_time": figures.duration(seconds),
        "iterations": str(taken.iterations),
        **({} if taken.noise is None else {"noise": f"{taken.noise:.3g}"}),
        "settings": json.dumps(renderer.metadata()["settings"]),
        "version": core.load().__version__,
    }
    for name, value in stamps.items():
        result.stamp_data_add_field(f"VLP_BPT.{layer}.{name}", value)
