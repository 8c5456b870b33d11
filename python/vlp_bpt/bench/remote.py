"""A contestant in a process of its own, so that renderers' threads, memory and compilers do not meet in one."""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Any

from vlp_bpt.errors import Error

from .contestants import Contestant, Pixels


@dataclass
class State:
    """What a contestant tells after each command. processor: seconds of all its threads in timed slices; wall: seconds
    of these slices, with what a renderer does before and after rendering; memory: most bytes that the process had."""

    seconds: float = 0.0
    eye_samples: int = 0
    rates: list[float] = field(default_factory=list)
    window: str = ""
    shortest: float = 0.0
    notes: list[str] = field(default_factory=list)
    processor: float = 0.0
    wall: float = 0.0
    memory: int = 0


class Remote(Contestant):
    """Stands for `inner`, which lives and renders in a new process; to be used in a `with` statement.

    Raises Error where the other side does, with the same words, and where its process ends.
    """

    def __init__(self, inner: Contestant) -> None:
        super().__init__(inner.name)
        context = multiprocessing.get_context("spawn")
        self._pipe, other = context.Pipe()
        self.state = State()
        self._process = context.Process(target=_serve, args=(inner, other), daemon=True)
        self._process.start()
        other.close()

    def __enter__(self) -> Remote:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with suppress(OSError):
            self._pipe.send(("end",))
        self._process.join(10)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._pipe.close()

    @property
    def window(self) -> str:
        return self.state.window

    @property
    def shortest(self) -> float:
        return self.state.shortest

    @property
    def notes(self) -> list[str]:
        return self.state.notes

    def prepare(self) -> None:
        self._update(self._ask("prepare"))

    def run(self, seconds: float) -> None:
        self._update(self._ask("run", seconds))

    def picture(self) -> Pixels:
        pixels: Pixels = self._ask("picture")
        return pixels

    def _update(self, state: State) -> None:
        self.state = state
        self.seconds, self.eye_samples, self.rates = state.seconds, state.eye_samples, state.rates

    def _ask(self, *command: Any) -> Any:
        try:
            self._pipe.send(command)
            kind, answer = self._pipe.recv()
        except (EOFError, OSError) as error:
            self._process.join(10)
            raise Error(f"{self.name}: its process ended, exit code {self._process.exitcode}") from error
        if kind == "error":
            raise Error(f"{self.name}: {answer}")
        return answer


def apart(what: str, work: Callable[..., Any], *args: Any) -> Any:
    """What `work(*args)` returns in a process of its own. Raises Error where that fails or ends; `what` it was."""
    context = multiprocessing.get_context("spawn")
    mine, other = context.Pipe()
    process = context.Process(target=_work, args=(other, work, *args), daemon=True)
    process.start()
    other.close()
    try:
        kind, answer = mine.recv()
    except EOFError:
        process.join()
        raise Error(f"{what}: its process ended, exit code {process.exitcode}") from None
    process.join()
    if kind == "error":
        raise Error(f"{what}: {answer}")
    return answer


def _work(pipe: Connection, work: Callable[..., Any], *args: Any) -> None:
    _settle_in()
    try:
        pipe.send(("answer", work(*args)))
    except Exception as error:
        words = str(error) if isinstance(error, Error) else traceback.format_exception_only(error)[-1].strip()
        pipe.send(("error", words))
    os._exit(0)  # as in _serve


def _settle_in() -> None:
    """First of all in a new process."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # renderers talk
    # A parent that has loaded bpy hands on the folder of Blender's own scripts, in which there is another bpy.
    sys.path[:] = [folder for folder in sys.path if not (Path(folder) / "bpy_extras").is_dir()]


def _serve(inner: Contestant, pipe: Connection) -> None:
    """The other process: does what it is asked until it is told to end or nobody is there."""
    _settle_in()
    state = State()
    with suppress(EOFError, KeyboardInterrupt):
        while (command := pipe.recv())[0] != "end":
            try:
                pipe.send(("answer", _answer(inner, state, command)))
            except Error as error:
                pipe.send(("error", str(error)))
            except Exception as error:
                words = traceback.format_exception_only(error)[-1].strip()
                pipe.send(("error", words))
    os._exit(0)  # some renderers crash when Python takes them down


def _answer(inner: Contestant, state: State, command: tuple[Any, ...]) -> Any:
    if command[0] == "picture":
        return inner.picture()
    if command[0] == "prepare":
        inner.prepare()
    else:
        processor, wall = time.process_time(), time.perf_counter()
        inner.run(command[1])
        state.processor += time.process_time() - processor
        state.wall += time.perf_counter() - wall
    state.seconds, state.eye_samples, state.rates = inner.seconds, inner.eye_samples, inner.rates
    state.window, state.shortest, state.notes = inner.window, inner.shortest, inner.notes
    state.memory = peak_memory()
    return state


def peak_memory() -> int:
    """The most bytes of memory that this process has had so far."""
    status = Path("/proc/self/status")
    if status.is_file():  # getrusage counts what the parent had when it started this process
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    import resource

    return int(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
