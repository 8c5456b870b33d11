"""Tests of the add-on run inside the bpy module; each begins with an empty factory file."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

bpy = pytest.importorskip("bpy", reason="the add-on's tests need the bpy module")

import addon  # noqa: E402

_exit_status: list[int] = []


@pytest.fixture(scope="session", autouse=True)
def registered() -> Iterator[None]:
    """The add-on, registered once for all tests."""
    addon.register()
    yield
    addon.unregister()


@pytest.fixture(autouse=True)
def empty_file(registered: None) -> None:
    """A factory file without objects, small pictures and VLP-BPT as its engine."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "VLP_BPT"
    scene.render.resolution_x, scene.render.resolution_y = 64, 48
    scene.render.resolution_percentage = 100
    scene.vlp_bpt.samples = 2


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    _exit_status.append(int(exitstatus))


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config: pytest.Config) -> None:
    """Leaves without tearing down Blender, which has been seen to hang at exit."""
    sys.stdout.flush()
    sys.stderr.flush()
    if _exit_status and _exit_status[-1] in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED):
        os._exit(_exit_status[-1])
