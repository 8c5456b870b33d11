"""Scene snapshots (.vlp.npz): a JSON header and plain arrays in one zip file, lossless, versioned, never pickle."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import zipfile
from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
from numpy.typing import NDArray

from .errors import Error, SceneError
from .scene import (
    AreaLight,
    Camera,
    Film,
    Instance,
    Lobe,
    Material,
    Mesh,
    PointLight,
    Scene,
    Spheres,
    SpotLight,
    SunLight,
    Visibility,
    World,
)
from .settings import RenderSettings

SUFFIX = ".vlp.npz"
FORMAT = "vlp_bpt.scene"
VERSION = 1  # raised when a file of this version could not be read by older code

_TYPES: dict[str, type[Any]] = {
    cls.__name__: cls
    for cls in (Mesh, Spheres, Material, Lobe, PointLight, SpotLight, SunLight, AreaLight, World, Camera, Film)
}
_ENUM_FIELDS: dict[str, dict[str, type[Enum]]] = {
    name: {
        field: hint for field, hint in get_type_hints(cls).items() if isinstance(hint, type) and issubclass(hint, Enum)
    }
    for name, cls in _TYPES.items()
}
_Arrays = dict[str, NDArray[Any]]


@dataclasses.dataclass
class Snapshot:
    """What a snapshot file holds. metadata: JSON values of the writer's choice, such as the .blend it came from."""

    scene: Scene
    settings: RenderSettings | None = None
    metadata: dict[str, Any] = dataclasses.field(default_factory=dict)


def save_snapshot(path: str | Path, snapshot: Snapshot, *, compress: bool = True) -> None:
    """Writes the snapshot; the file appears whole or not at all. Raises SceneError naming the file."""
    path = Path(path)
    header, arrays = _encode_scene(snapshot.scene)
    header |= {
        "format": FORMAT,
        "version": VERSION,
        "settings": snapshot.settings.to_dict() if snapshot.settings is not None else None,
        "metadata": snapshot.metadata,
    }
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
    unfinished = path.with_name(path.name + ".unfinished")
    try:
        with unfinished.open("wb") as file:
            (np.savez_compressed if compress else np.savez)(file, allow_pickle=False, **arrays)
        unfinished.replace(path)
    except OSError as error:
        raise SceneError(f"'{path}': cannot be written: {error.strerror}") from error
    finally:
        if unfinished.is_file():
            unfinished.unlink()


def load_snapshot(path: str | Path) -> Snapshot:
    """Reads a snapshot. Raises SceneError naming the file when it is absent, damaged, newer or something else."""
    path = Path(path)
    if not path.is_file():
        raise SceneError(f"'{path}': there is no such file")
    try:
        if not zipfile.is_zipfile(path):
            raise SceneError(f"'{path}': is not a VLP-BPT snapshot, or cut short")
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            if "header" not in arrays:
                raise SceneError(f"'{path}': is not a VLP-BPT snapshot")
            header = json.loads(arrays["header"].tobytes())
            if header.get("format") != FORMAT:
                raise SceneError(f"'{path}': is not a VLP-BPT snapshot")
            version = header["version"]
            if version > VERSION:
                raise SceneError(
                    f"'{path}': has snapshot version {version}, this VLP-BPT reads up to {VERSION}: update it"
                )
            settings = RenderSettings.from_dict(header["settings"]) if header["settings"] is not None else None
            return Snapshot(_decode_scene(header, lambda name: arrays[name]), settings, header["metadata"])
    except Error as error:
        raise type(error)(str(error) if str(path) in str(error) else f"'{path}': {error}") from error
    except Exception as error:  # damaged bytes fail in any of zipfile, zlib, tokenize, ast, json and numpy
        raise SceneError(f"'{path}': is not a VLP-BPT snapshot, or damaged ({error})") from error


def scene_digest(scene: Scene) -> str:
    """A fingerprint of everything in the scene but its film: pictures may be merged only when theirs agree."""
    header, arrays = _encode_scene(dataclasses.replace(scene, film=Film()))
    digest = hashlib.blake2b(json.dumps(header, sort_keys=True).encode(), digest_size=16)
    for name in sorted(arrays):
        digest.update(name.encode())
        digest.update(np.ascontiguousarray(arrays[name]).data)
    return digest.hexdigest()


def _encode_scene(scene: Scene) -> tuple[dict[str, Any], _Arrays]:
    arrays: _Arrays = {}
    header = {
        "geometries": [_encode(g, arrays, f"geometries/{i}") for i, g in enumerate(scene.geometries)],
        "materials": [_encode(material, arrays, "") for material in scene.materials],
        "lights": [_encode(light, arrays, "") for light in scene.lights],
        "world": _encode(scene.world, arrays, ""),
        "camera": _encode(scene.camera, arrays, ""),
        "film": _encode(scene.film, arrays, ""),
        "instance_names": [instance.name for instance in scene.instances],
    }
    instances = scene.instances  # as columns: there may be 100,000
    slots = [slot for instance in instances for slot in instance.materials]
    arrays["instances/geometry"] = np.array([i.geometry for i in instances], dtype=np.int32)
    arrays["instances/transform"] = np.array([i.transform for i in instances], dtype=np.float32).reshape(-1, 3, 4)
    arrays["instances/visibility"] = np.array([int(i.visibility) for i in instances], dtype=np.int64)
    arrays["instances/material_count"] = np.array([len(i.materials) for i in instances], dtype=np.int32)
    arrays["instances/materials"] = np.array(slots, dtype=np.int32)
    return header, arrays


def _decode_scene(header: dict[str, Any], array: Callable[[str], NDArray[Any]]) -> Scene:
    scene = Scene(
        geometries=[_decode(value, array) for value in header["geometries"]],
        materials=[_decode(value, array) for value in header["materials"]],
        lights=[_decode(value, array) for value in header["lights"]],
        world=_decode(header["world"], array),
        camera=_decode(header["camera"], array),
        film=_decode(header["film"], array),
    )
    ends = np.cumsum(array("instances/material_count"))
    slots = [tuple(part.tolist()) for part in np.split(array("instances/materials"), ends[:-1])]
    columns = zip(
        header["instance_names"],
        array("instances/geometry").tolist(),
        array("instances/transform"),
        slots if len(ends) else [],
        array("instances/visibility").tolist(),
        strict=True,
    )
    scene.instances = [Instance(n, g, t, slots_of, Visibility(v)) for n, g, t, slots_of, v in columns]
    return scene


def _encode(value: Any, arrays: _Arrays, where: str) -> Any:
    """JSON for a value; large arrays go to `arrays` under `where`, small ones (transforms) stay, exact as decimals."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        names = [field.name for field in dataclasses.fields(value)]
        encoded = {name: _encode(getattr(value, name), arrays, f"{where}/{name}") for name in names}
        return {"$type": type(value).__name__} | encoded
    if isinstance(value, np.ndarray):
        if value.shape == (3, 4):
            return value.tolist()
        arrays[where] = value
        return {"$array": where}
    if isinstance(value, dict):
        return {"$dict": [[key, _encode(item, arrays, f"{where}/{i}")] for i, (key, item) in enumerate(value.items())]}
    if isinstance(value, (list, tuple)):
        return [_encode(item, arrays, f"{where}/{i}") for i, item in enumerate(value)]
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, np.generic):
        return value.item()
    return value


def _decode(value: Any, array: Callable[[str], NDArray[Any]]) -> Any:
    if isinstance(value, list):
        return tuple(_decode(item, array) for item in value)
    if not isinstance(value, dict):
        return value
    if "$array" in value:
        return array(value["$array"])
    if "$dict" in value:
        return {key: _decode(item, array) for key, item in value["$dict"]}
    cls = _TYPES[value["$type"]]
    enums = _ENUM_FIELDS[cls.__name__]
    fields = {name: _decode(item, array) for name, item in value.items() if name != "$type"}
    return cls(**{name: enums[name](item) if name in enums else item for name, item in fields.items()})
