"""One start of one engine in this process: from the call that hands it Blender's depsgraph to its first iteration.

Both begin alike: Blender as the module bpy has rendered its default scene once with the engine, so that what is loaded
and compiled once does not count, and has opened the file.
"""

from __future__ import annotations

import gc
import importlib
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import vlp_bpt
from vlp_bpt import _blender, render
from vlp_bpt.errors import Error

from . import cycles

OURS, CYCLES = "VLP-BPT", "Cycles"
ENGINES = (OURS, CYCLES)
_CYCLES_PARTS = {  # by the beginnings of what Cycles says that it does
    "Synchronizing object": "reading the scene",
    "Updating Scene BVH": "tree",
}


@dataclass(frozen=True)
class Start:
    """What one start took. seconds: of the clock; processor: of all threads; parts: of the clock, by what was done, the
    rest unnamed; peak, held: bytes that the process had more than before, at most and at the first iteration, None
    where the system does not tell."""

    engine: str
    threads: int
    seconds: float
    processor: float
    peak: int | None
    held: int | None
    parts: dict[str, float] = field(default_factory=dict)


def start(engine: str, path: Path, threads: int, size: int) -> Start:
    """Starts a render of a .blend with `size` pixels each way; raises Error where it does not come to an iteration."""
    return (_start_ours if engine == OURS else _start_cycles)(path, threads, size)


class Watch:
    """Reads the clocks and the memory when a start begins and ends; parts are added up in between."""

    def __init__(self) -> None:
        gc.collect()
        self.parts: dict[str, float] = {}
        self._before = _memory("VmRSS")
        self._began: tuple[float, float] | None = None
        self._ended: tuple[float, float, int | None, int | None] | None = None
        _forget_peak()

    def begin(self) -> None:
        self._began = time.perf_counter(), time.process_time()

    def end(self) -> None:
        """At the first iteration; what comes later is not looked at."""
        if self._ended is None:
            self._ended = time.perf_counter(), time.process_time(), _memory("VmHWM"), _memory("VmRSS")

    def time(self, owner: Any, name: str, part: str) -> None:
        """From here on the seconds of calls of `owner.name` are added to a part."""
        work = getattr(owner, name)

        def timed(*args: Any, **kwargs: Any) -> Any:
            began = time.perf_counter()
            try:
                return work(*args, **kwargs)
            finally:
                self.parts[part] = self.parts.get(part, 0.0) + time.perf_counter() - began

        setattr(owner, name, timed)

    def begin_with(self, owner: Any, name: str) -> None:
        """The start begins when `owner.name` is called."""
        work = getattr(owner, name)

        def begun(*args: Any, **kwargs: Any) -> Any:
            self.begin()
            return work(*args, **kwargs)

        setattr(owner, name, begun)

    def end_with(self, owner: Any, name: str) -> None:
        """It ends when `owner.name` is called, which is cancelled."""

        def ended(*_: Any, **__: Any) -> Any:
            self.end()
            raise vlp_bpt.Cancelled("has started")

        setattr(owner, name, ended)

    def result(self, engine: str, threads: int) -> Start:
        if self._began is None or self._ended is None:
            raise Error(f"{engine}: came to no iteration")
        seconds, processor, peak, held = self._ended
        peak, held = (None if m is None or self._before is None else m - self._before for m in (peak, held))
        return Start(engine, threads, seconds - self._began[0], processor - self._began[1], peak, held, self.parts)


def _start_ours(path: Path, threads: int, size: int) -> Start:
    bpy = _blender._open(path, None, {})
    addon = _blender._find_addon(path).__name__
    final, scenes = (importlib.import_module(f"{addon}.{name}") for name in ("final", "export.scene"))
    _warm_up(bpy, "VLP_BPT")
    _blender._open(path, None, {"samples": 1, "threads": threads, "noise_threshold": 0.0})
    watch = Watch()
    watch.begin_with(final, "render")
    watch.time(scenes, "export_scene", "reading the scene")
    watch.time(vlp_bpt.Scene, "validate", "checks")
    watch.time(render, "upload", "upload")
    watch.time(render, "_built_scene", "tree")
    watch.end_with(vlp_bpt.Renderer, "render")
    _render(bpy, size)
    watch.parts["tree"] = watch.parts.get("tree", 0.0) - watch.parts.get("upload", 0.0)
    return watch.result(OURS, threads)


def _start_cycles(path: Path, threads: int, size: int) -> Start:
    cycles.open_scene(path)
    bpy = importlib.import_module("bpy")
    engine = importlib.import_module("cycles.engine")
    _warm_up(bpy, "CYCLES")
    scene = cycles.open_scene(path)
    scene.cycles.samples = 1
    scene.render.threads_mode, scene.render.threads = "FIXED", threads
    watch = Watch()

    watch.begin_with(engine, "create")
    doing = _Doing(watch)
    bpy.app.handlers.render_stats.append(doing.hear)
    _render(bpy, size)
    return watch.result(CYCLES, threads)


class _Doing:
    """Adds up parts by what Cycles says that it does: "Mem: 31M | Updating Scene BVH | Building BVH 0%"."""

    def __init__(self, watch: Watch) -> None:
        self._watch, self._part, self._since = watch, "", time.perf_counter()

    def hear(self, text: str, *_: Any) -> None:
        now = time.perf_counter()
        if self._part:
            self._watch.parts[self._part] = self._watch.parts.get(self._part, 0.0) + now - self._since
        self._part, self._since = part_of(text), now
        if "| Sample 0/" in text:
            self._watch.end()


def part_of(text: str) -> str:
    """The part that a line of Cycles' status belongs to; "" for the rest."""
    steps = [step.strip() for step in text.split("|")]
    return next((part for words, part in _CYCLES_PARTS.items() if any(s.startswith(words) for s in steps)), "")


def _warm_up(bpy: Any, engine: str) -> None:
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    scene = bpy.context.scene
    scene.render.engine = engine
    (scene.cycles if engine == "CYCLES" else scene.vlp_bpt).samples = 1
    _render(bpy, 8)


def _render(bpy: Any, size: int) -> None:
    render_settings = bpy.context.scene.render
    render_settings.resolution_x = render_settings.resolution_y = size
    render_settings.resolution_percentage = 100
    render_settings.use_compositing = render_settings.use_sequencer = render_settings.use_persistent_data = False
    with _blender._console() as said:
        try:
            bpy.ops.render.render()
        except RuntimeError as error:
            raise Error(str(error).strip()) from error
    errors = [line for line in said if line.startswith("Error: ")]
    if errors:
        raise Error("; ".join(errors))


def _memory(name: str) -> int | None:
    """VmRSS, the bytes that this process has, or VmHWM, the most since `_forget_peak`; None where none tells."""
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:
        return None
    return next((int(line.split()[1]) * 1024 for line in lines if line.startswith(f"{name}:")), None)


def _forget_peak() -> None:
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
