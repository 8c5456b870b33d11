"""Bad input is refused with its name and value, and odd but legal input renders."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes_for_tests import Builder, ball, grey, looking, render, settings, sphere, square, transform

from vlp_bpt import Error, Renderer, RenderSettings, Scene, SceneError, SettingsError
from vlp_bpt.images import read_image
from vlp_bpt.scene import (
    AreaLight,
    Camera,
    Film,
    Fresnel,
    Instance,
    Lobe,
    LobeKind,
    Material,
    Mesh,
    PointLight,
    Spheres,
    SpotLight,
    SunLight,
    World,
)
from vlp_bpt.snapshot import Snapshot, load_snapshot, save_snapshot

NAN, INF = math.nan, math.inf


def plain() -> Scene:
    """Every kind of thing once, and it renders."""
    builder = Builder(8, looking((0, -4, 2), (0, 0, 0.5), 0.4))
    scene = builder.add(square(4), grey(0.5)).add(sphere((0, 0, 1), 0.4), grey(0.6, 1.0)).scene
    scene.lights = [
        PointLight("bulb", (1, 0, 2), (10, 10, 10), 0.1),
        SpotLight("spot", transform((0, 0, 3)), (10, 10, 10)),
        SunLight("sun", transform(), (1, 1, 1), 0.1),
        AreaLight("panel", transform((-1, 0, 2)), (5, 5, 5)),
    ]
    scene.world = World("sky", (0.1, 0.1, 0.1))
    return scene


def test_the_plain_scene_renders() -> None:
    assert render(plain(), settings(samples=2)).min() > 0


def mesh(scene: Scene) -> Mesh:
    geometry = scene.geometries[0]
    assert isinstance(geometry, Mesh)
    return geometry


def spheres(scene: Scene) -> Spheres:
    geometry = scene.geometries[1]
    assert isinstance(geometry, Spheres)
    return geometry


def put(target: Callable[[Scene], Any], name: str, value: Any) -> Callable[[Scene], None]:
    return lambda scene: setattr(target(scene), name, value)


def light(i: int) -> Callable[[Scene], Any]:
    return lambda scene: scene.lights[i]


def lobe(**values: Any) -> Callable[[Scene], None]:
    """The first material's lobe with other values."""

    def change(scene: Scene) -> None:
        scene.materials[0] = Material("paint", (Lobe(**({"kind": LobeKind.DIFFUSE} | values)),))

    return change


def geometry(change: Callable[[Mesh], None]) -> Callable[[Scene], None]:
    return lambda scene: change(mesh(scene))


def first_vertex(value: float) -> Callable[[Scene], None]:
    return lambda scene: mesh(scene).positions.__setitem__((0, 1), value)


def nowhere(scale: Any) -> Callable[[Scene], None]:
    return put(lambda s: s.instances[0], "transform", transform(scale=scale))


def camera(**values: Any) -> Callable[[Scene], None]:
    def change(scene: Scene) -> None:
        assert scene.camera is not None
        scene.camera = replace(scene.camera, **values)

    return change


# What is changed in the plain scene, and what the message must name
REFUSED: dict[str, tuple[Callable[[Scene], None], tuple[str, ...]]] = {
    "no camera": (put(lambda s: s, "camera", None), ("camera",)),
    "NaN vertex": (first_vertex(NAN), ("mesh 'square'", "vertex 0", "nan")),
    "infinite vertex": (first_vertex(INF), ("mesh 'square'", "vertex 0", "inf")),
    "index beyond": (put(mesh, "triangles", [[0, 1, 4]]), ("mesh 'square'", "triangle 0", "4")),
    "negative index": (put(mesh, "triangles", [[0, 1, -1]]), ("mesh 'square'", "triangle 0", "-1")),
    "index too large": (put(mesh, "triangles", [[0, 1, 2**40]]), ("mesh 'square'", str(2**40))),
    "pairs for triples": (put(mesh, "positions", np.zeros((4, 2))), ("mesh 'square'", "positions", "(4, 2)")),
    "words": (put(mesh, "positions", [["a", "b", "c"]]), ("mesh 'square'", "positions")),
    "fractions as indices": (put(mesh, "triangles", [[0.5, 1, 2]]), ("mesh 'square'", "triangles")),
    "short normals": (put(mesh, "corner_normals", np.zeros((1, 3, 3))), ("mesh 'square'", "(1, 3, 3)")),
    "NaN normals": (put(mesh, "corner_normals", np.full((2, 3, 3), NAN)), ("mesh 'square'", "corner_normals", "nan")),
    "NaN uvs": (put(mesh, "uvs", {"map": np.full((2, 3, 2), NAN)}), ("mesh 'square'", "map", "nan")),
    "slots too short": (put(mesh, "material_index", [0]), ("mesh 'square'", "material_index")),
    "negative slot": (put(mesh, "material_index", [0, -1]), ("mesh 'square'", "triangle 1", "-1")),
    "slot too large": (put(mesh, "material_index", [0, 65536]), ("mesh 'square'", "triangle 1", "65536")),
    "NaN center": (put(spheres, "centers", [[0, NAN, 0]]), ("spheres 'sphere'", "sphere 0", "nan")),
    "negative radius": (put(spheres, "radii", [-2.0]), ("spheres 'sphere'", "sphere 0", "-2")),
    "two radii": (put(spheres, "radii", [1.0, 1.0]), ("spheres 'sphere'", "radii")),
    "flat instance": (nowhere((1, 0, 1)), ("instance 'square 0'", "singular")),
    "NaN instance": (nowhere((1, NAN, 1)), ("instance 'square 0'", "nan")),
    "no such geometry": (put(lambda s: s.instances[0], "geometry", 2), ("instance 'square 0'", "geometry 2")),
    "no such material": (put(lambda s: s.instances[0], "materials", (7,)), ("instance 'square 0'", "material 7")),
    "no material": (put(lambda s: s.instances[0], "materials", ()), ("instance 'square 0'", "materials")),
    "negative weight": (lobe(weight=(-1, 0, 0)), ("material 'paint'", "weight", "-1")),
    "NaN weight": (lobe(weight=(NAN, 0, 0)), ("material 'paint'", "weight", "nan")),
    "roughness": (lobe(roughness=1.5), ("material 'paint'", "roughness", "1.5")),
    "ior": (lobe(kind=LobeKind.DIELECTRIC, ior=0.0), ("material 'paint'", "ior", "0")),
    "layered under nothing": (lobe(layered_under=3), ("material 'paint'", "layered_under", "3")),
    "layered under itself": (lobe(layered_under=0), ("material 'paint'", "layered_under", "0")),
    "Fresnel term": (lobe(fresnel=99), ("material 'paint'", "99")),
    "NaN light": (put(light(0), "position", (0, NAN, 0)), ("point light 'bulb'", "position", "nan")),
    "negative power": (put(light(0), "power", (-1, 0, 0)), ("point light 'bulb'", "power", "-1")),
    "infinite power": (put(light(0), "power", (INF, 0, 0)), ("point light 'bulb'", "power", "inf")),
    "light's radius": (put(light(0), "radius", -1.0), ("point light 'bulb'", "radius", "-1")),
    "spot's angle": (put(light(1), "spot_size", 4.0), ("spot light 'spot'", "spot_size", "4")),
    "spot's blend": (put(light(1), "blend", 2.0), ("spot light 'spot'", "blend", "2")),
    "spot's axis": (put(light(1), "transform", transform(scale=(1, 1, 0))), ("spot light 'spot'", "singular")),
    "sun's axis": (put(light(2), "transform", transform(scale=(1, 1, 0))), ("sun light 'sun'", "singular")),
    "sun's angle": (put(light(2), "angle", NAN), ("sun light 'sun'", "angle", "nan")),
    "panel's size": (put(light(3), "size", (-1.0, 1.0)), ("area light 'panel'", "size", "-1")),
    "panel's spread": (put(light(3), "spread", 0.0), ("area light 'panel'", "spread", "0")),
    "sky": (put(lambda s: s.world, "radiance", (0, NAN, 0)), ("world 'sky'", "nan")),
    "camera's transform": (camera(transform=transform(scale=(1, 1, 0))), ("camera 'Camera'", "singular")),
    "camera's view": (camera(half_width=0.0), ("camera 'Camera'", "half_width", "0")),
    "camera's clips": (camera(clip_start=2.0, clip_end=1.0), ("camera 'Camera'", "clip_end", "1")),
    "camera's aperture": (camera(aperture_radius=-1.0), ("camera 'Camera'", "aperture_radius", "-1")),
    "no film": (put(lambda s: s, "film", Film(0, 8)), ("film", "width", "0")),
    "window beyond": (put(lambda s: s, "film", Film(8, 8, (4, 4, 5, 4))), ("film", "window")),
    "no window": (put(lambda s: s, "film", Film(8, 8, (4, 4, 0, 4))), ("film", "window")),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_refused_by_name_and_value(case: str) -> None:
    scene = plain()
    change, words = REFUSED[case]
    with pytest.raises(SceneError) as error:  # building a datablock may already refuse it
        change(scene)
        Renderer(scene, settings())
    message = str(error.value)
    assert all(word in message for word in words), message


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("samples", 0), ("samples", 1.5), ("samples", "many"), ("eye_path_length", 0), ("eye_path_length", 65),
        ("light_path_length", -1), ("light_path_length", 65), ("light_paths", -1), ("vlp_connections", -1),
        ("light_samples", 1025), ("filter_width", 0.0), ("filter_width", NAN), ("time_limit", -1.0), ("threads", -1),
        ("seed", 2**32), ("mode", "FASTEST"), ("weighting", "MEDIAN"), ("filter", "SHARP"), ("device", "ABACUS"),
        ("samples", None), ("samples", True),
    ],
)  # fmt: skip
def test_settings_are_refused_by_name_and_value(name: str, value: Any) -> None:
    options = settings()
    setattr(options, name, value)
    with pytest.raises(SettingsError) as error:
        Renderer(plain(), options)
    assert name in str(error.value) and repr(value) in str(error.value)


def test_unknown_setting_names_the_closest() -> None:
    with pytest.raises(SettingsError, match="light_paths"):
        RenderSettings.from_dict({"light_path": 3})


def test_too_many_light_vertices() -> None:
    with pytest.raises(Error, match="light_paths"):
        Renderer(plain(), settings(light_paths=2**26, light_path_length=64))


# Odd, but legal


def empty_mesh(scene: Scene) -> None:
    scene.geometries.append(Mesh("empty", np.zeros((0, 3)), np.zeros((0, 3), np.int32)))
    scene.instances.append(Instance("empty", 2))


def no_spheres(scene: Scene) -> None:
    scene.geometries[1] = Spheres("none", np.zeros((0, 3)), np.zeros(0))


def points_without_triangles(scene: Scene) -> None:
    mesh(scene).triangles = np.zeros((0, 3), np.int32)


def slivers(scene: Scene) -> None:
    scene.geometries.append(
        Mesh("slivers", [[0, 0, 1], [1, 0, 1], [2, 0, 1], [0, 0, 1]], [[0, 1, 2], [0, 3, 3], [1, 1, 1]])
    )
    scene.materials.append(grey(0.5, 2.0))
    scene.instances.append(Instance("slivers", 2, materials=(2,)))


def more_slots_than_materials(scene: Scene) -> None:
    mesh(scene).material_index = np.array([0, 9], np.int32)


def no_bulk(scene: Scene) -> None:
    scene.geometries[1] = Spheres("dot", [[0, 0, 1]], [0.0])


def zero_normals(scene: Scene) -> None:
    mesh(scene).corner_normals = np.zeros((2, 3, 3), np.float32)


def panel_without_area(scene: Scene) -> None:
    light(3)(scene).size = (0.0, 1.0)


def dark_lights(scene: Scene) -> None:
    for lamp in scene.lights:
        setattr(lamp, "irradiance" if isinstance(lamp, SunLight) else "power", (0.0, 0.0, 0.0))


def bare_material(scene: Scene) -> None:
    scene.materials[0] = Material("nothing")


def far_away(scene: Scene) -> None:
    scene.instances[1].transform = transform((1e18, -1e18, 1e18), (1e6, 1e6, 1e6))


def beyond_squares(scene: Scene) -> None:
    """Coordinates whose squares overflow single precision."""
    scene.instances[1].transform = transform((3e38, 0, 0), (1, 1, 1))


def tiny(scene: Scene) -> None:
    scene.instances[0].transform = transform(scale=(1e-11, 1e-11, 1e-11))


def bright(scene: Scene) -> None:
    scene.world = World(radiance=(1e30, 1e30, 1e30))


def camera_in_the_ground(scene: Scene) -> None:
    scene.camera = Camera(transform=transform())


def many_lobes(scene: Scene) -> None:
    scene.materials[0] = Material("many", (Lobe(LobeKind.DIFFUSE, (0.007,) * 3),) * 127)


ODD = [
    empty_mesh, no_spheres, points_without_triangles, slivers, more_slots_than_materials, no_bulk, zero_normals,
    panel_without_area, dark_lights, bare_material, far_away, beyond_squares, tiny, bright,
    camera_in_the_ground, many_lobes,
]  # fmt: skip


@pytest.mark.parametrize("change", ODD, ids=lambda f: f.__name__)
def test_odd_scenes_render(change: Callable[[Scene], None]) -> None:
    scene = plain()
    change(scene)
    renderer = Renderer(scene, settings(samples=2))
    assert renderer.iterate(2) == 2
    picture = renderer.read()
    assert np.isfinite(picture).all()
    assert (picture >= 0).all()


def test_nothing_at_all_is_black() -> None:
    scene = Scene(film=Film(4, 4))
    assert (render(scene, settings(samples=1)) == 0).all()


def test_no_lights_are_black() -> None:
    scene = Builder(4, looking((0, -4, 2), (0, 0, 0), 0.4)).add(square(4), grey(0.5)).scene
    assert (render(scene, settings(samples=1)) == 0).all()


def test_bright_light_stays_bright() -> None:
    """The film's sums end at 2^63; what is brighter stays there."""
    scene = Builder(4, looking((0, -4, 2), (0, 0, 0), 0.4)).scene
    for radiance in (1e10, 1e18, 1e30):
        scene.world = World(radiance=(radiance,) * 3)
        picture = render(scene, settings(samples=3))
        np.testing.assert_allclose(picture, min(radiance, 2.0**63 / 3), rtol=1e-6)


def test_a_ball_of_any_size() -> None:
    """Sizes from a micrometre to a light-second: the picture is the same, as nothing in it has a length."""
    pictures = []
    for size in (1e-6, 1.0, 3e8):
        builder = Builder(8, looking((0, -3 * size, size), (0, 0, 0), 0.4))
        scene = builder.add(ball(smooth=False), grey(1.0), transform(scale=(size, size, size))).scene
        scene.world = World(radiance=(1, 1, 1))
        pictures.append(render(scene, settings(samples=4, light_samples=0, vlp_connections=0, splats=False)))
    for picture in pictures:
        np.testing.assert_allclose(picture, 1.0, rtol=1e-5)


def test_fresnel_of_every_kind_renders() -> None:
    for kind in LobeKind:
        for term in Fresnel:
            scene = plain()
            scene.materials[0] = Material("odd", (Lobe(kind, (0.9,) * 3, 0.3, 1.3, term, (0.5,) * 3, (0.4,) * 3),))
            assert np.isfinite(render(scene, settings(samples=1))).all()


# Files


@pytest.mark.parametrize("read", [load_snapshot, read_image])
def test_absent_and_foreign_files_are_named(read: Callable[[Path], Any], tmp_path: Path) -> None:
    contents = {
        "empty": b"",
        "text": b"no picture",
        "zip": b"PK\3\4" + b"\0" * 99,
        "exr": b"\x76\x2f\x31\1" + b"\xff" * 99,
    }
    files = [tmp_path / "absent.exr", tmp_path]
    for name, content in contents.items():
        files.append(tmp_path / f"{name}.exr")
        files[-1].write_bytes(content)
    for file in files:
        with pytest.raises(Error, match=file.name):
            read(file)


def test_damaged_snapshots_are_named(tmp_path: Path) -> None:
    """Cut short or with bytes turned over: an error that names the file, or a scene that passes validation or not."""
    whole, damaged = tmp_path / "scene.vlp.npz", tmp_path / "damaged.vlp.npz"
    save_snapshot(whole, Snapshot(plain(), settings()))
    content = whole.read_bytes()
    rng = np.random.default_rng(1)
    refused = 0
    for trial in range(120):
        if trial % 2 == 0:
            broken = content[: rng.integers(len(content))]
        else:
            bytes_ = np.frombuffer(content, np.uint8).copy()
            bytes_[rng.integers(len(bytes_), size=3)] ^= np.uint8(rng.integers(1, 256))
            broken = bytes_.tobytes()
        damaged.write_bytes(broken)
        try:
            load_snapshot(damaged).scene.validate()
        except Error as error:
            refused += 1
            assert "'" in str(error)  # the file, or the datablock whose numbers were damaged
    assert refused > 60
