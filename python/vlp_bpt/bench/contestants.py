"""What the benchmark races: this renderer in some setting, and Cycles; each renders slices that add up to one picture."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from vlp_bpt.render import Renderer
from vlp_bpt.scene import Scene
from vlp_bpt.settings import RenderSettings

from . import cycles

Pixels = NDArray[np.float64]
CYCLES_SEQUENCE = 1 << 16  # samples of the one sequence that all slices belong to


class Contestant(Protocol):
    """name and window are for the table; seconds, iterations and eye_samples count all slices; iterations is None for
    a renderer that has none."""

    name: str
    window: str
    seconds: float
    eye_samples: int
    rates: list[float]

    @property
    def iterations(self) -> int | None: ...

    def run(self, seconds: float) -> None:
        """Render about that long; adds eye samples per second to `rates`."""

    def picture(self) -> Pixels:
        """The mean picture so far (h, w, 3), top row first."""


@dataclass
class Ours:
    """This renderer: iterations until the slice is over."""

    name: str
    scene: Scene
    settings: RenderSettings
    seconds: float = 0.0
    eye_samples: int = 0
    rates: list[float] = field(default_factory=list)
    _renderer: Renderer | None = None

    @property
    def renderer(self) -> Renderer:
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
        before, samples_before = renderer.statistics.seconds, renderer.statistics.eye_samples
        while (spent := renderer.statistics.seconds - before) < seconds:
            done = renderer.statistics.eye_samples - samples_before
            width_height = renderer.film.width * renderer.film.height
            pace = spent * width_height / done if done else seconds
            renderer.iterate(max(1, min(int(0.25 * seconds / pace), int((seconds - spent) / pace))))
        taken = renderer.statistics.seconds - before
        made = renderer.statistics.eye_samples - samples_before
        self.seconds += taken
        self.eye_samples += made
        self.rates.append(made / taken)

    def picture(self) -> Pixels:
        return self.renderer.read()[::-1, :, :3].astype(np.float64)


@dataclass
class Cycles:
    """Cycles in the same process: slices of one sample sequence, as long as the pace so far says."""

    name: str
    blend: Path
    size: tuple[int, int]
    scatterings: int
    threads: int = 0
    seconds: float = 0.0
    eye_samples: int = 0
    rates: list[float] = field(default_factory=list)
    _samples: int = 0
    _sum: Pixels | None = None

    @property
    def window(self) -> str:
        return f"max bounces {self.scatterings - 1}"

    @property
    def iterations(self) -> int | None:
        return None

    def run(self, seconds: float) -> None:
        scene = self._open()
        pace = self.seconds / self._samples if self._samples else self._first_pace(scene)
        image = self._render(scene, max(1, round(seconds / pace)), self._samples)
        weighted = image.pixels[..., :3].astype(np.float64) * image.samples
        self._sum = weighted if self._sum is None else self._sum + weighted
        made = image.samples * self.size[0] * self.size[1]
        self._samples += image.samples
        self.seconds += image.seconds
        self.eye_samples += made
        self.rates.append(made / max(image.seconds, 1e-2))

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

    def _open(self) -> Any:
        scene = cycles.open_scene(self.blend)
        cycles.set_size(scene, *self.size)
        return scene


def race(contestants: list[Contestant], seconds: float, rounds: int, observe: Any) -> None:
    """Each contestant gets `seconds` in `rounds` slices, in turns, the order turned round each time, so that whatever
    else the machine does meets all alike. `observe(contestant, round)` is called after each slice, untimed."""
    for index in range(rounds):
        for contestant in contestants if index % 2 == 0 else contestants[::-1]:
            contestant.run(seconds / rounds)
            observe(contestant, index)
            time.sleep(0.05)
