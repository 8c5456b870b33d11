"""Rendering a scene: upload, iterations with progress and cancellation, the picture and what it cost."""

from __future__ import annotations

import importlib
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from . import denoise
from ._worker import run_aside
from .changes import changes, kept
from .errors import Cancelled, DeviceError, Error, SceneError
from .images import ALBEDO, NOISY, NORMAL, Image
from .noise import NoiseMeter
from .scene import Scene
from .settings import RenderSettings
from .upload import upload, upload_changes
from .validation import validate

_REPORT_SECONDS = 0.2  # most time between two reports of progress, as far as iterations are that short


class CancelFlag(Protocol):
    """Anything with `is_set`, such as threading.Event."""

    def is_set(self) -> bool: ...


@dataclass(frozen=True)
class Progress:
    """Where a render stands. iterations: complete ones; samples: how many it was asked for; fraction: 0 to 1, by
    iterations, by time or by noise, whichever is further (back a little where the picture turns out noisier than it
    seemed); seconds: so far; remaining: seconds, None until it can be told; picture: an iteration was completed since
    the last report, so `Renderer.read` has something new without waiting; noise: as in Statistics."""

    iterations: int
    samples: int
    fraction: float
    seconds: float
    remaining: float | None
    picture: bool
    noise: float | None = None


@dataclass(frozen=True)
class Statistics:
    """What a render did and took. eye_samples and light_paths: in all; memory: bytes by device and part; dropped:
    non-finite samples left out; light_rounds: how many times as many light paths were joined to the lens as left
    virtual light points; first_connections: how many of these each surface that the camera sees was joined to, 0 where
    none is joined to any (adaptive sampling chooses both, see `RenderSettings`); portals: places that light of the sky
    and of suns is sent through; favoured_lights: those that half of the light paths begin at, 0 where none stands out
    (native/renderer/light_guide.h); eye_form: of the eye pass, "paths" or "wavefront" (native/backend/eye_form.h);
    build_seconds: uploading the scene and building its hierarchy, as far as it changed; denoise_seconds: of denoising
    the last picture, not part of seconds; noise: of the picture before denoising, as `vlp_bpt.noise` measures it, None
    without `noise_threshold` and before it was told."""

    iterations: int
    seconds: float
    build_seconds: float
    eye_samples: int
    light_paths: int
    vlps: int
    dropped: int
    memory: dict[str, dict[str, int]]
    light_rounds: int = 1
    first_connections: int = 1
    portals: int = 0
    favoured_lights: int = 0
    eye_form: str = "paths"
    denoise_seconds: float = 0.0
    noise: float | None = None

    @property
    def eye_samples_per_second(self) -> float:
        return self.eye_samples / self.seconds if self.seconds > 0 else 0.0

    @property
    def light_paths_per_second(self) -> float:
        return self.light_paths / self.seconds if self.seconds > 0 else 0.0

    @property
    def memory_bytes(self) -> int:
        return sum(sum(parts.values()) for parts in self.memory.values())


class Renderer:
    """Renders one scene with one set of settings, iteration after iteration.

    Raises SceneError or SettingsError for what cannot be rendered, DeviceError when the device fails or there is no
    library to denoise with. `first_iteration`
    begins a later range of the same render: ranges rendered apart merge to the picture that one render makes, unless
    they are adaptive.
    `warnings` are about the scene, and about devices that are not what was asked for, also once one fails during a
    render, which then goes on without it. Calls may come from any thread; `iterate` and `read` wait for each other.
    """

    def __init__(self, scene: Scene, settings: RenderSettings | None = None, *, first_iteration: int = 0) -> None:
        self._warnings = scene.validate()
        self.film = scene.film
        self._asked = settings or RenderSettings()
        self.settings = self._checked(self._asked, scene, first_iteration)
        self.first_iteration = first_iteration
        self.interrupted = False  # the last `render` was ended by KeyboardInterrupt
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._seconds = self._denoise_seconds = 0.0
        self._noise = NoiseMeter(self.settings.noise_threshold)
        if self.settings.denoise:
            denoise.load()  # not only after an hour
        started = time.perf_counter()
        with native_errors():
            self._scene = _built_scene(scene, self.settings.threads)
            self._native = load_native().Renderer(self._scene, self._options())
        self._known = kept(scene)  # what self._scene holds
        self._build_seconds = time.perf_counter() - started

    def update(self, scene: Scene | None = None, settings: RenderSettings | None = None) -> None:
        """Begins anew with another scene, other settings or both, at `first_iteration`.

        What is the same is neither built nor uploaded again: after another camera nothing, after another material the
        materials, after other positions, radii or transforms of as many what has moved, and the hierarchy follows;
        after other geometry or instances everything. The scene may be the one of before with other fields;
        an array whose elements were changed in place goes unnoticed. Waits for an iteration under way. When it raises,
        the next `update` must bring what can be rendered.
        """
        new_scene = scene if scene is not None else self._known
        changed = changes(self._known, new_scene)
        warnings = validate(new_scene, new_geometries=None if changed.geometry else changed.moved_geometries)
        asked = settings or self._asked
        new_settings = self._checked(asked, new_scene, self.first_iteration)
        if new_settings.denoise:
            denoise.load()
        same_devices = (new_settings.device, new_settings.threads) == (self.settings.device, self.settings.threads)
        with self._lock, native_errors():
            started = time.perf_counter()
            self._native.rest()  # a helper may still be at work on the scene
            self._known = Scene()  # nothing of which anything can be taken over, should this fail
            if changed.geometry:
                self._scene = _built_scene(new_scene, new_settings.threads)
            else:
                upload_changes(new_scene, changed, self._scene)
                self._scene.build(new_settings.threads)
            self._known = kept(new_scene)
            self._warnings, self.film = warnings, new_scene.film
            self._asked, self.settings = asked, new_settings
            self._noise = NoiseMeter(new_settings.noise_threshold)
            if same_devices:
                self._native.update(self._scene, self._options())
            else:
                self._native = load_native().Renderer(self._scene, self._options())
            self._seconds = self._denoise_seconds = 0.0
            self._build_seconds = time.perf_counter() - started

    @staticmethod
    def _checked(settings: RenderSettings, scene: Scene, first_iteration: int) -> RenderSettings:
        resolved = settings.resolved(scene.film.width, scene.film.height)
        if not 0 <= first_iteration < 2**31 - resolved.samples:
            raise SceneError(f"first_iteration {first_iteration} must be from 0 to {2**31 - resolved.samples - 1}")
        return resolved

    def _options(self) -> dict[str, Any]:
        return self.settings.to_dict() | {"iteration_begin": self.first_iteration}

    @property
    def warnings(self) -> list[str]:
        """What the user should hear, in whole sentences."""
        return self._warnings + list(self._native.notes)

    @property
    def iterations(self) -> int:
        """Complete iterations in the picture."""
        return int(self._native.iterations)

    @property
    def iteration_fraction(self) -> float:
        """How much of the iteration under way is done, 0 to 1."""
        return float(self._native.progress())

    @property
    def statistics(self) -> Statistics:
        """What was rendered so far and what it took."""
        rendered = sum(end - begin for begin, end in self._native.ranges.items())  # here, not in film states added
        return Statistics(
            iterations=self.iterations,
            seconds=self._seconds,
            build_seconds=self._build_seconds,
            eye_samples=int(self._native.eye_samples),
            light_paths=rendered * int(self._native.light_paths),
            vlps=int(self._native.vlps),
            dropped=int(self._native.dropped),
            memory=self.memory,
            light_rounds=int(self._native.light_rounds),
            first_connections=int(self._native.first_connections),
            portals=int(self._native.portals),
            favoured_lights=int(self._native.favoured_lights),
            eye_form=self._native.eye_form,
            denoise_seconds=self._denoise_seconds,
            noise=self._noise.noise,
        )

    @property
    def memory(self) -> dict[str, dict[str, int]]:
        """Bytes by device ("CPU": the machine's own memory) and by what they are for."""
        return {
            device: {part: int(size) for part, size in parts.items()} for device, parts in self._native.memory().items()
        }

    @property
    def uploaded_bytes(self) -> int:
        """What of scenes was copied to a GPU so far, by this renderer's making and its updates."""
        return int(self._native.uploaded_bytes)

    def iterate(self, count: int = 1, poll: Callable[[], bool] | None = None) -> int:
        """Renders up to `count` further iterations and returns how many were completed.

        While it runs, `poll` is called about 20 times a second on the calling thread; when it returns true, or after
        `cancel`, the iteration under way is thrown away and this returns. An exception of `poll` and KeyboardInterrupt
        stop it likewise and are raised on, so the picture stays that of the complete iterations.
        """
        self._stop.clear()
        try:
            return self._iterate(count, poll)
        finally:
            self._native.rest()

    def cancel(self) -> None:
        """Makes the `iterate` or `render` that is running return, from any thread; the picture so far stays."""
        self._stop.set()
        self._native.cancel()

    def render(self, progress: Callable[[Progress], None] | None = None, cancel: CancelFlag | None = None) -> Image:
        """Renders `settings.samples` iterations, or fewer when `time_limit` or `noise_threshold` ends them; returns
        `picture()`.

        `progress` is called on the calling thread at least four times a second. Setting `cancel`, `cancel()` and
        KeyboardInterrupt all end the render and keep its picture; one iteration is completed whatever the time limit.
        `cancel` and `cancel()` leave the picture noisy, also when they come while it is denoised; so does a second
        KeyboardInterrupt.
        Raises Cancelled when it was stopped before the first iteration was complete.
        """
        self._stop.clear()
        self.interrupted = False
        session = _Session(self, progress, cancel)
        try:
            session.run()
        except KeyboardInterrupt:
            self.interrupted = True
        if self.iterations == 0:
            raise Cancelled("render: cancelled before its first iteration was complete")
        try:
            self._noise.look(self.iterations, self.read)
            return self.picture(lambda: self._stop.is_set() or (cancel is not None and cancel.is_set()))
        except KeyboardInterrupt:
            self.interrupted = True
            return Image(self.read(), self.metadata(), layers=self.layers())

    def picture(self, cancelled: Callable[[], bool] | None = None) -> Image:
        """The picture of the complete iterations, denoised where `settings.denoise` asks for it, with `layers`.

        It stays noisy where `cancelled`, asked about 20 times a second, says so, or where the denoiser fails, of which
        there is a warning then.
        """
        image = Image(self.read(), self.metadata(), layers=self.layers())
        if not self.settings.denoise:
            return image
        started = time.perf_counter()
        try:
            color = denoise.denoise(
                *self._guided(),
                prefilter=self.settings.denoise_prefilter,
                threads=self.settings.threads,
                cancelled=cancelled,
            )
        except Cancelled:
            return image
        except DeviceError as error:
            self._warnings.append(str(error))
            return image
        self._denoise_seconds = time.perf_counter() - started
        image.pixels = np.concatenate([color, image.pixels[..., 3:]], axis=2)
        image.metadata |= {"denoised": True, "denoise_seconds": round(self._denoise_seconds, 3)}
        return image

    def layers(self) -> dict[str, NDArray[np.float32]]:
        """What files keep beside the denoised picture, by the names of `vlp_bpt.images`; nothing without
        `settings.denoise`. NOISY is `read`'s; ALBEDO and NORMAL (in world space) are (height, width, 3)."""
        if not self.settings.denoise:
            return {}
        _, albedo, normal = self._guided()
        return {NOISY: self.read(), ALBEDO: albedo, NORMAL: normal}

    def read(self, out: NDArray[np.float32] | None = None) -> NDArray[np.float32]:
        """The mean picture of the complete iterations: (height, width, 4) of the window, linear premultiplied RGBA
        float32, row 0 at the bottom. Waits for an iteration under way. `out` takes the result where given."""
        _, _, width, height = self.film.render_window
        if out is None:
            out = np.empty((height, width, 4), dtype=np.float32)
        with self._lock, native_errors():
            self._native.read(out)
        return out

    def film_state(self) -> NDArray[np.int64]:
        """The exact sums behind the picture: (height, width, 4, 2) int64, 128-bit fixed point as low and high words; 13
        in place of 4 with `settings.denoise`."""
        with self._lock, native_errors():
            return np.asarray(self._native.film_state()).view(np.int64)

    def add_film_state(self, state: NDArray[np.int64], iterations: int) -> None:
        """Adds the sums of `iterations` iterations rendered elsewhere: exact, whatever the order."""
        with self._lock, native_errors():
            self._native.add_film_state(np.ascontiguousarray(state, dtype=np.int64), iterations)

    def lost_light(self) -> tuple[float, float]:
        """The share of the picture's light that takes longer paths than the settings allow, and its standard error.

        Measured by a short pilot of path tracing with up to 64 surface hits, always the same for a scene and settings.
        """
        with native_errors():
            share, error = self._native.lost_light(self.settings.threads)
        return float(share), float(error)

    def metadata(self) -> dict[str, Any]:
        """What a file should say about the picture: version, settings, iterations, their ranges, seconds, film."""
        from . import __version__

        statistics = asdict(self.statistics)
        settings = self.settings.to_dict()
        light_paths = int(self._native.light_paths) // statistics["light_rounds"]
        if 0 < light_paths < settings["light_paths"]:
            settings["light_paths"] = light_paths  # a GPU had no room for more
        return {
            "version": __version__,
            "settings": settings,
            "iterations": self.iterations,
            "ranges": [list(range_) for range_ in sorted(self._native.ranges.items())],
            "seconds": round(self._seconds, 3),
            "seed": self.settings.seed,
            "eye_form": statistics["eye_form"],
            "light_rounds": statistics["light_rounds"],
            "first_connections": statistics["first_connections"],
            "portals": statistics["portals"],
            "favoured_lights": statistics["favoured_lights"],
            "film": {"width": self.film.width, "height": self.film.height, "window": list(self.film.render_window)},
            "statistics": {name: statistics[name] for name in ("eye_samples", "light_paths", "dropped")},
        } | ({} if self._noise.noise is None else {"noise": self._noise.noise})

    def _guided(self) -> tuple[NDArray[np.float32], ...]:
        """What the denoiser gets: colour, albedo and normal, (height, width, 3). The colour is `read`'s but for splats,
        each of which is in one pixel: noise that neighbours share would pass for texture."""
        _, _, width, height = self.film.render_window
        images = tuple(np.empty((height, width, 3), dtype=np.float32) for _ in range(3))
        with self._lock, native_errors():
            self._native.read_guided(*images)
        return images

    def _iterate(self, count: int, poll: Callable[[], bool] | None) -> int:
        def work() -> int:
            with native_errors():
                return int(self._native.iterate(count))

        def ask() -> None:
            if poll is not None and poll():
                self._stop.set()
            if self._stop.is_set():
                self._native.cancel()  # again each time: it may have come before the pass began

        with self._lock:
            started = time.perf_counter()
            try:
                return run_aside(work, name="vlp-bpt", poll=ask, stop=self._native.cancel)
            finally:
                self._seconds += time.perf_counter() - started


class _Session:
    """One call of `Renderer.render`: chunks of iterations short enough to report between them."""

    def __init__(
        self, renderer: Renderer, report: Callable[[Progress], None] | None, cancel: CancelFlag | None
    ) -> None:
        self.renderer, self.report, self.cancel = renderer, report, cancel
        self.started = self.reported = time.perf_counter()
        self.done = 0

    def run(self) -> None:
        while True:
            self._render()
            # A device that fails while it is read loses what it alone had.
            with self.renderer._lock, native_errors():
                change = int(self.renderer._native.settle())
            self.done += change
            if change >= 0:
                return

    def _render(self) -> None:
        renderer, settings, noise = self.renderer, self.renderer.settings, self.renderer._noise
        chunk = 1
        while self.done < settings.samples and not self._stopped():
            if settings.time_limit > 0 and self.done > 0:
                seconds = time.perf_counter() - self.started
                # The last iteration may end as far after the limit as the one before it ended ahead of it.
                left = settings.time_limit - seconds - 0.5 * seconds / self.done
                if left <= 0:
                    break
                renderer._native.set_deadline(left)
            look = noise.next_look(renderer.iterations)
            asked = int(min(chunk, settings.samples - self.done, look - renderer.iterations))
            began = time.perf_counter()
            completed = renderer._iterate(asked, self._poll)
            took = time.perf_counter() - began
            self.done += completed
            enough = renderer.iterations >= look and noise.look(renderer.iterations, renderer.read)
            self._tell(picture=completed > 0)
            if completed < asked or enough:
                break
            chunk = max(1, min(2 * chunk, int(_REPORT_SECONDS / max(took / completed, 1e-6))))
        renderer._native.set_deadline(0.0)
        renderer._native.rest()

    def _stopped(self) -> bool:
        return self.renderer._stop.is_set() or (self.cancel is not None and self.cancel.is_set())

    def _poll(self) -> bool:
        if time.perf_counter() - self.reported >= _REPORT_SECONDS:
            self._tell(picture=False)
        return self._stopped()

    def _tell(self, picture: bool) -> None:
        if self.report is None:
            return
        settings = self.renderer.settings
        self.reported = time.perf_counter()
        seconds = self.reported - self.started
        by_iterations = (self.done + (0.0 if picture else self.renderer.iteration_fraction)) / settings.samples
        by_time = seconds / settings.time_limit if settings.time_limit > 0 else 0.0
        by_noise = self.renderer._noise.share(self.renderer.iterations)
        fraction = min(max(by_iterations, by_time, by_noise), 1.0)
        remaining = seconds * (1 - fraction) / fraction if fraction > 0 else None
        noise = self.renderer._noise.noise
        self.report(Progress(self.done, settings.samples, fraction, seconds, remaining, picture, noise))


def _built_scene(scene: Scene, threads: int) -> Any:
    native_scene = load_native().Scene()
    upload(scene, native_scene)
    native_scene.build(threads)
    return native_scene


def devices() -> list[dict[str, Any]]:
    """The devices that can render here: name, kind ('CPU' or 'CUDA'), memory (bytes), isa. Raises DeviceError."""
    native = load_native()
    with native_errors():
        return [dict(device) for device in native.devices()]


def load_native() -> Any:
    """The native core's module; raises DeviceError where it is not built or not made for this Python."""
    try:
        return importlib.import_module("vlp_bpt._native")
    except ImportError as error:
        raise DeviceError(f"the native core of VLP-BPT cannot be loaded: {error}") from error


@contextmanager
def native_errors() -> Iterator[None]:
    """Turns what the native core raises into this package's errors."""
    try:
        yield
    except Error:
        raise
    except (ValueError, TypeError, IndexError) as error:
        raise SceneError(str(error)) from error
    except MemoryError as error:
        raise DeviceError(f"out of memory: {error}") from error
    except RuntimeError as error:
        raise DeviceError(str(error)) from error
