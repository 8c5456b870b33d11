"""The albedos that the native tests compare with are still what this Blender's Cycles gives."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs Blender's module")
NATIVE = Path(__file__).resolve().parents[1] / "native"
sys.path.insert(0, str(NATIVE))

import measure_cycles_albedos as cycles  # noqa: E402

RECORDED = (NATIVE / "bsdf_cycles_albedos.h").read_text(encoding="utf-8")
NAMES = ("diffuse", "glossy MULTI_GGX 0.8", "glass MULTI_GGX 0.7 1.5", "principled roughness 0.3")


def recorded(name: str, cosine: float) -> np.ndarray:
    """What the header holds for the near and the far side, (2, 3)."""
    start = RECORDED.index(f'{{"{name}",')
    row = re.search(rf"\{{{re.escape(cycles.number(cosine))}, \{{(.*?)\}}, \{{(.*?)\}}\}}", RECORDED[start:])
    assert row is not None
    return np.array([[float(value.rstrip("f")) for value in side.split(", ")] for side in row.groups()])


@pytest.mark.parametrize("name", NAMES)
def test_cycles_still_gives_what_is_recorded(name: str) -> None:
    case = next(case for case in cycles.cases() if case.name == name)
    cycles.prepare()
    cycles.assign(case)
    cosine = case.cosines[1]
    expected = recorded(name, cosine)
    # 2.6e5 paths: a standard error of at most 1e-3; five of them for each of the two measurements.
    assert cycles.measure(cosine, cosine > 0) == pytest.approx(expected[0], abs=7e-3)
    if case.transmits:
        assert cycles.measure(cosine, cosine < 0) == pytest.approx(expected[1], abs=7e-3)


def test_the_recorded_lobes_are_those_of_the_materials() -> None:
    for case in cycles.cases():
        for lobe in case.material.lobes:
            assert cycles.initialiser(lobe) in RECORDED, case.name
