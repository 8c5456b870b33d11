"""Calls in a thread of their own: what they return and raise, and that none outlives who called."""

from __future__ import annotations

import threading
from collections.abc import Callable

import pytest

from vlp_bpt._worker import run_aside


def nothing() -> None:
    pass


class Endless:
    """Work that goes on until it is asked to stop."""

    def __init__(self) -> None:
        self.asked, self.ended = threading.Event(), threading.Event()

    def __call__(self) -> None:
        assert self.asked.wait(20)
        self.ended.set()


def raises(error: BaseException) -> Callable[[], None]:
    def call() -> None:
        raise error

    return call


def test_what_the_work_returns_and_raises_is_the_callers() -> None:
    assert run_aside(lambda: 7, name="seven", poll=nothing, stop=nothing) == 7
    with pytest.raises(ValueError, match="bad"):
        run_aside(raises(ValueError("bad")), name="bad", poll=nothing, stop=nothing)


def test_it_runs_in_another_thread_and_the_caller_polls() -> None:
    seen = []
    work = Endless()
    run_aside(
        work, name="endless", poll=lambda: (seen.append(threading.current_thread()), work.asked.set()), stop=nothing
    )
    assert seen and set(seen) == {threading.current_thread()}


def test_an_interrupted_caller_leaves_no_thread_behind() -> None:
    work = Endless()
    with pytest.raises(KeyboardInterrupt):
        run_aside(work, name="endless", poll=raises(KeyboardInterrupt()), stop=work.asked.set)
    assert work.ended.is_set()


@pytest.mark.parametrize("launched", [True, False])
def test_nor_one_that_is_interrupted_while_the_thread_starts(monkeypatch: pytest.MonkeyPatch, launched: bool) -> None:
    work, start = Endless(), threading.Thread.start

    def interrupted(thread: threading.Thread) -> None:
        if launched:
            start(thread)
        raise KeyboardInterrupt

    monkeypatch.setattr(threading.Thread, "start", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_aside(work, name="endless", poll=nothing, stop=work.asked.set)
    assert work.ended.is_set() == launched
