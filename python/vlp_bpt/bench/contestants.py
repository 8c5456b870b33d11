"""What the benchmarks race: this renderer in some setting, and its peers; slices of each add up to one picture."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vlp_bpt.render import Renderer
from vlp_bpt.scene import Scene
from vlp_bpt.settings import RenderSettings

from . import cycles, luxcore, mitsuba

Pixels = NDArray[np.float64]
CYCLES_SEQUENCE = 1 << 16  # samples of the one sequence that all slices belong to


@dataclass
class Contestant:
    """Somebody in the race. seconds and eye_samples count all slices; rates: eye samples per second of each slice."""

    name: str
    seconds: float = field(default=0.0, init=False)
    eye_samples: int = field(default=0, init=False)
    rates: list[float] = field(default_factory=list, init=False)

    @property
    def window(self) -> str:
        """The path lengths, in words."""
        raise NotImplementedError

    @property
    def iterations(self) -> int | None:
        """Iterations so far, None for a renderer that has none."""
        return None

    @property
    def shortest(self) -> float:
        """Seconds of the shortest slice that does not waste time."""
        return 0.0

    @property
    def notes(self) -> list[str]:
        """What is not the same as in the scene, in whole clauses."""
        return []

    def prepare(self) -> None:
        """Load the scene and warm up, untimed; raises Error for a scene that this renderer cannot render."""

    def run(self, seconds: float) -> None:
        """Render about that long."""
        raise NotImplementedError

    def picture(self) -> Pixels:
        """The mean picture so far (h, w, 3), top row first."""
        raise NotImplementedError

    def _count(self, seconds: float, eye_samples: int) -> None:
        self.seconds += seconds
        self.eye_samples += eye_samples
        self.rates.append(eye_samples / max(seconds, 1e-2))


@dataclass
class Ours(Contestant):
    """This renderer: iterations until the slice is over."""

    scene: Scene
    settings: RenderSettings
    _renderer: Renderer | None = field(default=None, init=False)

    @property
    def renderer(self) -> Renderer:
        """Made at the first use."""
        if self._renderer is None:
            self._renderer = Renderer(self.scene, self.settings)
        return self._renderer

    @property
    def window(self) -> str:
        s = self.renderer.settings
        return f"K {s.eye_path_length}, L {s.light_path_length}, C {s.vlp_connections}"

    @property
    def iterations(self) -> int | None:
        return self.renderer.iterations

    def prepare(self) -> None:
        if self.renderer.warnings:
            print(f"{self.name}: {'; '.join(self.renderer.warnings)}", flush=True)

    def run(self, seconds: float) -> None:
        renderer = self.renderer
        before = renderer.statistics
        spent, done = 0.0, 0
        while spent < seconds:
            pace = spent / done if done else seconds
            renderer.iterate(max(1, min(int(0.25 * seconds / pace), int((seconds - spent) / pace))))
            spent = renderer.statistics.seconds - before.seconds
            done = renderer.statistics.iterations - before.iterations
        self._count(spent, renderer.statistics.eye_samples - before.eye_samples)

    def picture(self) -> Pixels:
        return self.renderer.read()[::-1, :, :3].astype(np.float64)


@dataclass
class Cycles(Contestant):
    """Cycles: slices of one sample sequence, as long as the pace so far says."""

    blend: Path
    size: tuple[int, int]
    scatterings: int
    threads: int = 0
    seed: int = 0
    box: bool = False  # a filter of one pixel, not Blackman-Harris
    _pace: float = field(default=0.0, init=False)
    _samples: int = field(default=0, init=False)
    _sum: Pixels | None = field(default=None, init=False)

    @property
    def window(self) -> str:
        return f"max bounces {self.scatterings - 1}"

    def prepare(self) -> None:
        self._pace = self._first_pace(self._open())

    def run(self, seconds: float) -> None:
        scene = self._open()
        if self._samples:
            self._pace = self.seconds / self._samples
        elif not self._pace:
            self._pace = self._first_pace(scene)
        image = self._render(scene, max(1, round(seconds / self._pace)), self._samples)
        weighted = image.pixels[..., :3].astype(np.float64) * image.samples
        self._sum = weighted if self._sum is None else self._sum + weighted
        self._samples += image.samples
        self._count(image.seconds, image.samples * self.size[0] * self.size[1])

    def _open(self) -> Any:
        scene = cycles.open_scene(self.blend)
        cycles.set_size(scene, *self.size)
        if self.box:
            scene.cycles.pixel_filter_type = "BOX"
        return scene

    def picture(self) -> Pixels:
        if self._sum is None:
            raise RuntimeError(f"{self.name} has not rendered yet")
        return self._sum / self._samples

    def _first_pace(self, scene: Any) -> float:
        """Seconds of one sample per pixel, from renders that are thrown away: they also warm Blender up."""
        samples = 1
        while (image := self._render(scene, samples, 0)).seconds < 0.25 and samples < 1024:
            samples *= 2
        return max(image.seconds, 1e-2) / samples

    def _render(self, scene: Any, samples: int, first: int) -> cycles.CyclesImage:
        return cycles.render(
            scene,
            samples=samples,
            scatterings=self.scatterings,
            first=first,
            total=CYCLES_SEQUENCE,
            seed=self.seed,
            threads=self.threads,
        )


@dataclass
class Mitsuba(Contestant):
    """Mitsuba's path tracer: launches of as many samples as the pace so far says. What a launch costs without samples
    counts once, as whoever renders in one go pays it."""

    scene: Scene
    scatterings: int
    seed: int = 0
    _loaded: Any = field(default=None, init=False, repr=False)
    _launches: int = field(default=0, init=False)
    _overhead: float = field(default=0.0, init=False)  # seconds of a launch without samples
    _pace: float = field(default=0.0, init=False)  # seconds of a sample of every pixel
    _samples: int = field(default=0, init=False)
    _sum: Pixels | None = field(default=None, init=False, repr=False)

    @property
    def window(self) -> str:
        return f"{mitsuba.variant()}, max_depth {self.scatterings + 1}"

    @property
    def shortest(self) -> float:
        return self._overhead

    def prepare(self) -> None:
        self._loaded = mitsuba.load(self.scene, self.scatterings)
        mitsuba.launch(self._loaded, 1, 0)  # compiles
        one = min(self._timed(1) for _ in range(2))
        samples = 4
        self._timed(samples)  # compiles what more than one a pixel takes
        while (took := self._timed(samples)) < 2 * one and 4 * samples <= self._most:
            samples *= 4
        self._pace = max((took - one) / (samples - 1), 1e-4)
        self._overhead = max(one - self._pace, 0.0)

    def run(self, seconds: float) -> None:
        spent, made = 0.0, 0
        while not made or seconds - spent > max(0.05 * seconds, 0.5 * self._pace):
            left = seconds - spent - (self._overhead if self._launches == 0 else 0.0)
            samples = max(1, min(self._most, round(left / self._pace)))
            began = time.perf_counter()
            part = samples * mitsuba.launch(self._loaded, samples, (self.seed << 20) + self._launches + 1)
            took = time.perf_counter() - began
            self._sum = part if self._sum is None else self._sum + part
            spent += took if self._launches == 0 else max(took - self._overhead, 0.5 * samples * self._pace)
            made += samples
            self._launches += 1
            if took > 2 * self._overhead:
                self._pace = max((took - self._overhead) / samples, 1e-4)
        self._samples += made
        self._count(spent, made * self.scene.film.width * self.scene.film.height)

    @property
    def _most(self) -> int:
        """Samples a pixel of the largest launch."""
        return max(1, mitsuba.PASS // (self.scene.film.width * self.scene.film.height))

    def _timed(self, samples: int) -> float:
        began = time.perf_counter()
        mitsuba.launch(self._loaded, samples, 0)
        return time.perf_counter() - began

    def picture(self) -> Pixels:
        if self._sum is None:
            raise RuntimeError(f"{self.name} has not rendered yet")
        return self._sum / self._samples


LUXCORE_DEPTH = 10  # hits of each of the two walks of BIDIRCPU, which joins every pair of their vertices
LUXCORE_LONGEST = 1 << 16  # hits before roulette: never, as BIDIRCPU is too bright with it


@dataclass
class LuxCore(Contestant):
    """LuxCore's path tracer (PATHCPU, roulette as it comes) or bidirectional one (BIDIRCPU, without roulette)."""

    scene: Scene
    engine: str
    scatterings: int
    threads: int = 0
    seed: int = 0
    _session: Any = field(default=None, init=False, repr=False)

    @property
    def window(self) -> str:
        return f"{LUXCORE_DEPTH} + {LUXCORE_DEPTH} hits" if self.engine == "BIDIRCPU" else f"{self.scatterings} hits"

    @property
    def notes(self) -> list[str]:
        return [] if self._session is None else list(self._session.notes)

    def prepare(self) -> None:
        if self.engine == "BIDIRCPU":
            # These depths count the vertex on the light, or on the lens.
            values = {"light.maxdepth": LUXCORE_DEPTH + 1, "path.maxdepth": LUXCORE_DEPTH + 1}
            values |= {"path.russianroulette.depth": LUXCORE_LONGEST}
        else:
            kinds = ("total", "diffuse", "glossy", "specular")
            values = {f"path.pathdepth.{kind}": self.scatterings + 1 for kind in kinds}
        threads = self.threads or os.cpu_count() or 1
        self._session = luxcore.Session(self.scene, self.engine, values, threads=threads, seed=self.seed)

    def run(self, seconds: float) -> None:
        self._count(*self._session.run(seconds))

    def picture(self) -> Pixels:
        return np.asarray(self._session.picture(), np.float64)


def race(
    contestants: Sequence[Contestant], instants: Sequence[float], observe: Callable[[Contestant, int], None]
) -> None:
    """Each contestant renders up to each of `instants` (seconds of its own) by turns, the order turned round each time,
    so that whatever else the machine does meets all alike. One that is past an instant already, as samples are not
    cut short, or for which the slice would be too short, sits it out. `observe(contestant, index)` is called after
    each instant, untimed."""
    for index, instant in enumerate(instants):
        for contestant in contestants if index % 2 == 0 else contestants[::-1]:
            left = instant - contestant.seconds
            if left > 0 and (left >= contestant.shortest or index == len(instants) - 1):
                contestant.run(left)
            observe(contestant, index)
