"""What all Python tests share: helpers of this folder can be imported, and slow tests run only when asked for."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent))


def pytest_addoption(parser: pytest.Parser, pluginmanager: pytest.PytestPluginManager) -> None:
    parser.addoption("--slow", action="store_true", help="also run the tests marked slow (minutes each)")
    if not pluginmanager.hasplugin("timeout"):  # machines that only run tests/gpu may lack it
        parser.addini("timeout", "most seconds of a test, where pytest-timeout is installed")


def pytest_configure(config: pytest.Config) -> None:
    # A script that runs the tests in the background has them, and what they start, ignore interrupts.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    config.addinivalue_line("markers", "slow: takes minutes; runs with --slow")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--slow"):
        return
    skip = pytest.mark.skip(reason="slow: run with --slow")
    for item in items:
        if "slow" in item.keywords:
            item.add_marker(skip)


@pytest.fixture
def no_denoiser(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A machine without Open Image Denoise."""
    from vlp_bpt import denoise

    monkeypatch.setattr(denoise, "_candidates", lambda: iter(()))
    denoise.load.cache_clear()
    yield
    denoise.load.cache_clear()
