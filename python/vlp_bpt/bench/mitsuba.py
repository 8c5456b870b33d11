"""Mitsuba as a second unbiased renderer to compare with: our scenes in its terms, rendered by its path tracer.

What has no exact equivalent raises `NotConvertible`. How the two are brought together:

- **Lamps** neither block nor reflect light here. Where they have an extent they become shapes that let light through
  (`null`), which only Mitsuba's `volpath` integrator looks through; without such shapes `path` renders.
- **Lamps that the camera does not see**: Mitsuba hides all emitters from it or none.
- **A wide sun** is a disc FAR scene radii away: directions to it differ by 1 / FAR over the scene.
- **Emissive meshes** shine on both sides here and on one there: they get a twin with its back to them, BACK of their
  size away. **Emissive spheres** shine outside alone, so nothing may be inside one.
- **Rough lobes**: Mitsuba multiplies the shadowing of both directions, where Cycles and this renderer correlate them by
  height. They differ by the product of Smith's two Lambdas, below 3e-3 for MOST_ALPHA and directions within 60 degrees
  of the normal; wider lobes raise.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cache
from math import atan, degrees, isclose, pi, sin, tan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vlp_bpt.errors import Error
from vlp_bpt.scene import (
    AreaLight,
    Camera,
    Film,
    Fresnel,
    Instance,
    Light,
    Lobe,
    LobeKind,
    Material,
    Mesh,
    Projection,
    Rgb,
    Scene,
    Spheres,
    SpotLight,
    SunLight,
    Visibility,
)

Doubles = NDArray[np.float64]

FAR = 1e4  # radii of the scene
BACK = 1e-4  # of a mesh's extent
SMOOTH = 0.0038  # Blender's roughness below which a lobe is a delta distribution
MOST_ALPHA = 0.25
PASS = 1 << 26  # most samples of one launch: it cannot be interrupted


class NotConvertible(Error):
    """Mitsuba has no exact equivalent: names the datablock and what about it."""


def variant() -> str:
    """Mitsuba's fastest variant that works here.

    LLVM 14 and 15 abort on processors with AVX-512. Debian's later ones are told by their names: from LLVM 18 on
    libLLVM.so.18.1, before that libLLVM-15.so.1.
    """
    found = sorted(Path("/usr/lib").glob("*/libLLVM.so.*"))
    if found:
        os.environ.setdefault("DRJIT_LIBLLVM_PATH", str(found[-1]))
    return "llvm_ad_rgb" if "DRJIT_LIBLLVM_PATH" in os.environ else "scalar_rgb"


@cache
def module() -> Any:
    """The mitsuba module with its variant chosen; raises ImportError where it is not installed."""
    import mitsuba

    mitsuba.set_variant(variant())
    return mitsuba


def render(scene: Scene, *, samples: int, scatterings: int, seed: int = 0) -> NDArray[np.float32]:
    """(h, w, 3) linear RGB, top row first, under a box filter of one pixel; `scatterings` as in bench/cycles.py."""
    loaded = load(scene, scatterings)
    film = scene.film
    most = max(1, PASS // (film.width * film.height))
    total = np.zeros((film.height, film.width, 3))
    for i, first in enumerate(range(0, samples, most)):
        count = min(most, samples - first)
        total += count * launch(loaded, count, (seed << 12) + i)
    return (total / samples).astype(np.float32)


def load(scene: Scene, scatterings: int) -> Any:
    """The scene as Mitsuba's; raises NotConvertible."""
    return module().load_dict(convert(scene, scatterings))


def launch(loaded: Any, samples: int, seed: int) -> Doubles:
    """(h, w, 3) of one launch of `samples` a pixel."""
    return np.asarray(module().render(loaded, spp=samples, seed=seed), np.float64)[..., :3]


def convert(scene: Scene, scatterings: int) -> dict[str, Any]:
    """The scene for `mitsuba.load_dict`; raises NotConvertible."""
    mi = module()
    if scene.camera is None:
        raise NotConvertible("the scene has no camera")
    if scene.world.image is not None:
        raise NotConvertible(f"world '{scene.world.name}' has an image")
    shown = {bool(light.visibility & Visibility.CAMERA): light.name for light in scene.lights if _has_extent(light)}
    glows = any(any(scene.materials[m].emission) for i in scene.instances for m in i.materials)
    if False in shown and (True in shown or glows or any(scene.world.radiance)):
        raise NotConvertible(f"light '{shown[False]}' is hidden from the camera, but other light is not")
    shapes = [shape for instance in scene.instances for shape in _shapes(scene, instance)]
    lamps = [_lamp(scene, light) for light in scene.lights]
    see_through = any(map(_has_extent, scene.lights)) or any(
        lobe.kind == LobeKind.TRANSPARENT for material in scene.materials for lobe in material.lobes
    )
    result: dict[str, Any] = {
        "type": "scene",
        "integrator": {
            "type": "volpath" if see_through else "path",
            "max_depth": scatterings + 1,
            "hide_emitters": False in shown,
        },
        "sensor": _camera(mi, scene.camera, scene.film),
        **{f"shape {i}": shape for i, shape in enumerate(shapes)},
        **{f"lamp {i}": lamp for i, lamp in enumerate(lamps)},
    }
    if any(scene.world.radiance):
        result["world"] = {"type": "constant", "radiance": _rgb(scene.world.radiance)}
    return result


def _has_extent(light: Light) -> bool:
    if isinstance(light, AreaLight):
        return True
    return (light.angle if isinstance(light, SunLight) else light.radius) > 0


def _rgb(color: Rgb | Doubles) -> dict[str, Any]:
    return {"type": "rgb", "value": [float(channel) for channel in color]}


def _transform(matrix: Any) -> Any:
    return module().ScalarTransform4f(np.vstack([np.asarray(matrix, np.float64), [0, 0, 0, 1]]))


def _times(a: Rgb, b: Rgb) -> dict[str, Any]:
    return _rgb((a[0] * b[0], a[1] * b[1], a[2] * b[2]))


# Materials


def _bsdf(material: Material) -> dict[str, Any]:
    """The scattering of a material: one lobe, or none."""
    if not material.lobes:
        return {"type": "diffuse", "reflectance": _rgb((0.0, 0.0, 0.0))}
    if len(material.lobes) > 1:
        raise NotConvertible(f"material '{material.name}' has {len(material.lobes)} lobes")
    lobe = material.lobes[0]
    if lobe.kind == LobeKind.DIFFUSE:
        return _twosided({"type": "diffuse", "reflectance": _rgb(lobe.weight)})
    if lobe.kind == LobeKind.TRANSPARENT and lobe.weight == (1.0, 1.0, 1.0):
        return {"type": "null"}
    rough = _roughness(material, lobe)
    if lobe.kind == LobeKind.REFLECTION and lobe.fresnel == Fresnel.NONE:
        return _twosided(
            {"type": f"{rough['prefix']}conductor", "material": "none", **rough["shape"]}
            | {"specular_reflectance": _times(lobe.weight, lobe.f0)}
        )
    if lobe.kind == LobeKind.REFLECTION and lobe.fresnel == Fresnel.CONDUCTOR:
        return _twosided(
            {"type": f"{rough['prefix']}conductor", "eta": _rgb(lobe.f0), "k": _rgb(lobe.f82), **rough["shape"]}
            | {"specular_reflectance": _rgb(lobe.weight)}
        )
    if lobe.kind == LobeKind.DIELECTRIC and lobe.fresnel != Fresnel.TINTED_DIELECTRIC:
        return {
            "type": f"{rough['prefix']}dielectric",
            "int_ior": lobe.ior,
            "ext_ior": 1.0,
            "specular_reflectance": _times(lobe.weight, lobe.f0),
            "specular_transmittance": _times(lobe.weight, lobe.f82),
            **rough["shape"],
        }
    raise NotConvertible(f"material '{material.name}': {lobe.kind.name} with the Fresnel term {lobe.fresnel.name}")


def _twosided(bsdf: dict[str, Any]) -> dict[str, Any]:
    return {"type": "twosided", "bsdf": bsdf}


def _roughness(material: Material, lobe: Lobe) -> dict[str, Any]:
    """What a plugin's name begins with, and the parameters of its distribution."""
    if lobe.roughness < SMOOTH:
        return {"prefix": "", "shape": {}}
    alpha = lobe.roughness**2
    if lobe.compensate:
        raise NotConvertible(f"material '{material.name}' adds back the energy that GGX loses (MULTI_GGX)")
    if alpha > MOST_ALPHA:
        raise NotConvertible(f"material '{material.name}' has roughness {lobe.roughness:g}: its shadowing differs")
    return {"prefix": "rough", "shape": {"distribution": "ggx", "alpha": alpha}}


# Surfaces


def _shapes(scene: Scene, instance: Instance) -> Iterator[Any]:
    geometry = scene.geometries[instance.geometry]
    matrix = np.asarray(instance.transform, np.float64)
    if not instance.visibility & Visibility.CAMERA:
        raise NotConvertible(f"instance '{instance.name}' is hidden from the camera")
    slots = geometry.material_index
    for slot, index in enumerate(instance.materials):
        count = len(geometry.triangles if isinstance(geometry, Mesh) else geometry.centers)
        members = np.flatnonzero(np.zeros(count, np.int32) == slot if slots is None else slots == slot)
        material = scene.materials[index]
        if not len(members):
            continue
        if isinstance(geometry, Mesh):
            yield from _meshes(geometry, matrix, members, material)
        else:
            yield from _spheres(geometry, matrix, members, material, instance.name)


def _meshes(geometry: Mesh, matrix: Doubles, members: NDArray[np.intp], material: Material) -> Iterator[Any]:
    """The triangles `members` in world space, three corners each; twice where they shine."""
    points = geometry.positions[geometry.triangles[members]] @ matrix[:, :3].T + matrix[:, 3]
    normals = None
    if geometry.corner_normals is not None and material.lobes:  # emission does not depend on them
        normals = geometry.corner_normals[members] @ np.linalg.inv(matrix[:, :3])
        normals = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    if np.linalg.det(matrix[:, :3]) < 0:
        points, normals = points[:, ::-1], None if normals is None else normals[:, ::-1]
    if not any(material.emission):
        yield _mesh(geometry.name, points, normals, material)
        return
    if normals is not None:
        raise NotConvertible(f"material '{material.name}' shines and scatters under vertex normals")
    yield _mesh(geometry.name, points, None, material)
    across = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    corners = points.reshape(-1, 3)
    extent = float(np.max(corners.max(axis=0) - corners.min(axis=0)))
    behind = points - BACK * extent * across[:, None]
    yield _mesh(geometry.name, behind[:, ::-1], None, material)


def _mesh(name: str, points: Doubles, normals: Doubles | None, material: Material) -> Any:
    mi = module()
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(_bsdf(material))
    if any(material.emission):
        properties["emitter"] = mi.load_dict({"type": "area", "radiance": _rgb(material.emission)})
    mesh = mi.Mesh(name, 3 * len(points), len(points), has_vertex_normals=normals is not None, props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = points.astype(np.float32).ravel()
    if normals is not None:
        parameters["vertex_normals"] = normals.astype(np.float32).ravel()
    parameters["faces"] = np.arange(3 * len(points), dtype=np.uint32)
    parameters.update()
    return mesh


def _spheres(
    geometry: Spheres, matrix: Doubles, members: NDArray[np.intp], material: Material, name: str
) -> Iterator[dict[str, Any]]:
    square = matrix[:, :3].T @ matrix[:, :3]
    scale = float(np.sqrt(square[0, 0]))
    if not np.allclose(square, scale * scale * np.eye(3), atol=1e-5 * scale * scale):
        raise NotConvertible(f"instance '{name}' makes ellipsoids of its spheres")
    shared = module().load_dict(_bsdf(material))  # one for all: vector code visits materials one after the other
    for center, radius in zip(geometry.centers[members], geometry.radii[members], strict=True):
        placed = matrix[:, :3] @ center + matrix[:, 3]
        yield _sphere(placed, scale * float(radius), shared, material.emission)


def _sphere(center: Any, radius: float, bsdf: Any, emission: Rgb) -> dict[str, Any]:
    result = {"type": "sphere", "center": [float(x) for x in center], "radius": radius, "bsdf": bsdf}
    if any(emission):
        result["emitter"] = {"type": "area", "radiance": _rgb(emission)}
    return result


# Lamps


def _lamp(scene: Scene, light: Light) -> dict[str, Any]:
    if isinstance(light, AreaLight):
        return _area(light)
    if isinstance(light, SunLight):
        return _sun(scene, light)
    power = np.asarray(light.power, np.float64)
    if isinstance(light, SpotLight):
        return _spot(light, power)
    if light.radius == 0:
        return {"type": "point", "position": list(light.position), "intensity": _rgb(power / (4 * pi))}
    radiance = power / (4 * pi**2 * light.radius**2)
    return _sphere(light.position, light.radius, {"type": "null"}, (radiance[0], radiance[1], radiance[2]))


def _spot(light: SpotLight, power: Doubles) -> dict[str, Any]:
    if light.radius > 0 or light.blend > 0:
        raise NotConvertible(f"light '{light.name}' is a spot with a soft edge or a radius")
    angle = degrees(light.spot_size / 2)
    return {
        "type": "spot",
        "to_world": _transform(light.transform * np.array([-1, 1, -1, 1])),  # along +z there
        "intensity": _rgb(power / (4 * pi)),
        "cutoff_angle": angle,
        "beam_width": angle * (1 - 1e-6),
    }


def _sun(scene: Scene, light: SunLight) -> dict[str, Any]:
    irradiance = np.asarray(light.irradiance, np.float64)
    if light.angle == 0:
        return {"type": "directional", "direction": list(-light.transform[:, 2]), "irradiance": _rgb(irradiance)}
    center, radius = _bounds(scene)
    matrix = np.asarray(light.transform, np.float64).copy()
    matrix[:, :3] *= FAR * radius * tan(light.angle / 2)
    matrix[:, 3] = center + FAR * radius * np.asarray(light.transform, np.float64)[:, 2]
    return _lamp_shape("disk", matrix, irradiance / (pi * sin(light.angle / 2) ** 2))


def _area(light: AreaLight) -> dict[str, Any]:
    if not isclose(light.spread, pi, rel_tol=1e-5):
        raise NotConvertible(f"light '{light.name}' has a spread of {light.spread:g}")
    matrix = np.asarray(light.transform, np.float64).copy()
    matrix[:, :2] *= np.array(light.size) / 2
    x, y = matrix[:, 0], matrix[:, 1]
    if abs(x @ y) > 1e-5 * np.linalg.norm(x) * np.linalg.norm(y):
        raise NotConvertible(f"light '{light.name}' is sheared")
    area = float(np.linalg.norm(np.cross(x, y))) * (pi if light.ellipse else 4)
    return _lamp_shape("disk" if light.ellipse else "rectangle", matrix, np.asarray(light.power) / (pi * area))


def _lamp_shape(kind: str, matrix: Doubles, radiance: Doubles) -> dict[str, Any]:
    """A shape between -1 and 1 of the xy plane that shines along -z, +z in Mitsuba, and lets light through."""
    x, y = matrix[:, 0], matrix[:, 1]
    z = np.cross(x, y) / np.linalg.norm(np.cross(x, y))
    if z @ matrix[:, 2] > 0:
        x, z = -x, -z
    return {
        "type": kind,
        "to_world": _transform(np.stack([x, y, z, matrix[:, 3]], axis=1)),
        "bsdf": {"type": "null"},
        "emitter": {"type": "area", "radiance": _rgb(radiance)},
    }


def _bounds(scene: Scene) -> tuple[Doubles, float]:
    """A sphere around all surfaces: centre and radius."""
    corners = []
    for instance in scene.instances:
        geometry = scene.geometries[instance.geometry]
        if isinstance(geometry, Mesh):
            points = geometry.positions
        else:
            radii = geometry.radii[:, None]
            points = np.concatenate([geometry.centers - radii, geometry.centers + radii])
        corners.append(points @ instance.transform[:, :3].T + instance.transform[:, 3])
    points = np.concatenate(corners)
    low, high = points.min(axis=0).astype(np.float64), points.max(axis=0).astype(np.float64)
    return (low + high) / 2, float(np.linalg.norm(high - low)) / 2


def _camera(mi: Any, camera: Camera, film: Film) -> dict[str, Any]:
    """Mitsuba's cameras look along +z with x to the left."""
    if film.window is not None:
        raise NotConvertible("the film has a window")
    if camera.shift != (0.0, 0.0) or not isclose(
        camera.half_width * film.height, camera.half_height * film.width, rel_tol=1e-4
    ):
        raise NotConvertible(f"camera '{camera.name}' is shifted, or its pixels are not square")
    matrix = np.asarray(camera.transform, np.float64) * np.array([-1, 1, -1, 1])
    result: dict[str, Any] = {
        "near_clip": max(camera.clip_start, 1e-4),
        "far_clip": min(camera.clip_end, 1e4),
        "film": {
            "type": "hdrfilm",
            "width": film.width,
            "height": film.height,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "independent"},
    }
    if camera.projection == Projection.ORTHOGRAPHIC:
        if camera.aperture_radius > 0:
            raise NotConvertible(f"camera '{camera.name}' has parallel rays and an aperture")
        matrix[:, :2] *= camera.half_width
        return result | {"type": "orthographic", "to_world": _transform(matrix)}
    result |= {"type": "perspective", "fov": degrees(2 * atan(camera.half_width)), "fov_axis": "x"}
    if camera.aperture_radius > 0:
        lens = {"aperture_radius": camera.aperture_radius, "focus_distance": camera.focus_distance}
        result |= {"type": "thinlens", **lens}
    return result | {"to_world": _transform(matrix)}
