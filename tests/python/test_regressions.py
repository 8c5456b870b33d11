"""Small scenes after bugs of other bidirectional renderers, against closed forms or against eye paths alone (C = 0).

Comparisons are t-tests over independent batches with Sidak's correction, at a false-alarm rate of 1e-4 each, of fixed
seeds.
"""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
from scenes_for_tests import (
    Array,
    Builder,
    assert_mean,
    assert_same_mean,
    ball,
    batches,
    blocks,
    cube,
    from_above,
    grey,
    looking,
    quad,
    settings,
    sphere,
    square,
    transform,
)

from vlp_bpt import Scene, materials
from vlp_bpt.scene import AreaLight, Material, Mesh, PointLight, Visibility, World

# Both find paths of up to 8 vertices; the second by eye walks alone, which need no adjoint.
BOTH_WAYS: dict[str, Any] = {"light_path_length": 3, "eye_path_length": 3, "light_paths": 500, "samples": 128}
EYE_ONLY: dict[str, Any] = {"light_path_length": 0, "eye_path_length": 6, "vlp_connections": 0, "light_samples": 2}


def pictures(scene: Scene, seed: int, **options: Any) -> Array:
    return blocks(batches(scene, settings(**({"samples": 128} | options)), 24, seed))


def tilted(mesh: Mesh, by: float) -> Mesh:
    """The mesh with vertex normals that lean by up to about `by` (tangent), each another way."""
    normals = np.cross(
        mesh.positions[mesh.triangles[:, 1]] - mesh.positions[mesh.triangles[:, 0]],
        mesh.positions[mesh.triangles[:, 2]] - mesh.positions[mesh.triangles[:, 0]],
    )
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    lean = by * np.random.default_rng(3).uniform(-1, 1, mesh.positions.shape)
    corners = normals[:, None] + lean[mesh.triangles]
    mesh.corner_normals = (corners / np.linalg.norm(corners, axis=-1, keepdims=True)).astype(np.float32)
    return mesh


def grid(side: float, cells: int) -> Mesh:
    """A floor of many small squares."""
    at = np.linspace(-side / 2, side / 2, cells + 1)
    x, y = np.meshgrid(at, at)
    k = np.add.outer(np.arange(cells) * (cells + 1), np.arange(cells)).ravel()
    row = cells + 1
    triangles = np.concatenate([np.stack([k, k + 1, k + row + 1], 1), np.stack([k, k + row + 1, k + row], 1)])
    return Mesh("grid", np.stack([x, y, 0 * x], -1).reshape(-1, 3), triangles.astype(np.int32))


def floor_lit_by_a_wall(normals: float) -> Scene:
    """The lamp shines at the wall alone: all light on the floor has bounced."""
    wall = quad((-1.5, 1.2, 0), (1.5, 1.2, 0), (1.5, 1.2, 2), (-1.5, 1.2, 2), name="wall")
    builder = Builder(16, looking((0.4, -2.0, 2.2), (0, 0.1, 0.1), 0.36))
    builder.add(tilted(grid(2.4, 6), normals), grey(0.8)).add(wall, grey(0.8))
    toward_wall = np.array([[1, 0, 0, 0], [0, 0, -1, 0.1], [0, 1, 0, 1.0]], np.float32)  # -z of the lamp is +y
    builder.scene.lights = [AreaLight("lamp", toward_wall, (30, 30, 30), (0.6, 0.6))]
    return builder.scene


def test_interpolated_normals_on_a_floor_lit_indirectly() -> None:
    """pbrt-v4 issues 13, 385 and 526: the adjoint of shading normals, which direct light never meets."""
    scene = floor_lit_by_a_wall(0.6)
    assert_same_mean(pictures(scene, 0, **BOTH_WAYS), pictures(scene, 1000, **EYE_ONLY), "leaning normals")


@pytest.mark.parametrize("scale", [(-1, 1, 1), (-1.5, 0.5, -1), (-1, -1, -1)])
@pytest.mark.parametrize("strategies", [{}, {"light_samples": 0}, {"light_samples": 4}])
def test_mirrored_emitter_with_vertex_normals(scale: tuple[float, float, float], strategies: dict[str, int]) -> None:
    """pbrt-v3 issue 229: neither vertex normals nor a mirroring transform change what a surface emits: the transform
    makes a unit square of it, one metre above another."""
    emitter = square(1)
    emitter.positions = (emitter.positions / np.abs(scale)).astype(np.float32)
    scene = Builder(8, from_above(5, 0.5)).add(square(1), grey(0.8)).scene
    builder = Builder(8)
    builder.scene = scene
    builder.add(tilted(emitter, 0.8), Material("light", (), (2, 2, 2)), transform((0, 0, 1), scale))
    scene.instances[-1].visibility = Visibility(0)
    options = {"light_path_length": 0, "vlp_connections": 0, "eye_path_length": 2, "samples": 256} | strategies
    means = batches(scene, settings(**options), 12).mean(axis=(1, 2, 3))
    assert_mean(means[:, None], 0.8 * 2 * 0.1998249, f"{scale}, {strategies}", rounding=1e-4)


def test_mirrored_emitter_that_scatters_indirectly() -> None:
    """The same with light paths that begin on it and eye paths that come back to it."""
    builder = Builder(16, looking((0.4, -2.6, 2.0), (0, 0, 0.4), 0.4)).add(square(8), grey(0.7))
    builder.add(ball(6, 8), grey(0.5, 2.0), transform((0.3, 0.2, 0.9), (-0.4, 0.3, 0.25)))
    builder.add(ball(6, 8), grey(0.7), transform((-0.6, 0, 0.5), (-0.3, -0.4, -0.3)))
    scene = builder.scene
    assert_same_mean(pictures(scene, 0, **BOTH_WAYS), pictures(scene, 1000, **EYE_ONLY), "mirrored emitter")


def test_point_light_in_a_box_gives_no_firefly() -> None:
    """mitsuba issue 132: no pixel of any of 128 pictures of one sample is brighter than balanced weights allow.

    A weighted sample of a strategy is the path's light over the sum of all strategies' densities, so at most what next
    event alone would give: I / (pi d^2) a^(n - 2) for n vertices, with all surfaces farther than d from the lamp. A
    pixel gets one of each strategy, at most n - 2 of them for n vertices; sum_k k a^k = a / (1 - a)^2. K is long, as
    beyond K + 2 vertices there is no next event. Uniform weights show what they keep away.
    """
    albedo, power, distance = 0.6, 40.0, 0.9
    scene = Builder(16, looking((0.1, -0.9, 0.2), (0.1, 1, -0.2), 0.8)).add(cube(), grey(albedo)).scene
    scene.lights = [PointLight("lamp", (0.1, -0.05, 0.1), (power,) * 3)]
    bound = power / (4 * pi) / (pi * distance**2) * albedo / (1 - albedo) ** 2

    def brightest(weighting: str) -> float:
        # N paths for as many pixels, so that one light path weighs as much as one eye path
        options = {"samples": 1, "light_paths": 256, "light_path_length": 3, "eye_path_length": 24}
        return float(batches(scene, settings(weighting=weighting, **options), 128).max())

    found = {weighting: brightest(weighting) for weighting in ("BALANCE", "UNIFORM")}
    print(f"brightest pixel {found}, bound {bound:.2f}")
    assert found["BALANCE"] < bound < found["UNIFORM"]


@pytest.mark.parametrize("mode", ["PAPER", "BALANCED", "REFERENCE"])
def test_furnace_lit_by_the_environment_alone(mode: str) -> None:
    """mitsuba issue 80: white bodies in a white sky cannot be told from it, in every mode."""
    builder = Builder(16, looking((1, -3, 1.5), (0, 0, 0), 0.45)).add(sphere(radius=0.9), grey(1.0))
    scene = builder.scene
    scene.world = World(radiance=(1, 1, 1))
    lengths = {"light_path_length": None, "eye_path_length": None}  # the mode's own
    pictures = batches(scene, settings(mode=mode, samples=64, **lengths), 16)
    assert_mean(blocks(pictures, 8), 1.0, mode, rounding=1e-4)


def behind_tinted_sheets(color: tuple[float, float, float]) -> Scene:
    """A lamp, a floor and a wall, with sheets before the lamp and between floor and wall."""
    wall = quad((-1.2, 1.2, 0), (1.2, 1.2, 0), (1.2, 1.2, 2), (-1.2, 1.2, 2), name="wall")
    sheet = materials.transparent(color)
    builder = Builder(16, looking((0.4, -2.6, 2.4), (0, 0, 0.2), 0.5)).add(square(2.4), grey(0.8)).add(wall, grey(0.8))
    builder.add(square(3, (0, 0, 1.5)), sheet)
    builder.add(quad((-1.5, 0.6, 0.1), (1.5, 0.6, 0.1), (1.5, 0.6, 1.3), (-1.5, 0.6, 1.3), name="sheet"), sheet)
    builder.scene.lights = [AreaLight("lamp", transform((0, -0.2, 1.9)), (30, 30, 30), (0.6, 0.6))]
    return builder.scene


def test_transparent_shadows_on_light_paths() -> None:
    """LuxCore issue 671: what dims an eye path dims a light path and a connection too."""
    scene = behind_tinted_sheets((0.8, 0.5, 0.2))
    assert_same_mean(pictures(scene, 0, **BOTH_WAYS), pictures(scene, 1000, **EYE_ONLY), "tinted sheets")


@pytest.mark.parametrize("options", [BOTH_WAYS, EYE_ONLY], ids=["both", "eye"])
def test_clear_sheets_change_nothing(options: dict[str, Any]) -> None:
    """A sheet that lets all light through counts neither in a path's length nor in its weights."""
    clear, without = behind_tinted_sheets((1, 1, 1)), behind_tinted_sheets((1, 1, 1))
    del without.instances[2:]
    assert_same_mean(pictures(clear, 0, **options), pictures(without, 1000, **options), "clear sheets")
