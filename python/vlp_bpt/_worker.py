"""Long native calls in a thread of their own: the caller's stays free for Ctrl+C and for whoever asks to stop."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

POLL_SECONDS = 0.05  # how often a running call is asked about: stopping takes no longer than this
_SECONDS_TO_BEGIN = 1.0  # which an interrupted start gets, before there is taken to be no thread


def run_aside(work: Callable[[], T], *, name: str, poll: Callable[[], None], stop: Callable[[], None]) -> T:
    """What `work` returns or raises. `poll` is called every POLL_SECONDS meanwhile.

    An exception in the caller's thread, KeyboardInterrupt above all, goes on only after `work` has ended, which `stop`
    is asked for until it does: a thread that outlives its interpreter aborts the process.
    """
    results: list[T] = []
    errors: list[BaseException] = []
    ended = threading.Event()

    def run() -> None:
        try:
            results.append(work())
        except BaseException as error:  # raised again in the caller's thread
            errors.append(error)
        finally:
            ended.set()

    worker = threading.Thread(target=run, name=name, daemon=True)
    try:
        worker.start()
        while not ended.wait(POLL_SECONDS):
            poll()
    finally:
        # `start` may have been interrupted as well, when the thread already runs without being known to.
        asked = time.perf_counter()
        while not ended.is_set() and (worker.ident is not None or time.perf_counter() - asked < _SECONDS_TO_BEGIN):
            stop()
            ended.wait(POLL_SECONDS)
        if worker.is_alive():
            worker.join()
    if errors:
        raise errors[0]
    return results[0]
