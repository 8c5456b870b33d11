"""What the benchmark races: this renderer in some setting, and Cycles; slices of each add up to one picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vlp_bpt.render import Renderer
from vlp_bpt.scene import Scene
from vlp_bpt.settings import RenderSettings

from . import cycles

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
    """Cycles in the same process: slices of one sample sequence, as long as the pace so far says."""

    blend: Path
    size: tuple[int, int]
    scatterings: int
    threads: int = 0
    _samples: int = field(default=0, init=False)
    _sum: Pixels | None = field(default=None, init=False)

    @property
    def window(self) -> str:
        return f"max bounces {self.scatterings - 1}"

    def run(self, seconds: float) -> None:
        scene = cycles.open_scene(self.blend)
        cycles.set_size(scene, *self.size)
        pace = self.seconds / self._samples if self._samples else self._first_pace(scene)
        image = self._render(scene, max(1, round(seconds / pace)), self._samples)
        weighted = image.pixels[..., :3].astype(np.float64) * image.samples
        self._sum = weighted if self._sum is None else self._sum + weighted
        self._samples += image.samples
        self._count(image.seconds, image.samples * self.size[0] * self.size[1])

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
            threads=self.threads,
        )


def race(
    contestants: Sequence[Contestant], instants: Sequence[float], observe: Callable[[Contestant, int], None]
) -> None:
    """Each contestant renders up to each of `instants` (seconds of its own) by turns, the order turned round each time,
    so that whatever else the machine does meets all alike. One that is past an instant already, as samples are not
    cut short, sits it out. `observe(contestant, index)` is called after each instant, untimed."""
    for index, instant in enumerate(instants):
        for contestant in contestants if index % 2 == 0 else contestants[::-1]:
            if contestant.seconds < instant:
                contestant.run(instant - contestant.seconds)
            observe(contestant, index)
