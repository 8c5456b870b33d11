"""What differs between two scenes, so that a renderer makes anew only what it must."""

from __future__ import annotations

import copy
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np

from .scene import Scene


@dataclass(frozen=True)
class Changes:
    """The parts that differ. Cameras and films are not looked at: they cost nothing to set again."""

    geometry: bool = True  # with instances: everything is made anew
    materials: bool = True
    lamps: bool = True
    world: bool = True


def changes(old: Scene, new: Scene) -> Changes:
    """What `new` has else than `old`. Arrays are the same where they are equal."""
    return Changes(
        geometry=not (same(old.geometries, new.geometries) and same(old.instances, new.instances)),
        materials=not same(old.materials, new.materials),
        lamps=not same(old.lights, new.lights),
        world=not same(old.world, new.world),
    )


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
