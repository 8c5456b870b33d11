"""Renderers that go on with a changed scene or other settings: the pictures that new renderers make."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from small_scenes import room

from vlp_bpt import Device, Mode, Renderer, RenderSettings, SceneError
from vlp_bpt.changes import Changes, changes, kept
from vlp_bpt.scene import Instance, Lobe, LobeKind, Material, PointLight, Scene, Visibility, World

SETTINGS = RenderSettings(samples=8, device=Device.CPU, threads=1)


def paint(scene: Scene) -> None:
    scene.materials[0] = Material("paint", (Lobe(LobeKind.DIFFUSE, (0.2, 0.5, 0.1)),))


def glow(scene: Scene) -> None:
    scene.materials[0] = Material("glow", (), emission=(1, 2, 3))


def add_material(scene: Scene) -> None:
    scene.materials.append(Material("unused", (), emission=(5, 5, 5)))


def add_lamp(scene: Scene) -> None:
    scene.lights.append(PointLight("point", (0.1, 0.1, 0.1), (3, 3, 3)))


def remove_lamps(scene: Scene) -> None:
    scene.lights.clear()
    scene.world = World(radiance=(1, 1, 1), image=np.full((4, 8, 3), 0.5, dtype=np.float32))


def turn_camera(scene: Scene) -> None:
    assert scene.camera is not None
    scene.camera.half_width *= 0.5


def enlarge(scene: Scene) -> None:
    scene.film.width, scene.film.height, scene.film.window = 40, 30, (3, 5, 20, 9)


def move_instance(scene: Scene) -> None:
    old = scene.instances[0]
    scene.instances[0] = Instance(old.name, old.geometry, old.transform * np.float32(0.9), old.materials)


def move_vertices(scene: Scene) -> None:
    mesh: Any = scene.geometries[0]
    mesh.positions = mesh.positions * np.float32(0.9)


def move_everything(scene: Scene) -> None:
    move_instance(scene)
    move_vertices(scene)
    paint(scene)
    add_lamp(scene)


def fewer_triangles(scene: Scene) -> None:
    mesh: Any = scene.geometries[0]
    mesh.triangles = mesh.triangles[:-1]


def another_vertex(scene: Scene) -> None:
    mesh: Any = scene.geometries[0]
    mesh.positions = np.concatenate([mesh.positions, mesh.positions[:1]])


def turn_triangles(scene: Scene) -> None:
    mesh: Any = scene.geometries[0]
    mesh.triangles = np.ascontiguousarray(mesh.triangles[:, ::-1])


def place_again(scene: Scene) -> None:
    scene.instances.append(replace(scene.instances[0], transform=scene.instances[0].transform * np.float32(0.5)))


def hide(scene: Scene) -> None:
    scene.instances[0].visibility = Visibility(0)


NOTHING = Changes(geometry=False, materials=False, lamps=False, world=False)
EDITS: list[tuple[Callable[[Scene], None], Changes]] = [
    (paint, replace(NOTHING, materials=True)),
    (glow, replace(NOTHING, materials=True)),
    (add_material, replace(NOTHING, materials=True)),
    (add_lamp, replace(NOTHING, lamps=True)),
    (remove_lamps, replace(NOTHING, lamps=True, world=True)),
    (turn_camera, NOTHING),
    (enlarge, NOTHING),
    (move_instance, replace(NOTHING, moved_instances=(0,))),
    (move_vertices, replace(NOTHING, moved_geometries=(0,))),
    (move_everything, replace(NOTHING, moved_geometries=(0,), moved_instances=(0,), materials=True, lamps=True)),
    (fewer_triangles, replace(NOTHING, geometry=True)),
    (another_vertex, replace(NOTHING, geometry=True)),
    (turn_triangles, replace(NOTHING, geometry=True)),
    (place_again, replace(NOTHING, geometry=True)),
    (hide, replace(NOTHING, geometry=True)),
]


@pytest.mark.parametrize(("edit", "expected"), EDITS)
def test_a_changed_scene_gives_the_picture_of_a_new_renderer(edit: Callable[[Scene], None], expected: Changes) -> None:
    scene = room(24, 16)
    renderer = Renderer(scene, SETTINGS)
    renderer.render()
    before = kept(scene)
    edit(scene)  # the same object: what it was is remembered
    assert changes(before, scene) == expected
    native_scene = renderer._scene
    renderer.update(scene)
    assert (renderer._scene is native_scene) == (not expected.geometry)
    assert renderer.iterations == 0
    updated = renderer.render()
    assert updated.metadata["ranges"] == [[0, 8]]
    np.testing.assert_array_equal(updated.pixels, Renderer(scene, SETTINGS).render().pixels)
    assert renderer.uploaded_bytes == 0


@pytest.mark.parametrize(
    "values", [{"mode": Mode.PAPER}, {"seed": 3, "samples": 4}, {"threads": 2}, {"light_paths": 50}, {"splats": False}]
)
def test_other_settings_give_the_picture_of_a_new_renderer(values: dict[str, Any]) -> None:
    renderer = Renderer(room(24, 16), SETTINGS)
    renderer.iterate(2)
    settings = RenderSettings(**{"samples": 8, "device": Device.CPU, "threads": 1, **values})
    renderer.update(settings=settings)
    np.testing.assert_array_equal(renderer.render().pixels, Renderer(room(24, 16), settings).render().pixels)
    assert renderer.metadata()["settings"] == renderer.settings.to_dict()


def test_nothing_changed_begins_anew() -> None:
    renderer = Renderer(room(24, 16), SETTINGS)
    first = renderer.render().pixels
    renderer.update()
    assert renderer.iterations == 0
    assert renderer.statistics.seconds == 0
    np.testing.assert_array_equal(renderer.render().pixels, first)


def test_what_cannot_be_rendered_leaves_the_old_scene() -> None:
    renderer = Renderer(room(24, 16), SETTINGS)
    first = renderer.render().pixels
    broken = room(24, 16)
    broken.instances[0].materials = (7,)
    with pytest.raises(SceneError, match="material 7, but there are 1 materials"):
        renderer.update(broken)
    renderer.update()
    np.testing.assert_array_equal(renderer.render().pixels, first)


def test_after_an_error_within_everything_is_made_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    renderer = Renderer(room(24, 16), SETTINGS)
    scene = room(24, 16)
    paint(scene)

    def fail(*_: object) -> None:
        raise SceneError("no")

    with monkeypatch.context() as patch:
        patch.setattr("vlp_bpt.render.upload_changes", fail)
        with pytest.raises(SceneError, match="no"):
            renderer.update(scene)
    native_scene = renderer._scene
    renderer.update(scene)
    assert renderer._scene is not native_scene
    np.testing.assert_array_equal(renderer.render().pixels, Renderer(scene, SETTINGS).render().pixels)


def test_the_noise_threshold_is_that_of_the_new_settings() -> None:
    renderer = Renderer(room(), replace(SETTINGS, samples=40))
    renderer.render()
    assert renderer.statistics.noise is None
    renderer.update(settings=replace(SETTINGS, samples=100_000, noise_threshold=0.3))
    renderer.render()
    assert renderer.iterations < 100_000
    noise = renderer.statistics.noise
    assert noise is not None and noise <= 0.3
    renderer.update(settings=replace(SETTINGS, samples=40))
    renderer.render()
    assert renderer.iterations == 40
    assert renderer.statistics.noise is None
