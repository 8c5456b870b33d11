"""What tests of the Python package share besides."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from fake_native import FakeRenderer, module

from vlp_bpt import render


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> Iterator[type[FakeRenderer]]:
    """Renderers have a native core made of sleep."""
    native = module()
    monkeypatch.setattr(render, "load_native", lambda: native)
    yield FakeRenderer
    FakeRenderer.seconds, FakeRenderer.fails = 0.0, None
