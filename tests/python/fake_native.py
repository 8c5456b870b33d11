"""A native core made of sleep: it keeps the promises of the bindings, so that the flow of a render can be tested."""

from __future__ import annotations

import threading
import time
from types import SimpleNamespace
from typing import Any

import numpy as np


class FakeScene:
    """Takes any call and records it."""

    def __init__(self) -> None:
        self.calls: list[tuple[str, tuple[Any, ...]]] = []

    def __getattr__(self, name: str) -> Any:
        def record(*arguments: Any) -> int:
            self.calls.append((name, arguments))
            return sum(call == name for call, _ in self.calls) - 1

        return record

    def arguments(self, name: str) -> list[tuple[Any, ...]]:
        return [arguments for call, arguments in self.calls if call == name]


class FakeRenderer:
    """Iteration i adds i + 1 to every pixel and takes `seconds`; `fails` is raised by the next `iterate`,
    and the next `settle` loses the last `loses` iterations."""

    seconds = 0.0
    fails: BaseException | None = None
    loses = 0  # iterations, when it is next settled

    def __init__(self, scene: FakeScene, settings: dict[str, Any]) -> None:
        ((self.width, self.height, _, _, *window, _),) = scene.arguments("set_film")
        self.window = window
        self.scene, self.settings = scene, settings
        self.next = settings["iteration_begin"]
        self.iterations, self.total, self.vlps, self.dropped = 0, 0, 7, 0
        self.light_paths = settings["light_paths"]
        self.eye_samples = 0
        self.deadline = float("inf")
        self.asked: list[int] = []
        self.threads: set[str] = set()
        self._stop = threading.Event()
        self.notes: list[str] = []
        self.resting = True
        self.eye_form = "paths"
        self.light_rounds, self.first_connections = 1, 1
        self.portals, self.favoured_lights = 0, 0

    @property
    def ranges(self) -> dict[int, int]:
        first = self.settings["iteration_begin"]
        return {first: self.next} if self.next > first else {}

    def rest(self) -> None:
        self.resting = True
        self.eye_form = "paths"

    def iterate(self, count: int) -> int:
        self._stop.clear()
        self.resting = False
        self.asked.append(count)
        self.threads.add(threading.current_thread().name)
        if FakeRenderer.fails is not None:
            error, FakeRenderer.fails = FakeRenderer.fails, None
            raise error
        done = 0
        while done < count and time.monotonic() < self.deadline:
            if self._stop.wait(FakeRenderer.seconds):
                break
            self.next += 1
            self.total += self.next
            self.iterations += 1
            self.eye_samples += self.width * self.height
            done += 1
        return done

    def cancel(self) -> None:
        self._stop.set()

    def set_deadline(self, seconds: float) -> None:
        self.deadline = time.monotonic() + seconds if seconds > 0 else float("inf")

    def progress(self) -> float:
        return 0.5

    def read(self, out: np.ndarray[Any, Any]) -> None:
        out[...] = self.total / max(self.iterations, 1)

    def settle(self) -> int:
        lost, FakeRenderer.loses = FakeRenderer.loses, 0
        self.next -= lost
        self.iterations -= lost
        self.total -= sum(self.next + 1 + i for i in range(lost))
        return -lost

    def memory(self) -> dict[str, dict[str, int]]:
        return {"CPU": {"film": 100, "bvh": 20}}


def module() -> Any:
    """What stands in for `vlp_bpt._native`."""
    FakeRenderer.seconds, FakeRenderer.fails, FakeRenderer.loses = 0.0, None, 0
    return SimpleNamespace(Scene=FakeScene, Renderer=FakeRenderer, devices=lambda: [{"name": "fake", "kind": "CPU"}])
