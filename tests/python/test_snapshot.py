"""Snapshots: nothing is lost, nothing is unpickled, and what is wrong with a file is said."""

from __future__ import annotations

import dataclasses
import json
import zipfile
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_scenes import everything, room

from vlp_bpt import Mode, RenderSettings
from vlp_bpt.errors import SceneError, SettingsError
from vlp_bpt.scene import Camera, Film, Instance, Scene
from vlp_bpt.snapshot import VERSION, Snapshot, load_snapshot, save_snapshot, scene_digest


def assert_same(a: Any, b: Any, where: str = "scene") -> None:
    """Equal in every value, to the bit, and of the same type."""
    if not isinstance(a, (int, float)):
        assert type(a) is type(b), where
    if dataclasses.is_dataclass(a):
        for field in dataclasses.fields(a):
            assert_same(getattr(a, field.name), getattr(b, field.name), f"{where}.{field.name}")
    elif isinstance(a, np.ndarray):
        assert a.dtype == b.dtype, where
        assert np.array_equal(a, b), where
    elif isinstance(a, (list, tuple)):
        assert len(a) == len(b), where
        for i, (x, y) in enumerate(zip(a, b, strict=True)):
            assert_same(x, y, f"{where}[{i}]")
    elif isinstance(a, dict):
        assert list(a) == list(b), where
        for key in a:
            assert_same(a[key], b[key], f"{where}[{key!r}]")
    else:
        assert a == b, where
        assert isinstance(a, Enum) == isinstance(b, Enum), where


@pytest.mark.parametrize("compress", [True, False])
def test_nothing_is_lost(tmp_path: Path, compress: bool) -> None:
    snapshot = Snapshot(
        everything(),
        RenderSettings(mode=Mode.PAPER, samples=3, light_paths=5),
        {"blend": "Küche.blend", "frame": 7, "nested": [1, {"a": None}]},
    )
    path = tmp_path / "scene.vlp.npz"
    save_snapshot(path, snapshot, compress=compress)
    assert_same(snapshot, load_snapshot(path))
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("scene", [Scene(), Scene(camera=None), room()], ids=["empty", "no camera", "room"])
def test_scenes_without_much(tmp_path: Path, scene: Scene) -> None:
    save_snapshot(tmp_path / "scene.vlp.npz", Snapshot(scene))
    loaded = load_snapshot(tmp_path / "scene.vlp.npz")
    assert_same(loaded, Snapshot(scene))
    assert loaded.settings is None


def test_numpy_numbers_are_numbers(tmp_path: Path) -> None:
    scene = room()
    scene.camera = Camera(half_width=np.float32(0.1), clip_end=np.inf)  # type: ignore[arg-type]
    save_snapshot(tmp_path / "scene.vlp.npz", Snapshot(scene))
    camera = load_snapshot(tmp_path / "scene.vlp.npz").scene.camera
    assert camera is not None
    assert camera.half_width == np.float32(0.1)
    assert camera.clip_end == np.inf


def test_many_instances_are_columns(tmp_path: Path) -> None:
    scene = room()
    scene.instances += [Instance(f"i{i}", 0, materials=(0,) * (i % 3 + 1)) for i in range(1000)]
    save_snapshot(tmp_path / "scene.vlp.npz", Snapshot(scene))
    assert_same(load_snapshot(tmp_path / "scene.vlp.npz").scene, scene)
    with zipfile.ZipFile(tmp_path / "scene.vlp.npz") as file:
        assert len(file.namelist()) < 10


def test_the_digest_sees_every_change_but_the_film() -> None:
    digest = scene_digest(everything())
    assert scene_digest(everything()) == digest
    assert scene_digest(everything(seed=2)) != digest
    assert scene_digest(dataclasses.replace(everything(), film=Film())) == digest
    moved = everything()
    moved.instances[1].transform[0, 3] = np.nextafter(moved.instances[1].transform[0, 3], np.float32(9))
    assert scene_digest(moved) != digest
    nudged = everything()
    nudged.geometries[0].material_index[3] ^= 1  # type: ignore[index]
    assert scene_digest(nudged) != digest


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    path = tmp_path / "scene.vlp.npz"
    save_snapshot(path, Snapshot(everything(), RenderSettings()))
    return path


def rewrite(path: Path, **changes: Any) -> None:
    """The file with another header."""
    with np.load(path) as arrays:
        contents = dict(arrays)
    header = json.loads(contents["header"].tobytes()) | changes
    contents["header"] = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
    np.savez(path, **contents)


def test_an_absent_file(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"none\.vlp\.npz': there is no such file"):
        load_snapshot(tmp_path / "none.vlp.npz")


def test_a_newer_file(saved: Path) -> None:
    rewrite(saved, version=VERSION + 1)
    message = rf"scene\.vlp\.npz': has snapshot version {VERSION + 1}, this VLP-BPT reads up to {VERSION}: update it"
    with pytest.raises(SceneError, match=message):
        load_snapshot(saved)


def test_another_kind_of_file(saved: Path) -> None:
    rewrite(saved, format="something else")
    with pytest.raises(SceneError, match="is not a VLP-BPT snapshot"):
        load_snapshot(saved)
    np.savez(saved, a=np.zeros(3))
    with pytest.raises(SceneError, match="is not a VLP-BPT snapshot"):
        load_snapshot(saved)
    saved.write_bytes(b"plain text")
    with pytest.raises(SceneError, match="is not a VLP-BPT snapshot"):
        load_snapshot(saved)


def test_wrong_contents_are_named(saved: Path) -> None:
    rewrite(saved, settings={"samples": -1})
    with pytest.raises(SettingsError, match=r"scene\.vlp\.npz': samples = -1: must be from 1"):
        load_snapshot(saved)
    rewrite(saved, settings=None, world={"$type": "Popen"})
    with pytest.raises(SceneError, match="damaged"):
        load_snapshot(saved)


def test_objects_are_never_unpickled(saved: Path, tmp_path: Path) -> None:
    trap = tmp_path / "sprung"

    class Trap:
        def __reduce__(self) -> Any:
            return Path.touch, (trap,)

    with np.load(saved) as arrays:
        contents = dict(arrays)
    contents["instances/geometry"] = np.array([Trap()], dtype=object)
    np.savez(saved, **contents)
    with pytest.raises(SceneError, match="damaged"):
        load_snapshot(saved)
    assert not trap.exists()


def test_damaged_files_are_refused_or_harmless(saved: Path) -> None:
    whole = saved.read_bytes()
    random = np.random.default_rng(5)
    refused = 0
    for i in range(200):
        damaged = bytearray(whole)
        if i % 4 == 0:
            del damaged[int(random.integers(len(whole))) :]
        else:
            damaged[int(random.integers(len(whole)))] ^= int(random.integers(1, 256))
        saved.write_bytes(damaged)
        try:
            load_snapshot(saved)
        except (SceneError, SettingsError) as error:
            assert str(saved) in str(error)
            refused += 1
    assert refused > 150


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="cannot be written: No such file or directory"):
        save_snapshot(tmp_path / "none" / "scene.vlp.npz", Snapshot(room()))
