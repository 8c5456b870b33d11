"""What differs between two scenes, so that a renderer makes anew only what it must."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np

from .scene import Instance, Mesh, Scene, Spheres


@dataclass(frozen=True)
class Changes:
    """The parts that differ. Cameras and films are not looked at: they cost nothing to set again."""

    geometry: bool = True  # with instances: everything is made anew
    materials: bool = True
    lamps: bool = True
    world: bool = True
    # Where geometry is not made anew: indices of what has other vertices or spheres, but as many, and other transforms.
    moved_geometries: tuple[int, ...] = ()
    moved_instances: tuple[int, ...] = ()


def changes(old: Scene, new: Scene) -> Changes:
    """What `new` has else than `old`. Arrays are the same where they are equal."""
    geometries = _moved(old.geometries, new.geometries, _is_moved_geometry)
    instances = _moved(old.instances, new.instances, _is_moved_instance)
    anew = geometries is None or instances is None
    return Changes(
        geometry=anew,
        materials=not same(old.materials, new.materials),
        lamps=not same(old.lights, new.lights),
        world=not same(old.world, new.world),
        moved_geometries=() if anew else geometries or (),
        moved_instances=() if anew else instances or (),
    )


def _moved(old: list[Any], new: list[Any], is_moved: Callable[[Any, Any], bool]) -> tuple[int, ...] | None:
    """Which have moved; None where something has changed otherwise."""
    if len(old) != len(new):
        return None
    different = [i for i, (a, b) in enumerate(zip(old, new, strict=True)) if not same(a, b)]
    return tuple(different) if all(is_moved(old[i], new[i]) for i in different) else None


def _is_moved_geometry(a: Mesh | Spheres, b: Mesh | Spheres) -> bool:
    """Whether the trees over both may be the same but for boxes."""
    if isinstance(a, Mesh) and isinstance(b, Mesh):
        return len(a.positions) == len(b.positions) and same(a.triangles, b.triangles)
    return isinstance(a, Spheres) and isinstance(b, Spheres) and len(a.centers) == len(b.centers)


def _is_moved_instance(a: Instance, b: Instance) -> bool:
    return same(replace(a, transform=b.transform), b)


def kept(value: Any) -> Any:
    """A copy that later assignments to fields and lists do not reach; arrays are shared."""
    if isinstance(value, list | tuple):
        return type(value)(kept(item) for item in value)
    if isinstance(value, dict):
        return {name: kept(item) for name, item in value.items()}
    if not is_dataclass(value) or isinstance(value, type):
        return value
    twin = copy.copy(value)
    for field in fields(value):
        object.__setattr__(twin, field.name, kept(getattr(value, field.name)))
    return twin


def same(a: Any, b: Any) -> bool:
    """Whether two parts of scenes are equal, arrays in them as well."""
    if a is b:
        return True
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[name], b[name]) for name in a)
    if is_dataclass(a):
        return all(same(getattr(a, field.name), getattr(b, field.name)) for field in fields(a))
    return bool(a == b)
