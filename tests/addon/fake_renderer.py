"""Stands in for `vlp_bpt.Renderer`: fills the window with a colour that says where each pixel lies, at once."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from vlp_bpt.errors import Cancelled
from vlp_bpt.images import Image
from vlp_bpt.render import Progress, Statistics
from vlp_bpt.settings import RenderSettings


class FakeRenderer:
    """Pixels are (x / width, y / height, iterations, 1) of the full picture; `made` keeps what was asked for."""

    made: ClassVar[list[FakeRenderer]] = []
    seconds_per_iteration: ClassVar[float] = 0.0
    error: ClassVar[Exception | None] = None

    def __init__(self, scene: Any, settings: RenderSettings) -> None:
        self.warnings = scene.validate()
        self.scene = scene
        self.settings = settings.resolved(scene.film.width, scene.film.height)
        self.iterations = 0
        self.finished_at = 0.0
        FakeRenderer.made.append(self)

    @property
    def statistics(self) -> Statistics:
        count = self.iterations
        return Statistics(count, 1.5 * count, 0.1, 1000 * count, 500 * count, 42, 0, {"CPU": {"film": 2**20}})

    def render(self, progress: Callable[[Progress], None], cancel: Any) -> Image:
        samples = self.settings.samples
        for iteration in range(samples):
            ends = time.perf_counter() + self.seconds_per_iteration
            while time.perf_counter() < ends and not cancel.is_set():
                time.sleep(0.02)
            if cancel.is_set():
                break
            if FakeRenderer.error is not None:
                raise FakeRenderer.error
            self.iterations = iteration + 1
            progress(Progress(self.iterations, samples, self.iterations / samples, 1.0, 2.0, True))
        self.finished_at = time.perf_counter()
        if self.iterations == 0:
            raise Cancelled("cancelled")
        _, _, width, height = self.scene.film.render_window
        return Image(self.read(np.empty((height, width, 4), np.float32)))

    def layers(self) -> dict[str, Any]:
        return {}

    def lost_light(self) -> tuple[float, float]:
        return 0.021, 0.004

    def read(self, out: Any) -> Any:
        film = self.scene.film
        x, y, width, height = film.window or (0, 0, film.width, film.height)
        out[..., 0] = (x + np.arange(width)) / film.width
        out[..., 1] = ((y + np.arange(height)) / film.height)[:, None]
        out[..., 2] = self.iterations
        out[..., 3] = 1
        return out

    def metadata(self) -> dict[str, Any]:
        return {"settings": self.settings.to_dict()}
