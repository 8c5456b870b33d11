"""Renderers whose scene has moved: the pictures that new renderers make, while only what has moved goes to the core."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from small_scenes import room

from vlp_bpt import Device, Renderer, RenderSettings, SceneError, upload
from vlp_bpt.scene import Instance, Lobe, LobeKind, Material, Mesh, PointLight, Scene, Spheres, SunLight, World

SETTINGS = RenderSettings(samples=4, device=Device.CPU, threads=1)
EMPTY, ROOM, BALL, SHARED, BOARDS, SPHERES, NO_SPHERES, LAMP = range(8)  # geometries of `crowd`
_SHARED_AT = 3  # the first instance of SHARED


def ball(name: str, rings: int, radius: float) -> Mesh:
    """Smooth, with texture coordinates."""
    theta, phi = np.meshgrid(np.linspace(0.01, 3.13, rings), np.linspace(0, 2 * np.pi, 2 * rings), indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    row = 2 * rings
    a = (np.arange(rings - 1)[:, None] * row + np.arange(row - 1)).ravel()
    triangles = np.concatenate([np.stack([a, a + row, a + 1], 1), np.stack([a + 1, a + row, a + row + 1], 1)])
    points = points.reshape(-1, 3).astype(np.float32)
    uvs = {"UVMap": points[triangles][..., :2].copy()}
    slots = np.arange(len(triangles), dtype=np.int32) % 2
    return Mesh(name, radius * points, triangles.astype(np.int32), points[triangles], uvs, slots)


def crowd() -> Scene:
    """Placed once and shared, mirrored, cut, round and shining things; some are empty: the core never sees them."""
    random = np.random.default_rng(5)
    scene = room(24, 16)
    middle = random.uniform(-0.8, 0.8, (200, 1, 3))
    boards = (middle + random.normal(size=(200, 3, 3)) * [[[0.3], [0.3], [0.01]]] * 0.5).astype(np.float32)
    scene.geometries = [
        Mesh("nothing", np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32)),
        scene.geometries[0],
        ball("ball", 20, 0.4),
        ball("shared", 24, 0.15),
        Mesh("boards", boards.reshape(-1, 3), np.arange(600, dtype=np.int32).reshape(-1, 3)),
        Spheres("spheres", random.uniform(-0.9, 0.9, (30, 3)).astype(np.float32), np.full(30, 0.05, np.float32)),
        Spheres("no spheres", np.zeros((0, 3), np.float32), np.zeros(0, np.float32)),
        Mesh("lamp", np.eye(3, dtype=np.float32) * 0.3, np.array([[0, 1, 2]], np.int32)),
    ]
    scene.materials += [
        Material("red", (Lobe(LobeKind.DIFFUSE, (0.8, 0.2, 0.1)),)),
        Material("shining", (), emission=(5, 4, 3)),
    ]
    scene.instances = [Instance("nothing", EMPTY), Instance("room", ROOM), Instance("ball", BALL, at(0.2), (0, 1))]
    for i in range(4):
        scene.instances.append(Instance(f"shared {i}", SHARED, at(*random.uniform(-0.7, 0.7, 3), mirror=i == 1), (1,)))
    scene.instances += [
        Instance("boards", BOARDS),
        Instance("no spheres", NO_SPHERES),
        Instance("spheres", SPHERES, at(0, 0.1), (1,)),
        Instance("lamp", LAMP, at(-0.3, 0.2, 0.1), (2,)),
    ]
    return scene


def at(x: float, y: float = 0, z: float = 0, mirror: bool = False) -> NDArray[np.float32]:
    transform = np.eye(3, 4, dtype=np.float32)
    transform[:, 3] = x, y, z
    transform[0, 0] = -1 if mirror else 1
    return transform


def reshape(geometry: int) -> Callable[[Scene], None]:
    def edit(scene: Scene) -> None:
        mesh: Any = scene.geometries[geometry]
        if isinstance(mesh, Spheres):
            mesh.centers = mesh.centers[:, [1, 2, 0]].copy()
            mesh.radii = mesh.radii * np.float32(2)
            return
        angle = 0.5 * mesh.positions[:, 2]
        x, y, z = mesh.positions.T
        mesh.positions = np.stack([np.cos(angle) * x - y * 0.2, y * 0.9, z * 0.8 + 0.05 * x], axis=1)
        if mesh.corner_normals is not None:
            mesh.corner_normals = mesh.corner_normals[:, :, [1, 2, 0]].copy()
            mesh.uvs = {"UVMap": mesh.uvs["UVMap"] * 2}
            mesh.material_index = 1 - mesh.material_index

    return edit


def move(*instances: int) -> Callable[[Scene], None]:
    def edit(scene: Scene) -> None:
        for i in instances:
            transform = scene.instances[i].transform.copy()
            transform[:, 3] += np.float32(0.1)
            transform[1, 0] += np.float32(0.3)
            scene.instances[i].transform = transform

    return edit


def collapse(scene: Scene) -> None:
    mesh: Any = scene.geometries[BALL]
    mesh.positions = np.full_like(mesh.positions, 0.1)


def scatter(scene: Scene) -> None:
    """Far beyond what a tree can follow."""
    mesh: Any = scene.geometries[BOARDS]
    mesh.positions = np.random.default_rng(1).permutation(mesh.positions.reshape(-1, 3, 3)).reshape(-1, 3)


EDITS = [reshape(i) for i in (ROOM, BALL, SHARED, BOARDS, SPHERES, LAMP)]
EDITS += [move(i) for i in (1, 2, _SHARED_AT, 7, 9, 10)] + [move(*range(11)), collapse, scatter]


@pytest.mark.parametrize("sky", [False, True])
@pytest.mark.parametrize("edit", EDITS)
def test_moved_scenes_give_the_picture_of_a_new_renderer(edit: Callable[[Scene], None], sky: bool) -> None:
    scene = crowd()
    if sky and edit is not EDITS[2]:  # the bounds of instances, through which it shines, depend on the tree they share
        scene.world = World(radiance=(0.5, 0.6, 0.7))
        scene.lights.append(SunLight("sun", at(0), (2, 2, 2), 0.1))
    renderer = Renderer(scene, SETTINGS)
    renderer.iterate(1)
    native_scene = renderer._scene
    edit(scene)
    renderer.update(scene)
    assert renderer._scene is native_scene
    np.testing.assert_array_equal(renderer.render().pixels, Renderer(scene, SETTINGS).render().pixels)


def test_edits_one_after_the_other() -> None:
    scene = crowd()
    renderer = Renderer(scene, SETTINGS)
    for edit in EDITS:
        edit(scene)
        renderer.update(scene)
    scene.lights.append(PointLight("point", (0.1, 0.1, 0.1), (3, 3, 3)))
    renderer.update(scene)
    np.testing.assert_array_equal(renderer.render().pixels, Renderer(scene, SETTINGS).render().pixels)


def test_only_what_moved_goes_to_the_core(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = crowd()
    renderer = Renderer(scene, SETTINGS)
    moved: list[str] = []
    checked: list[str] = []
    move_geometry = upload._move_geometry

    def note(geometry: Mesh | Spheres, *rest: Any) -> None:
        moved.append(geometry.name)
        move_geometry(geometry, *rest)

    monkeypatch.setattr("vlp_bpt.upload._move_geometry", note)
    monkeypatch.setattr("vlp_bpt.validation._check_mesh", lambda mesh: checked.append(mesh.name))
    reshape(BALL)(scene)
    move(2, 4)(scene)
    renderer.update(scene)
    assert moved == checked == ["ball"]


def test_what_cannot_be_rendered_is_refused_by_name() -> None:
    scene = crowd()
    renderer = Renderer(scene, SETTINGS)
    first = renderer.render().pixels
    mesh: Any = scene.geometries[BALL]
    positions = mesh.positions
    mesh.positions = positions.copy()
    mesh.positions[7, 1] = np.nan
    with pytest.raises(SceneError, match=r"mesh 'ball': positions: vertex 7 is .* must be finite"):
        renderer.update(scene)
    mesh.positions = positions
    scene.instances[2].transform = np.zeros((3, 4), np.float32)
    with pytest.raises(SceneError, match="instance 'ball': transform is singular"):
        renderer.update(scene)
    renderer.update()
    np.testing.assert_array_equal(renderer.render().pixels, first)
