"""Hits against Embree's on the same rays: evaluated meshes of Blender, slivers, scales from 1e-3 to 1e5, instances.

Both work in single precision, so they may disagree where a ray passes an edge of a triangle by less than rounding: each
disagreement must be such a ray, measured in double precision from the triangles alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import bpy
import bpy_scenes
import numpy as np
import pytest
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from vlp_bpt import Scene, _native
from vlp_bpt.scene import Film, Instance, Material, Mesh
from vlp_bpt.upload import upload

RAYS = 1_000_000  # of each mesh, for closest hits and again for any hit
ROUNDING = 4e-6  # of the size of the numbers at play: the mesh and the ray's way to it


@dataclass
class Model:
    """Triangles in the world (T, 3, 3) float32, their instance and number there (T,), and the scene that holds them."""

    corners: np.ndarray
    instance: np.ndarray
    primitive: np.ndarray
    scene: Any

    @property
    def extent(self) -> float:
        points = self.corners.reshape(-1, 3)
        return float(np.linalg.norm(np.ptp(points.astype(np.float64), axis=0)))

    @property
    def largest_coordinate(self) -> float:
        return float(np.abs(self.corners).max())


def model(scene: Scene) -> Model:
    scene.validate()
    native = _native.Scene()
    upload(scene, native)
    native.build(0)
    corners, instances, primitives = [], [], []
    for number, instance in enumerate(scene.instances):
        mesh = scene.geometries[instance.geometry]
        points = np.asarray(mesh.positions)[mesh.triangles].astype(np.float64)
        matrix = np.asarray(instance.transform, dtype=np.float64)
        corners.append(points @ matrix[:, :3].T + matrix[:, 3])
        instances.append(np.full(len(points), number))
        primitives.append(np.arange(len(points)))
    world = np.concatenate(corners).astype(np.float32)
    return Model(world, np.concatenate(instances), np.concatenate(primitives), native)


def exported() -> Scene:
    return bpy_scenes.export()


def modified(add: Callable[..., Any], *modifiers: tuple[str, dict[str, Any]], smooth: bool = True) -> Scene:
    """One of Blender's own primitives under modifiers, as the add-on exports it."""
    add()
    shape = bpy.context.object
    for kind, values in modifiers:
        modifier = shape.modifiers.new(kind, kind)
        for name, value in values.items():
            setattr(modifier, name, value)
    if smooth:
        bpy.ops.object.shade_smooth()
    return exported()


def displaced_grid() -> Scene:
    texture = bpy.data.textures.new("clouds", "CLOUDS")
    texture.noise_scale = 0.4
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=120, y_subdivisions=120)
    bpy.context.object.modifiers.new("Displace", "DISPLACE").texture = texture
    return exported()


def one_mesh(positions: np.ndarray, triangles: np.ndarray) -> Scene:
    mesh = Mesh("mesh", positions.astype(np.float32), triangles.astype(np.int32))
    return scene_of([mesh], [Instance("mesh", 0)])


def scene_of(meshes: list[Mesh], instances: list[Instance]) -> Scene:
    camera = exported().camera
    return Scene(list(meshes), instances, [Material("white")], camera=camera, film=Film(8, 8))


def soup(count: int, size: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    centres = random.uniform(-1, 1, (count, 1, 3))
    return (centres + size * random.normal(size=(count, 3, 3))).reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def slivers() -> Scene:
    """Needles a ten-thousandth as wide as long, and fans of them that share edges and a corner."""
    random = np.random.default_rng(3)
    points, triangles = soup(3000, 0.0, 4)
    along = random.normal(size=(3000, 3))
    points = points.reshape(-1, 3, 3)
    points[:, 1] += along
    points[:, 2] += along * random.random((3000, 1)) + 1e-4 * random.normal(size=(3000, 3))
    angle = np.linspace(0, 2 * np.pi, 2001)[:-1]
    rim = np.stack([np.cos(angle), np.sin(angle), 0.1 * np.sin(7 * angle)], axis=1)
    fan = np.concatenate([[[0, 0, 0.5]], rim])
    around = np.arange(2000)
    shared = np.stack([np.zeros(2000, int), 1 + around, 1 + (around + 1) % 2000], axis=1) + 9000
    return one_mesh(np.concatenate([points.reshape(-1, 3), fan]), np.concatenate([triangles, shared]))


def scaled(scale: float, shift: float) -> Scene:
    positions, triangles = soup(4000, 0.1, 5)
    return one_mesh(positions * scale + shift, triangles)


def instances() -> Scene:
    """Two meshes placed 60 times: turned, scaled unevenly, sheared and mirrored."""
    random = np.random.default_rng(6)
    meshes = [
        Mesh(f"mesh {i}", *(a.astype(t) for a, t in zip(soup(300, 0.2, i), (np.float32, np.int32), strict=True)))
        for i in range(2)
    ]
    placed = []
    for i in range(60):
        matrix = np.concatenate([random.normal(size=(3, 3)) * 0.3, random.uniform(-3, 3, (3, 1))], axis=1)
        placed.append(Instance(f"instance {i}", i % 2, matrix.astype(np.float32)))
    return scene_of(meshes, placed)


MODELS: dict[str, Callable[[], Scene]] = {
    "subdivided monkey": lambda: modified(
        bpy.ops.mesh.primitive_monkey_add, ("SUBSURF", {"render_levels": 2, "levels": 2})
    ),
    "uv sphere, flat": lambda: modified(bpy.ops.mesh.primitive_uv_sphere_add, smooth=False),
    "array of tori": lambda: modified(bpy.ops.mesh.primitive_torus_add, ("ARRAY", {"count": 5}), ("TRIANGULATE", {})),
    "bevelled cube": lambda: modified(bpy.ops.mesh.primitive_cube_add, ("BEVEL", {"segments": 6, "width": 0.3})),
    "wire of an icosphere": lambda: modified(bpy.ops.mesh.primitive_ico_sphere_add, ("WIREFRAME", {"thickness": 0.03})),
    "cone, solidified": lambda: modified(bpy.ops.mesh.primitive_cone_add, ("SOLIDIFY", {"thickness": 0.1})),
    "displaced grid": displaced_grid,
    "triangle soup": lambda: one_mesh(*soup(20000, 0.05, 1)),
    "slivers": slivers,
    "small": lambda: scaled(1e-3, 0),
    "huge": lambda: scaled(1e5, 0),
    "far from the origin": lambda: scaled(1, 200),
    "instances": instances,
}


def rays(model: Model, count: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Origins, unit directions, and whether the ray was aimed at a border.

    They start around and within the mesh; at random, along axes, and aimed at points inside triangles, on their edges
    and at their corners.
    """
    random = np.random.default_rng(seed)
    points = model.corners.reshape(-1, 3).astype(np.float64)
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = (low + high) / 2, (high - low) / 2 + 0.05 * model.extent
    origins = middle + half * random.uniform(-1, 1, (count, 3)) * np.where(random.random((count, 1)) < 0.5, 1, 3)
    origins = origins.astype(np.float32)
    directions = random.normal(size=(count, 3))
    kind = random.integers(0, 5, count)
    along = kind == 1
    directions[along] = np.eye(3)[random.integers(0, 3, along.sum())] * random.choice([-1, 1], (along.sum(), 1))
    weights = random.dirichlet([1, 1, 1], count)
    on_edge, corner = kind == 3, kind == 4
    weights[on_edge, 0] = 0
    weights[corner] = np.eye(3)[random.integers(0, 3, corner.sum())]
    weights /= weights.sum(axis=1, keepdims=True)
    chosen = model.corners[random.integers(0, len(model.corners), count)].astype(np.float64)
    targets = np.einsum("nk,nkc->nc", weights, chosen)
    aimed = kind >= 2
    directions[aimed] = targets[aimed] - origins[aimed]
    length = np.linalg.norm(directions, axis=1, keepdims=True)
    directions = np.where(length > 0, directions / np.where(length > 0, length, 1), [0, 0, 1])
    return origins, directions.astype(np.float32), kind >= 3


def edge_distance(origins: np.ndarray, directions: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """The least distance of each ray's line from the borders of its triangle, (N,), in double precision."""
    o, d, c = (a.astype(np.float64) for a in (origins, directions, corners))
    u = d / np.linalg.norm(d, axis=1, keepdims=True)
    flat = c - o[:, None]
    flat -= np.einsum("nkc,nc->nk", flat, u)[..., None] * u[:, None]  # seen along the ray, which is the origin here
    least = np.full(len(o), np.inf)
    for i in range(3):
        a, edge = flat[:, i], flat[:, (i + 1) % 3] - flat[:, i]
        size = np.einsum("nc,nc->n", edge, edge)
        s = np.clip(-np.einsum("nc,nc->n", a, edge) / np.where(size > 0, size, 1), 0, 1)
        least = np.minimum(least, np.linalg.norm(a + s[:, None] * edge, axis=1))
    return least


def embree(model: Model) -> Any:
    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, model.corners)
    return scene


@pytest.fixture(params=MODELS, scope="function")
def both(request: pytest.FixtureRequest) -> tuple[Model, Any]:
    made = model(MODELS[request.param]())
    return made, embree(made)


def triangle_of(model: Model, hits: dict[str, np.ndarray]) -> np.ndarray:
    """(N,) index into the model's triangles, -1 where a ray missed."""
    first = np.searchsorted(model.instance, np.arange(model.instance[-1] + 1))
    found = np.isfinite(hits["t"])
    instance = np.where(found, hits["instance"], 0).astype(np.int64)
    return np.where(found, first[instance] + hits["primitive"].astype(np.int64), -1)


def test_closest_hits(both: tuple[Model, Any]) -> None:
    made, oracle = both
    origins, directions, at_border = rays(made, RAYS, 1)
    hits = made.scene.intersect(origins, directions, np.full(RAYS, np.inf, np.float32))
    theirs = oracle.run(origins, directions, output=True)
    ours, other = triangle_of(made, hits), theirs["primID"].astype(np.int64)
    found = ours >= 0
    assert found.mean() > 0.1

    way = np.where(found, hits["t"], np.where(other >= 0, theirs["tfar"], 0)).astype(np.float64)
    rounding = ROUNDING * (made.extent + made.largest_coordinate + np.linalg.norm(origins, axis=1) + way)

    same = found & (ours == other)
    assert (same | ~found)[~at_border].mean() > 0.99
    corners = made.corners[ours[same]].astype(np.float64)
    ray = directions[same].astype(np.float64)
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    perpendicular = np.cross(e1, e2)
    # Areas as the ray sees them make up t and the weights: rounding grows as the triangle's own one shrinks.
    longest = np.max([(e1**2).sum(axis=1), (e2**2).sum(axis=1), ((e1 - e2) ** 2).sum(axis=1)], axis=0)
    seen = np.abs(np.einsum("nc,nc->n", perpendicular, ray)) / longest
    t, their_t = (values[same].astype(np.float64) for values in (hits["t"], theirs["tfar"]))
    assert (np.abs(t - their_t) * seen <= rounding[same]).all()
    apart = e1 * (hits["u"] - theirs["u"])[same, None] + e2 * (hits["v"] - theirs["v"])[same, None]
    apart -= np.einsum("nc,nc->n", apart, ray)[:, None] * ray  # as the ray sees it
    assert (np.linalg.norm(apart, axis=1) * seen <= rounding[same]).all()

    area = np.linalg.norm(perpendicular, axis=1)
    well_shaped = area > 1e-3 * longest
    their_normal = theirs["Ng"][same].astype(np.float64)
    facing = np.einsum("nc,nc->n", hits["normal"][same], their_normal) / np.linalg.norm(their_normal, axis=1)
    assert np.abs(facing[well_shaped]).min() > 0.999

    # Elsewhere one of the two missed the nearer triangle, at its border, or both triangles are at the same place.
    differ = np.flatnonzero(ours != other)
    t = np.where(found, hits["t"], np.inf)[differ].astype(np.float64)
    their_t = np.where(other >= 0, theirs["tfar"], np.inf)[differ].astype(np.float64)
    nearer = np.where(t < their_t, ours[differ], other[differ])
    distance = edge_distance(origins[differ], directions[differ], made.corners[nearer])
    together = np.abs(t - their_t) <= rounding[differ]
    unexplained = differ[(distance > rounding[differ]) & ~together]
    assert len(unexplained) == 0, (
        f"{len(unexplained)} rays, the first from {origins[unexplained[0]]} along {directions[unexplained[0]]}: "
        f"triangle {ours[unexplained[0]]} at {hits['t'][unexplained[0]]}, Embree finds {other[unexplained[0]]} "
        f"at {theirs['tfar'][unexplained[0]]}"
    )


def test_any_hit(both: tuple[Model, Any]) -> None:
    """Blocked rays are those whose closest hit lies before their end, and those that Embree finds blocked."""
    made, oracle = both
    origins, directions, _ = rays(made, RAYS, 2)
    ends = (made.extent * np.random.default_rng(7).exponential(0.5, RAYS)).astype(np.float32)
    blocked = made.scene.occluded(origins, directions, ends).astype(bool)
    hits = made.scene.intersect(origins, directions, ends)
    assert (blocked == np.isfinite(hits["t"])).all()
    assert 0.05 < blocked.mean() < 0.95

    theirs = oracle.run(origins, directions, dists=ends, output=True)
    other = theirs["primID"].astype(np.int64)
    differ = np.flatnonzero(blocked != (other >= 0))
    triangles = np.where(blocked, triangle_of(made, hits), other)[differ]
    t = np.where(blocked, hits["t"], theirs["tfar"])[differ].astype(np.float64)
    rounding = ROUNDING * (made.extent + made.largest_coordinate + np.linalg.norm(origins[differ], axis=1) + t)
    distance = edge_distance(origins[differ], directions[differ], made.corners[triangles])
    at_its_end = np.abs(t - ends[differ]) <= rounding
    assert ((distance <= rounding) | at_its_end).all()


def test_rays_that_are_none(both: tuple[Model, Any]) -> None:
    made, _ = both
    centre = made.corners.reshape(-1, 3).mean(axis=0)
    bad = [(np.nan, 0, 1), (np.inf, 0, 0), (0, 0, 0), (-np.inf, np.nan, 0)]
    directions = np.array(bad + [(0, 0, 1)] * 4, np.float32)
    origins = np.array([centre] * 4 + [(np.nan, 0, 0), (np.inf, 0, 0), (0, -np.inf, 0), (0, 0, np.nan)], np.float32)
    ends = np.full(8, np.inf, np.float32)
    assert not np.isfinite(made.scene.intersect(origins, directions, ends)["t"]).any()
    assert not made.scene.occluded(origins, directions, ends).any()
