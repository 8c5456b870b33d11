"""Scenes: arrays come to their types, and every fault is named by datablock, field and value."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from small_scenes import everything, room

from vlp_bpt.errors import SceneError
from vlp_bpt.scene import (
    AreaLight,
    Film,
    Instance,
    Lobe,
    LobeKind,
    Material,
    Mesh,
    PointLight,
    Projection,
    Scene,
    Spheres,
    SpotLight,
    SunLight,
    World,
)

NAN = float("nan")


def mesh(**fields: Any) -> Mesh:
    values: dict[str, Any] = {"positions": np.eye(3), "triangles": [[0, 1, 2]]} | fields
    return Mesh("Cube", **values)


def test_arrays_come_to_their_types() -> None:
    made = mesh(
        positions=[[0, 0, 0], [1, 0, 0], [0, 1, 0]],
        triangles=np.array([[0, 1, 2]], dtype=np.uint64),
        corner_normals=np.zeros((1, 3, 3)),
        uvs={"a": np.zeros((1, 3, 2))},
        material_index=[0],
    )
    arrays = [made.positions, made.corner_normals, made.uvs["a"]]
    assert all(array is not None and array.dtype == np.float32 and array.flags.c_contiguous for array in arrays)
    assert made.triangles.dtype == np.int32
    assert made.material_index is not None
    assert made.material_index.dtype == np.int32


def test_arrays_of_the_right_type_are_not_copied() -> None:
    positions = np.zeros((3, 3), dtype=np.float32)
    assert mesh(positions=positions).positions is positions
    transform = np.zeros((3, 4), dtype=np.float32)
    assert Instance("i", 0, transform).transform is transform


def test_strided_arrays_become_contiguous() -> None:
    positions = np.arange(24, dtype=np.float32).reshape(3, 8)[:, :3]
    made = mesh(positions=positions)
    assert made.positions.flags.c_contiguous
    assert np.array_equal(made.positions, positions)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: mesh(positions=np.zeros((3, 2))), "mesh 'Cube': positions: has shape (3, 2), must be (n, 3)"),
        (lambda: mesh(positions=np.zeros(3)), "mesh 'Cube': positions: has shape (3,), must be (n, 3)"),
        (lambda: mesh(positions="abc"), "mesh 'Cube': positions: is not an array of numbers"),
        (lambda: mesh(positions=[[0, 1], [0]]), "mesh 'Cube': positions: is not an array of numbers"),
        (lambda: mesh(triangles=[[0, 1, 2.5]]), "mesh 'Cube': triangles: is not an array of whole numbers"),
        (lambda: mesh(triangles=[[0, 1, 2**32 + 1]]), "mesh 'Cube': triangles: 4294967297 does not fit 32 bits"),
        (
            lambda: mesh(triangles=np.array([[0, 1, 2**32 - 1]], dtype=np.uint32)),
            "mesh 'Cube': triangles: 4294967295 does not fit 32 bits",
        ),
        (
            lambda: mesh(corner_normals=np.zeros((2, 3, 3))),
            "mesh 'Cube': corner_normals: has shape (2, 3, 3), must be (1, 3, 3)",
        ),
        (lambda: mesh(uvs={"UV": np.zeros((1, 2))}), "mesh 'Cube': uvs 'UV': has shape (1, 2), must be (1, 3, 2)"),
        (lambda: mesh(material_index=[0, 0]), "mesh 'Cube': material_index: has shape (2,), must be (1,)"),
        (lambda: Spheres("S", np.zeros((2, 3)), [1]), "spheres 'S': radii: has shape (1,), must be (2,)"),
        (lambda: Instance("I", 0, np.eye(4)), "instance 'I': transform: has shape (4, 4), must be (3, 4)"),
        (lambda: SunLight("L", np.eye(3), (1, 1, 1)), "sun light 'L': transform: has shape (3, 3), must be (3, 4)"),
    ],
)
def test_wrong_shapes_and_types_are_named(make: Callable[[], object], message: str) -> None:
    with pytest.raises(SceneError) as error:
        make()
    assert str(error.value) == message


def with_mesh(scene: Scene, **fields: Any) -> None:
    for name, value in fields.items():
        setattr(scene.geometries[0], name, value)


def with_material(scene: Scene, *lobes: Lobe, **fields: Any) -> None:
    scene.materials[0] = Material("grey", lobes, **fields)


def diffuse(**fields: Any) -> Lobe:
    return Lobe(LobeKind.DIFFUSE, **fields)


def with_camera(scene: Scene, **fields: Any) -> None:
    for name, value in fields.items():
        setattr(scene.camera, name, value)


def moved(position: tuple[int, int], value: float) -> Any:
    array = np.eye(3, 4, dtype=np.float32)
    array[position] = value
    return array


SQUASHED = moved((2, 2), 0)

FAULTS: list[tuple[Callable[[Scene], object], str]] = [
    (
        lambda s: with_mesh(s, positions=np.full((8, 3), NAN)),
        "mesh 'room': positions: vertex 0 is (nan, nan, nan), must be",
    ),
    (
        lambda s: s.geometries[0].positions.__setitem__((5, 1), np.inf),  # type: ignore[union-attr]
        "mesh 'room': positions: vertex 5 is (1, inf, 1), must be finite",
    ),
    (
        lambda s: s.geometries[0].positions.__setitem__((5, 1), -3e38),  # type: ignore[union-attr]
        "mesh 'room': positions: vertex 5 is (1, -3e+38, 1), must be within 1e+18",
    ),
    (
        lambda s: s.geometries[0].triangles.__setitem__((3, 2), 8),  # type: ignore[union-attr]
        "mesh 'room': triangles: triangle 3 has index 8, but there are 8 vertices",
    ),
    (
        lambda s: s.geometries[0].triangles.__setitem__((4, 0), -1),  # type: ignore[union-attr]
        "mesh 'room': triangles: triangle 4 has index -1, but there are 8 vertices",
    ),
    (lambda s: with_mesh(s, triangles=np.zeros((2, 4))), "mesh 'room': triangles: is not an array of whole numbers"),
    (
        lambda s: with_mesh(s, corner_normals=np.full((10, 3, 3), NAN)),
        "mesh 'room': corner_normals: triangle 0 is (nan, nan, nan,",
    ),
    (
        lambda s: with_mesh(s, uvs={"UV": np.full((10, 3, 2), np.inf)}),
        "mesh 'room': uvs 'UV': triangle 0 is (inf, inf, inf,",
    ),
    (
        lambda s: with_mesh(s, material_index=[0] * 9 + [-2]),
        "mesh 'room': material_index: triangle 9 has slot -2, must be from 0 to 65535",
    ),
    (
        lambda s: with_mesh(s, material_index=[0] * 9 + [65536]),
        "mesh 'room': material_index: triangle 9 has slot 65536, must be from 0 to 65535",
    ),
    (
        lambda s: s.geometries.append(Spheres("balls", np.zeros((2, 3)), [1, -0.5])),  # type: ignore[arg-type]
        "spheres 'balls': radii: sphere 1 is -0.5, must not be negative",
    ),
    (
        lambda s: s.geometries.append(Spheres("balls", [[0, NAN, 0]], [1])),  # type: ignore[arg-type]
        "spheres 'balls': centers: sphere 0 is (0, nan, 0), must be finite",
    ),
    (
        lambda s: s.geometries.append(Spheres("balls", [[0, 0, 0]], [NAN])),  # type: ignore[arg-type]
        "spheres 'balls': radii: sphere 0 is (nan), must be finite",
    ),
    (lambda s: s.instances.append(Instance("I", 1)), "instance 'I': geometry 1, but there are 1 geometries"),
    (lambda s: s.instances.append(Instance("I", -1)), "instance 'I': geometry -1, but there are 1 geometries"),
    (
        lambda s: s.instances.append(Instance("I", 0, materials=(0, 3))),
        "instance 'I': material 3, but there are 1 materials",
    ),
    (
        lambda s: s.instances.append(Instance("I", 0, materials=())),
        "instance 'I': materials is empty, must name at least",
    ),
    (
        lambda s: s.instances.append(Instance("I", 0, SQUASHED)),
        "instance 'I': transform is singular (determinant 0)",
    ),
    (
        lambda s: s.instances.append(Instance("I", 0, moved((0, 3), NAN))),
        "instance 'I': transform has nan, must be finite",
    ),
    (
        lambda s: s.instances.append(Instance("I", 0, [[1, 2, 3, 0], [4, 5, 6, 0], [7, 8, 9, 0]])),  # type: ignore[arg-type]
        "instance 'I': transform is singular (determinant ",
    ),
    (
        lambda s: s.instances.append(Instance("I", 0, np.eye(3, 4) * 1e20)),  # type: ignore[arg-type]
        "instance 'I': transform scales too far (determinant 1e+60)",
    ),
    (lambda s: with_material(s, emission=(1, -1, 0)), "material 'grey': emission -1 must be finite and not negative"),
    (lambda s: with_material(s, emission=(1, NAN, 0)), "material 'grey': emission nan must be finite and not negative"),
    (
        lambda s: with_material(s, diffuse(weight=(0.5, -0.1, 0))),
        "material 'grey': lobe 0 (DIFFUSE): weight -0.1 must be finite and not negative",
    ),
    (
        lambda s: with_material(s, diffuse(), diffuse(weight=(0, 0, NAN))),
        "material 'grey': lobe 1 (DIFFUSE): weight nan must be finite and not negative",
    ),
    (
        lambda s: with_material(s, diffuse(roughness=1.5)),
        "material 'grey': lobe 0 (DIFFUSE): roughness 1.5 must be from 0 to 1",
    ),
    (lambda s: with_material(s, diffuse(ior=0)), "material 'grey': lobe 0 (DIFFUSE): ior 0 must be above 0"),
    (lambda s: with_material(s, diffuse(f82=(1, 1, -2))), "material 'grey': lobe 0 (DIFFUSE): f82 -2 must be"),
    (
        lambda s: with_material(s, diffuse(layered_under=1)),
        "material 'grey': lobe 0: layered_under 1 names no other lobe of 1",
    ),
    (
        lambda s: with_material(s, diffuse(layered_under=0)),
        "material 'grey': lobe 0: layered_under 0 names no other lobe of 1",
    ),
    (
        lambda s: with_material(s, diffuse(layered_under=1), diffuse(layered_under=0)),
        "material 'grey': lobe 0: layered_under 1 goes round in a circle",
    ),
    (
        lambda s: with_material(s, *[diffuse(weight=(0, 0, 0))] * 128),
        "material 'grey': has 128 lobes, must be at most 127",
    ),
    (
        lambda s: s.lights.append(PointLight("L", (0, NAN, 0), (1, 1, 1))),
        "point light 'L': position nan must be finite",
    ),
    (
        lambda s: s.lights.append(PointLight("L", (0, 0, 0), (1, -1, 1))),
        "point light 'L': power -1 must be finite and not negative",
    ),
    (
        lambda s: s.lights.append(PointLight("L", (0, 0, 0), (1, 1, 1), -0.1)),
        "point light 'L': radius -0.1 must be finite and not negative",
    ),
    (
        lambda s: s.lights.append(SpotLight("L", np.zeros((3, 4)), (1, 1, 1))),  # type: ignore[arg-type]
        "spot light 'L': transform is singular (its z axis has no length)",
    ),
    (
        lambda s: s.lights.append(SpotLight("L", np.eye(3, 4), (1, 1, 1), 0.0)),  # type: ignore[arg-type]
        "spot light 'L': spot_size 0 must be above 0 and at most pi",
    ),
    (
        lambda s: s.lights.append(SpotLight("L", np.eye(3, 4), (1, 1, 1), 1.0, 1.5)),  # type: ignore[arg-type]
        "spot light 'L': blend 1.5 must be from 0 to 1",
    ),
    (
        lambda s: s.lights.append(SunLight("L", np.eye(3, 4), (NAN, 1, 1))),  # type: ignore[arg-type]
        "sun light 'L': irradiance nan must be finite and not negative",
    ),
    (
        lambda s: s.lights.append(SunLight("L", np.eye(3, 4), (1, 1, 1), 4.0)),  # type: ignore[arg-type]
        "sun light 'L': angle 4 must be from 0 to 3.14159",
    ),
    (
        lambda s: s.lights.append(AreaLight("L", np.eye(3, 4), (1, 1, 1), spread=0)),  # type: ignore[arg-type]
        "area light 'L': spread 0 must be above 0 and at most pi",
    ),
    (
        lambda s: s.lights.append(AreaLight("L", np.eye(3, 4), (1, 1, 1), (1, -1))),  # type: ignore[arg-type]
        "area light 'L': size -1 must be finite and not negative",
    ),
    (
        lambda s: s.lights.append(AreaLight("L", moved((1, 3), np.inf), (1, 1, 1))),
        "area light 'L': transform has inf, must be finite",
    ),
    (
        lambda s: setattr(s, "world", World("sky", (1, 1, 1), np.full((2, 3, 3), -0.5))),
        r"world 'sky': image pixel (0, 0) is negative or not finite: [-0.5, -0.5, -0.5]",
    ),
    (
        lambda s: setattr(s, "world", World("sky", (1, 1, 1), np.zeros((0, 3, 3)))),
        "world 'sky': image has no pixels",
    ),
    (
        lambda s: setattr(s, "world", World("sky", (1, 1, 1), np.ones((2, 3, 3)), 2 * np.eye(3))),
        "world 'sky': rotation is none",
    ),
    (
        lambda s: setattr(s, "world", World("sky", (NAN, 0, 0))),
        "world 'sky': radiance nan must be finite and not negative",
    ),
    (lambda s: setattr(s, "camera", None), "scene: has no camera"),
    (lambda s: with_camera(s, half_width=0.0), "camera 'Camera': half_width 0 must be above 0"),
    (lambda s: with_camera(s, half_height=NAN), "camera 'Camera': half_height nan must be above 0"),
    (lambda s: with_camera(s, shift=(0, NAN)), "camera 'Camera': shift nan must be finite"),
    (lambda s: with_camera(s, clip_start=-1), "camera 'Camera': clip_start -1 must be finite and not negative"),
    (
        lambda s: with_camera(s, clip_start=2, clip_end=2),
        "camera 'Camera': clip_end 2 must be above clip_start 2",
    ),
    (lambda s: with_camera(s, clip_end=NAN), "camera 'Camera': clip_end nan must be above clip_start 0"),
    (lambda s: with_camera(s, aperture_radius=-1), "camera 'Camera': aperture_radius -1 must be finite and not"),
    (
        lambda s: with_camera(s, aperture_radius=1, focus_distance=0),
        "camera 'Camera': focus_distance 0 must be above 0",
    ),
    (lambda s: with_camera(s, transform=SQUASHED), "camera 'Camera': transform is singular (determinant 0)"),
    (lambda s: setattr(s, "film", Film(0, 10)), "film: width 0 must be from 1 to 65536 pixels"),
    (lambda s: setattr(s, "film", Film(10, 70000)), "film: height 70000 must be from 1 to 65536 pixels"),
    (lambda s: setattr(s, "film", Film(10, 10, (0, 0, 0, 5))), "film: window of 0 x 5 pixels is empty"),
    (
        lambda s: setattr(s, "film", Film(10, 10, (6, 0, 5, 5))),
        "film: window 5 x 5 at (6, 0) reaches beyond the 10 x 10 pixels",
    ),
    (
        lambda s: setattr(s, "film", Film(10, 10, (0, -1, 5, 5))),
        "film: window 5 x 5 at (0, -1) reaches beyond the 10 x 10 pixels",
    ),
]


@pytest.mark.parametrize(("spoil", "message"), FAULTS, ids=[message[:60] for _, message in FAULTS])
def test_a_fault_is_named(spoil: Callable[[Scene], object], message: str) -> None:
    scene = room()
    spoil(scene)
    with pytest.raises(SceneError, match="^" + re.escape(message)):
        scene.validate()


def test_good_scenes_pass() -> None:
    assert room().validate() == []
    assert everything().validate() == []


def test_an_orthographic_camera_may_see_behind_itself() -> None:
    scene = room()
    with_camera(scene, projection=Projection.ORTHOGRAPHIC, clip_start=-5.0)
    assert scene.validate() == []


@pytest.mark.parametrize("scale", [(1, 1, 1e-6), (1e-9, 1e-9, 1e-9), (1e9, 1e9, 1e9), (-1, 1, 1), (1e-8, 1, 1e8)])
def test_extreme_but_sound_transforms_pass(scale: tuple[float, float, float]) -> None:
    scene = room()
    scene.instances[0].transform = np.diag([*scale, 1.0])[:3].astype(np.float32)
    assert scene.validate() == []


def test_angles_may_be_pi_as_float32_rounds_it() -> None:
    scene = room()
    pi = float(np.float32(np.pi))
    assert pi > np.pi
    scene.lights = [
        AreaLight("L", np.eye(3, 4), (1, 1, 1), spread=pi),  # type: ignore[arg-type]
        SpotLight("L", np.eye(3, 4), (1, 1, 1), pi),  # type: ignore[arg-type]
        SunLight("L", np.eye(3, 4), (1, 1, 1), pi),  # type: ignore[arg-type]
    ]
    assert scene.validate() == []


def test_no_light_is_a_warning() -> None:
    scene = replace(room(), lights=[])
    assert scene.validate() == ["scene: nothing emits light, the picture will be black"]
    scene.lights = [PointLight("dark", (0, 0, 0), (0, 0, 0))]
    assert len(scene.validate()) == 1
    scene.materials = [Material("lamp", emission=(0, 0, 1))]
    assert scene.validate() == []
    scene.instances = []
    assert len(scene.validate()) == 1
    scene.world = World(radiance=(0.1, 0, 0))
    assert scene.validate() == []


def test_a_light_without_area_is_a_warning() -> None:
    scene = room()
    scene.lights.append(AreaLight("thin", np.eye(3, 4), (1, 1, 1), (1.0, 0.0)))  # type: ignore[arg-type]
    scene.lights.append(AreaLight("flat", moved((1, 1), 0), (1, 1, 1)))
    assert scene.validate() == [
        "area light 'thin': size (1, 0) has no area, it emits nothing",
        "area light 'flat': size (1, 1) has no area, it emits nothing",
    ]


def test_reflecting_more_than_comes_in_is_a_warning() -> None:
    scene = room()
    with_material(scene, diffuse(weight=(0.5, 0.75, 0.1)), diffuse(weight=(0.5, 0.75, 0.1)))
    assert scene.validate() == [
        "material 'grey': its lobes' weights add up to 1.5: it reflects more light than it receives"
    ]
    with_material(scene, Lobe(LobeKind.REFLECTION, (1, 1, 1), f0=(1, 2, 1)))
    assert len(scene.validate()) == 1
    with_material(scene, Lobe(LobeKind.REFLECTION), diffuse(layered_under=0))
    assert scene.validate() == []


def test_a_million_triangles_are_checked_in_half_a_second() -> None:
    random = np.random.default_rng(0)
    count = 1_000_000
    big = Mesh(
        "big",
        random.random((count // 2, 3), dtype=np.float32),
        random.integers(0, count // 2, (count, 3), dtype=np.int32),
        random.random((count, 3, 3), dtype=np.float32),
        {"UVMap": random.random((count, 3, 2), dtype=np.float32)},
        np.zeros(count, dtype=np.int32),
    )
    scene = replace(room(), geometries=[big])
    started = time.process_time()
    assert scene.validate() == []
    assert time.process_time() - started < 0.5
