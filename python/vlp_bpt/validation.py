"""What a scene must satisfy before it goes to the native core: vectorised, each message naming datablock and value."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from . import _arrays
from .errors import SceneError
from .scene import (
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
    PointLight,
    Projection,
    Scene,
    Spheres,
    SpotLight,
    SunLight,
    World,
)

MAX_SLOTS = 65536  # material slots of one geometry: 16 bits a primitive in the native core
MAX_LOBES = 127  # lobes of one material: `layered_under` is 8 bits in the native core
MAX_RESOLUTION = 65536
_MOST_COORDINATE = 1e18  # squares of distances must not overflow float32
# Of a transform's determinant: neither it nor its inverse may overflow float32.
_LEAST_DETERMINANT, _MOST_DETERMINANT = 1e-36, 1e36


def validate(scene: Scene, *, new_geometries: Iterable[int] | None = None) -> list[str]:
    """Returns warnings; raises SceneError. See `Scene.validate`. `new_geometries`: the arrays of others were checked
    before."""
    warnings: list[str] = []
    for geometry in scene.geometries if new_geometries is None else [scene.geometries[i] for i in new_geometries]:
        if isinstance(geometry, Mesh):
            _check_mesh(geometry)
        else:
            _check_spheres(geometry)
    for material in scene.materials:
        _check_material(material, warnings)
    for instance in scene.instances:
        _check_instance(instance, len(scene.geometries), len(scene.materials))
    _check_transforms(scene.instances)
    for light in scene.lights:
        _check_light(light, warnings)
    _check_world(scene.world)
    if scene.camera is None:
        raise SceneError("scene: has no camera")
    _check_camera(scene.camera)
    _check_film(scene.film)
    if not _emits(scene):
        warnings.append("scene: nothing emits light, the picture will be black")
    return warnings


# Geometry


def _check_mesh(mesh: Mesh) -> None:
    mesh.__post_init__()  # a field may have been assigned since
    where = f"mesh '{mesh.name}'"
    _check_finite(f"{where}: positions", mesh.positions, "vertex")
    _check_near(f"{where}: positions", mesh.positions, "vertex")
    _check_indices(f"{where}: triangles", mesh.triangles, len(mesh.positions), "triangle", "vertices")
    if mesh.corner_normals is not None:
        _check_finite(f"{where}: corner_normals", mesh.corner_normals, "triangle")
    for name, uv in mesh.uvs.items():
        _check_finite(f"{where}: uvs '{name}'", uv, "triangle")
    _check_slots(where, mesh.material_index, "triangle")


def _check_spheres(spheres: Spheres) -> None:
    spheres.__post_init__()
    where = f"spheres '{spheres.name}'"
    _check_finite(f"{where}: centers", spheres.centers, "sphere")
    _check_near(f"{where}: centers", spheres.centers, "sphere")
    _check_finite(f"{where}: radii", spheres.radii, "sphere")
    if spheres.radii.size and np.min(spheres.radii) < 0:
        i = int(np.argmin(spheres.radii))
        raise SceneError(f"{where}: radii: sphere {i} is {spheres.radii[i]:.6g}, must not be negative")
    _check_slots(where, spheres.material_index, "sphere")


def _check_finite(where: str, array: NDArray[np.float32], item: str) -> None:
    if not np.isfinite(array).all():
        _fail_item(where, array, item, np.isfinite(array), "must be finite")


def _check_near(where: str, array: NDArray[np.float32], item: str) -> None:
    if array.size and max(float(np.max(array)), -float(np.min(array))) > _MOST_COORDINATE:
        _fail_item(where, array, item, np.abs(array) <= _MOST_COORDINATE, f"must be within {_MOST_COORDINATE:g}")


def _fail_item(where: str, array: NDArray[np.float32], item: str, good: NDArray[np.bool_], what: str) -> NoReturn:
    """Names the first item that is not good in all its numbers."""
    i = int(np.argmin(good.reshape(len(array), -1).all(axis=1)))
    values = ", ".join(f"{x:.6g}" for x in array[i].ravel())
    raise SceneError(f"{where}: {item} {i} is ({values}), {what}")


def _check_indices(where: str, array: NDArray[np.int32], count: int, item: str, things: str) -> None:
    if array.size and (np.min(array) < 0 or np.max(array) >= count):
        i = int(np.argmax(((array < 0) | (array >= count)).reshape(len(array), -1).any(axis=1)))
        bad = next(int(x) for x in array[i].ravel() if not 0 <= x < count)
        raise SceneError(f"{where}: {item} {i} has index {bad}, but there are {count} {things}")


def _check_slots(where: str, material_index: NDArray[np.int32] | None, item: str) -> None:
    if material_index is not None and material_index.size:
        low, high = int(np.min(material_index)), int(np.max(material_index))
        if low < 0 or high >= MAX_SLOTS:
            i = int(np.argmin(material_index) if low < 0 else np.argmax(material_index))
            slot = int(material_index[i])
            raise SceneError(f"{where}: material_index: {item} {i} has slot {slot}, must be from 0 to {MAX_SLOTS - 1}")


def _check_instance(instance: Instance, geometry_count: int, material_count: int) -> None:
    where = f"instance '{instance.name}'"
    if not 0 <= instance.geometry < geometry_count:
        raise SceneError(f"{where}: geometry {instance.geometry}, but there are {geometry_count} geometries")
    if not instance.materials:
        raise SceneError(f"{where}: materials is empty, must name at least one")
    if len(instance.materials) > MAX_SLOTS:
        raise SceneError(f"{where}: has {len(instance.materials)} materials, must be at most {MAX_SLOTS}")
    for material in instance.materials:
        if not 0 <= material < material_count:
            raise SceneError(f"{where}: material {material}, but there are {material_count} materials")


def is_singular(transforms: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Which of the transforms (N, 3, 4) cannot be rendered: they flatten space, scale it beyond what float32 holds, or
    have entries that are not finite."""
    linear = transforms[:, :, :3].astype(np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        volume = np.abs(np.linalg.det(linear))
        lengths = np.linalg.norm(linear, axis=1).prod(axis=1)  # relative to it, rounding leaves about 1e-7
        usable = (volume > _LEAST_DETERMINANT) & (volume < _MOST_DETERMINANT) & (volume > 1e-7 * lengths)
    usable &= np.isfinite(transforms).all(axis=(1, 2))
    return np.asarray(~usable)


def _check_transforms(instances: list[Instance]) -> None:
    if not instances:
        return
    for instance in instances:
        instance.__post_init__()
    transforms = np.stack([instance.transform for instance in instances])
    singular = is_singular(transforms)
    if singular.any():
        i = int(np.argmax(singular))
        _check_finite_transform(f"instance '{instances[i].name}'", transforms[i])
        determinant = np.linalg.det(transforms[i, :, :3].astype(np.float64))
        fault = "scales too far" if abs(determinant) >= _MOST_DETERMINANT else "is singular"
        raise SceneError(f"instance '{instances[i].name}': transform {fault} (determinant {determinant:.6g})")


# Materials


def _check_material(material: Material, warnings: list[str]) -> None:
    where = f"material '{material.name}'"
    _check_color(f"{where}: emission", material.emission)
    if len(material.lobes) > MAX_LOBES:
        raise SceneError(f"{where}: has {len(material.lobes)} lobes, must be at most {MAX_LOBES}")
    for i, lobe in enumerate(material.lobes):
        _check_lobe(f"{where}: lobe {i} ({LobeKind(lobe.kind).name})", lobe)
        _check_layers(f"{where}: lobe {i}", i, material.lobes)
    albedos = [_albedo(lobe) for lobe in material.lobes if lobe.layered_under < 0]
    total = float(np.max(np.sum(albedos, axis=0))) if albedos else 0.0
    if total > 1.001:
        warnings.append(f"{where}: its lobes' weights add up to {total:.4g}: it reflects more light than it receives")


def _albedo(lobe: Lobe) -> NDArray[np.float64]:
    """A bound of what the lobe scatters, per channel, where its own colours say so."""
    colored = lobe.kind == LobeKind.REFLECTION and lobe.fresnel in (Fresnel.NONE, Fresnel.SCHLICK)
    return np.multiply(lobe.weight, lobe.f0 if colored else (1.0, 1.0, 1.0))


def _check_lobe(where: str, lobe: Lobe) -> None:
    _check_color(f"{where}: weight", lobe.weight)
    _check_color(f"{where}: f0", lobe.f0)
    _check_color(f"{where}: f82", lobe.f82)
    _check_range(f"{where}: roughness", lobe.roughness, 0.0, 1.0)
    if not (math.isfinite(lobe.ior) and lobe.ior > 0):
        raise SceneError(f"{where}: ior {lobe.ior:.6g} must be above 0")
    if lobe.fresnel not in Fresnel:
        raise SceneError(f"{where}: fresnel {lobe.fresnel!r} is unknown")


def _check_layers(where: str, i: int, lobes: tuple[Lobe, ...]) -> None:
    above, seen = lobes[i].layered_under, {i}
    if above != -1 and not (0 <= above < len(lobes) and above != i):
        raise SceneError(f"{where}: layered_under {above} names no other lobe of {len(lobes)}")
    while 0 <= above < len(lobes):
        if above in seen:
            raise SceneError(f"{where}: layered_under {lobes[i].layered_under} goes round in a circle")
        seen.add(above)
        above = lobes[above].layered_under


# Lights


def _check_light(light: Light, warnings: list[str]) -> None:
    match light:
        case PointLight():
            where = f"point light '{light.name}'"
            _check_numbers(f"{where}: position", light.position)
            _check_color(f"{where}: power", light.power)
            _check_least(f"{where}: radius", light.radius)
        case SpotLight():
            where = f"spot light '{light.name}'"
            _check_direction(where, light.transform)
            _check_color(f"{where}: power", light.power)
            _check_least(f"{where}: radius", light.radius)
            _check_angle(f"{where}: spot_size", light.spot_size)
            _check_range(f"{where}: blend", light.blend, 0.0, 1.0)
        case SunLight():
            where = f"sun light '{light.name}'"
            _check_direction(where, light.transform)
            _check_color(f"{where}: irradiance", light.irradiance)
            _check_range(f"{where}: angle", light.angle, 0.0, math.pi)
        case AreaLight():
            where = f"area light '{light.name}'"
            _check_finite_transform(where, light.transform)
            _check_color(f"{where}: power", light.power)
            _check_angle(f"{where}: spread", light.spread)
            for size in light.size:
                _check_least(f"{where}: size", size)
            if not has_area(light):
                warnings.append(
                    f"{where}: size ({light.size[0]:.6g}, {light.size[1]:.6g}) has no area, it emits nothing"
                )
        case _:
            raise SceneError(f"light {light!r} is of an unknown kind")


def has_area(light: AreaLight) -> bool:
    """Whether the light's surface, after its transform, has an area above 0."""
    axes = light.transform[:, :2].astype(np.float64) * light.size
    return bool(np.linalg.norm(np.cross(axes[:, 0], axes[:, 1])) > 0)


def _check_world(world: World) -> None:
    world.__post_init__()
    where = f"world '{world.name}'"
    _check_color(f"{where}: radiance", world.radiance)
    rotation = world.rotation.astype(np.float64)
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-4):
        raise SceneError(f"{where}: rotation is none (its rows are not orthogonal unit vectors): {rotation.tolist()}")
    if world.image is None:
        return
    if world.image.size == 0:
        raise SceneError(f"{where}: image has no pixels (shape {world.image.shape})")
    bad = ~(np.isfinite(world.image) & (world.image >= 0)).all(axis=2)
    if bad.any():
        row, column = np.argwhere(bad)[0]
        value = world.image[row, column].tolist()
        raise SceneError(f"{where}: image pixel ({column}, {row}) is negative or not finite: {value}")


def _emits(scene: Scene) -> bool:
    if max(scene.world.radiance) > 0 and (scene.world.image is None or scene.world.image.any()):
        return True
    for light in scene.lights:
        strength = light.irradiance if isinstance(light, SunLight) else light.power
        if max(strength) > 0 and not (isinstance(light, AreaLight) and not has_area(light)):
            return True
    used = {material for instance in scene.instances for material in instance.materials}
    return any(max(scene.materials[i].emission) > 0 for i in used)


# Camera and film


def _check_camera(camera: Camera) -> None:
    camera.__post_init__()
    where = f"camera '{camera.name}'"
    _check_finite_transform(where, camera.transform)
    if is_singular(camera.transform[None])[0]:
        determinant = np.linalg.det(camera.transform[:, :3].astype(np.float64))
        raise SceneError(f"{where}: transform is singular (determinant {determinant:.6g})")
    for name in ("half_width", "half_height"):
        value = getattr(camera, name)
        if not (math.isfinite(value) and value > 0):
            raise SceneError(f"{where}: {name} {value:.6g} must be above 0")
    _check_numbers(f"{where}: shift", camera.shift)
    if camera.projection == Projection.PERSPECTIVE:
        _check_least(f"{where}: clip_start", camera.clip_start)
    _check_numbers(f"{where}: clip_start", [camera.clip_start])
    if not camera.clip_end > camera.clip_start:
        raise SceneError(f"{where}: clip_end {camera.clip_end:.6g} must be above clip_start {camera.clip_start:.6g}")
    _check_least(f"{where}: aperture_radius", camera.aperture_radius)
    if camera.aperture_radius > 0 and not (math.isfinite(camera.focus_distance) and camera.focus_distance > 0):
        raise SceneError(f"{where}: focus_distance {camera.focus_distance:.6g} must be above 0")


def _check_film(film: Film) -> None:
    for name, size in (("width", film.width), ("height", film.height)):
        if not 1 <= size <= MAX_RESOLUTION:
            raise SceneError(f"film: {name} {size} must be from 1 to {MAX_RESOLUTION} pixels")
    x, y, width, height = film.render_window
    if width < 1 or height < 1:
        raise SceneError(f"film: window of {width} x {height} pixels is empty")
    if x < 0 or y < 0 or x + width > film.width or y + height > film.height:
        picture = f"{film.width} x {film.height}"
        raise SceneError(f"film: window {width} x {height} at ({x}, {y}) reaches beyond the {picture} pixels")


# Numbers


def _check_numbers(where: str, values: Iterable[Any]) -> None:
    for value in values:
        if not math.isfinite(value):
            raise SceneError(f"{where} {value} must be finite")


def _check_color(where: str, color: tuple[float, float, float]) -> None:
    if len(color) != 3:
        raise SceneError(f"{where} {color} must have three channels")
    for value in color:
        _check_least(where, value)


def _check_least(where: str, value: float) -> None:
    if not (math.isfinite(value) and value >= 0):
        raise SceneError(f"{where} {value:.6g} must be finite and not negative")


def _check_range(where: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high * (1 + 1e-6):  # float32 rounds pi up
        raise SceneError(f"{where} {value:.6g} must be from {low:.6g} to {high:.6g}")


def _check_angle(where: str, value: float) -> None:
    if not 0 < value <= math.pi * (1 + 1e-6):
        raise SceneError(f"{where} {value:.6g} must be above 0 and at most pi")


def _check_finite_transform(where: str, transform: NDArray[np.float32]) -> None:
    array = _arrays.float32(f"{where}: transform", transform, (3, 4))
    if not np.isfinite(array).all():
        bad = array[~np.isfinite(array)][0]
        raise SceneError(f"{where}: transform has {bad}, must be finite")


def _check_direction(where: str, transform: NDArray[np.float32]) -> None:
    _check_finite_transform(where, transform)
    if not np.linalg.norm(transform[:, 2].astype(np.float64)) > 0:
        raise SceneError(f"{where}: transform is singular (its z axis has no length)")
