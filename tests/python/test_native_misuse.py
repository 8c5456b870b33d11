"""The native core called directly, and wrongly: it raises and goes on.

The Python layer checks scenes first and names datablocks; still no caller may bring the process down.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scenes_for_tests import settings

from vlp_bpt.render import load_native

NAN, INF = math.nan, math.inf
_native = load_native()

FLOATS, INTS = np.float32, np.int32
TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], FLOATS), np.array([[0, 1, 2]], INTS)
TWO = TRIANGLE[0], np.array([[0, 1, 2], [2, 1, 0]], INTS)
UNIT = np.eye(3, 4, dtype=FLOATS)
ONE = np.ones(1, FLOATS)
LOBE: tuple[Any, ...] = (
    np.array([0], INTS), np.array([0], INTS), np.ones((1, 3), FLOATS), ONE, ONE * 1.5, np.ones((1, 3), FLOATS),
    np.ones((1, 3), FLOATS), np.array([-1], INTS), np.array([0], INTS), (0.0, 0.0, 0.0),
)  # fmt: skip


def lobe_with(i: int, value: Any) -> tuple[Any, ...]:
    return (*LOBE[:i], value, *LOBE[i + 1 :])


def native_scene() -> Any:
    scene = _native.Scene()
    scene.add_mesh(*TRIANGLE, None, None, None)
    scene.add_material(*LOBE)
    return scene


def of(name: str, *arguments: Any) -> Callable[[Any], Any]:
    return lambda scene: getattr(scene, name)(*arguments)


MISUSES: dict[str, Callable[[Any], Any]] = {
    "flat positions": of("add_mesh", np.zeros(9, FLOATS), TRIANGLE[1], None, None, None),
    "quadruples": of("add_mesh", np.zeros((3, 4), FLOATS), TRIANGLE[1], None, None, None),
    "quads": of("add_mesh", TRIANGLE[0], np.zeros((1, 4), INTS), None, None, None),
    "index beyond": of("add_mesh", TRIANGLE[0], np.array([[0, 1, 3]], INTS), None, None, None),
    "negative index": of("add_mesh", TRIANGLE[0], np.array([[0, 1, -1]], INTS), None, None, None),
    "NaN position": of("add_mesh", np.full((3, 3), NAN, FLOATS), TRIANGLE[1], None, None, None),
    "too few normals": of("add_mesh", *TWO, np.ones((1, 3, 3), FLOATS), None, None),
    "normals of pairs": of("add_mesh", *TRIANGLE, np.ones((1, 3, 2), FLOATS), None, None),
    "too few uvs": of("add_mesh", *TWO, None, np.ones((1, 3, 2), FLOATS), None),
    "too many slots": of("add_mesh", *TRIANGLE, None, None, np.zeros(2, INTS)),
    "negative slot": of("add_mesh", *TRIANGLE, None, None, np.array([-1], INTS)),
    "large slot": of("add_mesh", *TRIANGLE, None, None, np.array([65536], INTS)),
    "mesh of None": of("add_mesh", None, None, None, None, None),
    "a list": of("add_mesh", [[0, 0, 0]], TRIANGLE[1], None, None, None),
    "strided": of("add_mesh", np.zeros((3, 6), FLOATS)[:, ::2], TRIANGLE[1].T, None, None, None),
    "radii missing": of("add_spheres", np.zeros((2, 3), FLOATS), ONE, None),
    "NaN radius": of("add_spheres", np.zeros((1, 3), FLOATS), ONE * NAN, None),
    "negative radius": of("add_spheres", np.zeros((1, 3), FLOATS), -ONE, None),
    "kind of lobe": of("add_material", *lobe_with(0, np.array([256], INTS))),
    "negative kind": of("add_material", *lobe_with(0, np.array([-1], INTS))),
    "Fresnel term": of("add_material", *lobe_with(1, np.array([256], INTS))),
    "short weights": of("add_material", *lobe_with(2, np.ones((0, 3), FLOATS))),
    "weights of pairs": of("add_material", *lobe_with(2, np.ones((1, 2), FLOATS))),
    "no roughness": of("add_material", *lobe_with(3, np.ones(0, FLOATS))),
    "NaN roughness": of("add_material", *lobe_with(3, ONE * NAN)),
    "layered beyond": of("add_material", *lobe_with(7, np.array([100000], INTS))),
    "layered below": of("add_material", *lobe_with(7, np.array([-2], INTS))),
    "layers missing": of("add_material", *lobe_with(7, np.zeros(0, INTS))),
    "emission of two": of("add_material", *lobe_with(9, (1.0, 1.0))),
    "NaN emission": of("add_material", *lobe_with(9, (NAN, 1.0, 1.0))),
    "no such geometry": of("add_instance", 1, UNIT, np.zeros(1, INTS), 1),
    "negative geometry": of("add_instance", -1, UNIT, np.zeros(1, INTS), 1),
    "no such material": of("add_instance", 0, UNIT, np.ones(1, INTS), 1),
    "negative material": of("add_instance", 0, UNIT, -np.ones(1, INTS), 1),
    "no material": of("add_instance", 0, UNIT, np.zeros(0, INTS), 1),
    "singular": of("add_instance", 0, UNIT * 0, np.zeros(1, INTS), 1),
    "NaN transform": of("add_instance", 0, UNIT * NAN, np.zeros(1, INTS), 1),
    "square matrix": of("add_instance", 0, np.eye(4, dtype=FLOATS), np.zeros(1, INTS), 1),
    "position of two": of("add_point_light", (0, 0), (1, 1, 1), 0.0, 0),
    "camera without a view": of("set_camera", UNIT, 0, 0.0, 0.3, 0, 0, 0, 10, 0, 1),
    "camera of NaN": of("set_camera", UNIT * NAN, 0, 0.3, 0.3, 0, 0, 0, 10, 0, 1),
    "projection": of("set_camera", UNIT, 7, 0.3, 0.3, 0, 0, 0, 10, 0, 1),
    "no film": of("set_film", 0, 0, 0, 0, 0, 0, False),
    "window beyond": of("set_film", 8, 8, 4, 4, 5, 4, False),
    "window far beyond": of("set_film", 8, 8, 2**32 - 1, 0, 2, 8, False),
    "rays before the tree": of("intersect", TRIANGLE[0], TRIANGLE[0], np.ones(3, FLOATS)),
    "renderer before the tree": lambda scene: _native.Renderer(scene, settings().resolved(4, 4).to_dict()),
    "renderer of nothing": lambda scene: _native.Renderer(None, {}),
}  # fmt: skip


@pytest.mark.parametrize("misuse", MISUSES)
def test_native_core_raises(misuse: str) -> None:
    scene = native_scene()
    with pytest.raises((ValueError, TypeError, RuntimeError)):
        MISUSES[misuse](scene)
    # and goes on
    scene.add_instance(0, UNIT, np.zeros(1, INTS), 1)
    scene.set_film(2, 2, 0, 0, 2, 2, False)
    scene.build(1)
    assert scene.info()["triangles"] == 1


@pytest.mark.parametrize(
    "light",
    [
        of("add_point_light", (NAN, 0, 0), (1, 1, 1), 0.0, 0),
        of("add_point_light", (0, 0, 0), (INF, 1, 1), 0.0, 0),
        of("add_point_light", (0, 0, 0), (1, 1, 1), -1.0, 0),
        of("add_spot_light", UNIT * 0, (1, 1, 1), 1.0, 0.1, 0.0, 0),
        of("add_spot_light", UNIT, (1, 1, 1), NAN, 0.1, 0.0, 0),
        of("add_sun_light", UNIT * NAN, (1, 1, 1), 0.0, 0),
        of("add_sun_light", UNIT, (1, 1, 1), NAN, 0),
        of("add_area_light", UNIT * 0, (1, 1, 1), 1.0, 1.0, False, 3.0, 0),
        of("add_area_light", UNIT, (1, 1, 1), 0.0, 1.0, False, 3.0, 0),
        of("add_area_light", UNIT, (1, 1, 1), 1.0, 1.0, True, NAN, 0),
    ],
)
def test_native_core_leaves_degenerate_lights_out(light: Callable[[Any], Any]) -> None:
    assert light(native_scene()) is False


def native_renderer(**changes: Any) -> Any:
    scene = native_scene()
    scene.add_instance(0, UNIT, np.zeros(1, INTS), 1)
    scene.set_world((1.0, 1.0, 1.0))
    scene.set_film(4, 3, 0, 0, 4, 3, False)
    scene.build(1)
    options = settings().resolved(4, 3).to_dict() | {"iteration_begin": 0} | changes
    return _native.Renderer(scene, options)


@pytest.mark.parametrize(
    "changes",
    [
        {"light_path_length": 65}, {"eye_path_length": 65}, {"eye_path_length": 0}, {"light_paths": -1},
        {"light_paths": 2**40}, {"light_paths": 2**31, "light_path_length": 2}, {"weighting": "MEDIAN"},
        {"weighting": 3}, {"filter": "SHARP"}, {"filter_width": NAN}, {"filter_width": -1.0}, {"device": "ABACUS"},
        {"seed": "x"}, {"threads": -1}, {"roulette": None},
    ],
)  # fmt: skip
def test_native_settings_raise(changes: dict[str, Any]) -> None:
    with pytest.raises((ValueError, TypeError, RuntimeError)):
        native_renderer(**changes)


def test_native_settings_may_not_lack_one() -> None:
    scene = native_scene()
    scene.set_film(4, 3, 0, 0, 4, 3, False)
    scene.build(1)
    options = settings().resolved(4, 3).to_dict() | {"iteration_begin": 0}
    for name in set(options) - {"mode", "samples", "time_limit", "noise_threshold", "denoise_prefilter"}:
        with pytest.raises((ValueError, TypeError, RuntimeError), match=name):
            _native.Renderer(scene, {k: v for k, v in options.items() if k != name})


def test_native_renderer_misused() -> None:
    renderer = native_renderer()
    assert renderer.iterate(2) == 2
    for bad in (
        lambda: renderer.read(np.zeros((4, 3, 4), FLOATS)),
        lambda: renderer.read(np.zeros((3, 4, 3), FLOATS)),
        lambda: renderer.read(np.zeros((3, 4, 4))),
        lambda: renderer.read(None),
        lambda: renderer.add_film_state(np.zeros((4, 3, 4, 2), np.int64), 1),
        lambda: renderer.add_film_state(np.zeros((3, 4, 4, 1), np.int64), 1),
        lambda: renderer.add_film_state(np.zeros((3, 4, 4, 2), FLOATS), 1),
        lambda: renderer.iterate(-1),
        lambda: renderer.iterate("x"),
        lambda: renderer.set_deadline("soon"),
    ):
        with pytest.raises((ValueError, TypeError, RuntimeError)):
            bad()
    fixed = np.zeros((3, 4, 4), FLOATS)
    fixed.flags.writeable = False
    with pytest.raises((ValueError, TypeError, RuntimeError)):
        renderer.read(fixed)
    out = np.zeros((3, 4, 4), FLOATS)
    renderer.read(out)
    assert out.max() > 0
    assert renderer.iterate(0) == 0


def test_native_scene_is_closed_once_built() -> None:
    scene = native_scene()
    scene.add_instance(0, UNIT, np.zeros(1, INTS), 1)
    scene.set_film(4, 3, 0, 0, 4, 3, False)
    scene.build(1)
    for late in (
        of("add_mesh", *TRIANGLE, None, None, None),
        of("add_spheres", np.zeros((1, 3), FLOATS), ONE, None),
        of("add_material", *LOBE),
        of("add_instance", 0, UNIT, np.zeros(1, INTS), 1),
        of("add_point_light", (0, 0, 0), (1, 1, 1), 0.0, 0),
        of("set_film", 4, 4, 0, 0, 4, 4, False),
        of("build", 1),
    ):
        with pytest.raises((ValueError, RuntimeError)):
            late(scene)


def test_rays_of_unequal_numbers() -> None:
    scene = native_scene()
    scene.add_instance(0, UNIT, np.zeros(1, INTS), 1)
    scene.set_film(4, 3, 0, 0, 4, 3, False)
    scene.build(1)
    rays = np.ones((5, 3), FLOATS)
    for name in ("intersect", "occluded"):
        for arguments in (
            (rays, rays[:4], np.ones(5, FLOATS)),
            (rays, rays, np.ones(4, FLOATS)),
            (rays[:, :2], rays, np.ones(5, FLOATS)),
        ):
            with pytest.raises((ValueError, TypeError)):
                getattr(scene, name)(*arguments)
        odd = np.array([[NAN, 0, 0], [INF, 0, 0], [0, 0, 0], [1e38, 1e38, 1e38]], FLOATS)
        getattr(scene, name)(odd, odd[::-1].copy(), np.full(4, INF, FLOATS))
