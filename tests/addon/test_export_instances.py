"""However an object is repeated, its geometry is exported once; slots, visibility and collections follow it."""

from __future__ import annotations

from typing import Any

import bpy
import bpy_scenes as scenes
import numpy as np
import pytest

from addon.export.notes import Notes
from vlp_bpt.errors import SceneError
from vlp_bpt.scene import Spheres, Visibility


def place(exported: Any, name: str) -> Any:
    (found,) = (instance for instance in exported.instances if instance.name == name)
    return found


def test_objects_that_share_a_mesh_share_its_geometry() -> None:
    data = scenes.mesh()
    for index in range(3):
        scenes.link(f"copy{index}", data).location.x = index
    exported = scenes.export()
    assert len(exported.geometries) == 1
    assert [instance.geometry for instance in exported.instances] == [0, 0, 0]
    assert sorted(instance.transform[0, 3] for instance in exported.instances) == [0, 1, 2]


def test_a_modifier_gives_an_object_its_own_geometry() -> None:
    data = scenes.mesh()
    scenes.link("plain", data)
    scenes.link("thick", data).modifiers.new("thick", "SOLIDIFY")
    assert len(scenes.export().geometries) == 2


def test_transforms_are_exact_also_when_mirrored_and_sheared() -> None:
    parent = scenes.link("parent", None)
    parent.scale = (1, 3, 1)
    shown = scenes.link("child", scenes.mesh())
    shown.parent = parent
    shown.rotation_euler = (0.3, 0.4, 0.5)
    shown.scale = (-1, 2, 1)
    shown.location = (1, 2, 3)
    transform = place(scenes.export(), "child").transform
    assert np.array_equal(transform, np.array(shown.matrix_world, np.float32)[:3])
    assert np.linalg.det(transform[:, :3]) < 0


def test_collection_instances() -> None:
    inner = bpy.data.collections.new("inner")
    inner.objects.link(bpy.data.objects.new("leaf", scenes.mesh()))
    for index in range(4):
        empty = scenes.link(f"empty{index}", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", inner
        empty.location.z = index
    exported = scenes.export()
    assert len(exported.geometries) == 1
    assert sorted(float(instance.transform[2, 3]) for instance in exported.instances) == [0, 1, 2, 3]


def test_geometry_nodes_instances_and_points() -> None:
    shown = scenes.link("nodes", scenes.mesh("host"))
    material = bpy.data.materials.new("set")
    group = bpy.data.node_groups.new("group", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    output, points, cube, paint, instances, join = (
        group.nodes.new(kind)
        for kind in (
            "NodeGroupOutput",
            "GeometryNodePoints",
            "GeometryNodeMeshCube",
            "GeometryNodeSetMaterial",
            "GeometryNodeInstanceOnPoints",
            "GeometryNodeJoinGeometry",
        )
    )
    points.inputs["Count"].default_value = 5
    points.inputs["Radius"].default_value = 0.25
    points.inputs["Position"].default_value = (1, 2, 3)
    paint.inputs["Material"].default_value = material
    for source, target in (
        (cube.outputs[0], paint.inputs[0]),
        (points.outputs[0], instances.inputs["Points"]),
        (paint.outputs[0], instances.inputs["Instance"]),
        (instances.outputs[0], join.inputs[0]),
        (points.outputs[0], join.inputs[0]),
        (join.outputs[0], output.inputs[0]),
    ):
        group.links.new(source, target)
    shown.modifiers.new("nodes", "NODES").node_group = group
    exported = scenes.export()
    (spheres,) = (geometry for geometry in exported.geometries if isinstance(geometry, Spheres))
    assert np.array_equal(spheres.centers, [(1, 2, 3)] * 5)
    assert np.allclose(spheres.radii, 0.25)
    cubes = [item for item in exported.instances if exported.geometries[item.geometry] is not spheres]
    assert len(cubes) == 5
    assert len(exported.geometries) == 2
    geometry = exported.geometries[cubes[0].geometry]
    slot = 0 if geometry.material_index is None else int(geometry.material_index[0])
    assert exported.materials[cubes[0].materials[slot]].name == "set"


def test_particles_are_instances() -> None:
    scenes.link("leaf", scenes.mesh("leaf")).location.z = 9
    shown = scenes.plane()
    shown.modifiers.new("particles", "PARTICLE_SYSTEM")
    settings = shown.particle_systems[0].settings
    settings.count, settings.frame_start, settings.frame_end = 20, 1, 1
    settings.physics_type = "NO"
    settings.render_type, settings.instance_object = "OBJECT", bpy.data.objects["leaf"]
    shown.show_instancer_for_render = shown.show_instancer_for_viewport = False
    bpy.context.scene.frame_set(2)
    exported = scenes.export()
    assert len(exported.geometries) <= 2
    leaves = [item for item in exported.instances if item.name == "leaf"]
    assert len(leaves) == 21
    assert len({item.geometry for item in leaves}) == 1
    assert not [item for item in exported.instances if item.name == "Plane"]


def test_material_slots_of_objects_and_meshes() -> None:
    of_mesh, of_object = bpy.data.materials.new("mesh"), bpy.data.materials.new("object")
    data = scenes.mesh()
    data.materials.append(of_mesh)
    data.materials.append(None)
    plain, own = scenes.link("plain", data), scenes.link("own", data)
    own.material_slots[0].link = "OBJECT"
    own.material_slots[0].material = of_object
    scenes.link("bare", scenes.mesh("bare"))
    exported = scenes.export()
    names = {item.name: [exported.materials[index].name for index in item.materials] for item in exported.instances}
    assert names == {"plain": ["mesh", "default"], "own": ["object", "default"], "bare": ["default"]}
    assert place(exported, plain.name).geometry == place(exported, own.name).geometry
    assert len(exported.materials) == 3


def test_visibility_to_the_camera() -> None:
    seen, hidden, lamp = (scenes.link(name, scenes.mesh(name)) for name in ("seen", "hidden", "gone"))
    hidden.visible_camera = False
    lamp.hide_render = True
    for name, visible in (("lit", True), ("unlit", None)):
        shown = scenes.link(name, bpy.data.lights.new(name, "POINT"))
        if visible is not None:
            shown.visible_camera = visible
    exported = scenes.export()
    assert place(exported, seen.name).visibility == Visibility.CAMERA
    assert place(exported, hidden.name).visibility == Visibility(0)
    lights = {item.name: item.visibility for item in exported.lights}
    assert lights == {"lit": Visibility.CAMERA, "unlit": Visibility(0)}  # Blender hides new lamps from the camera


def test_instances_of_a_hidden_instancer_are_hidden_from_the_camera() -> None:
    inner = bpy.data.collections.new("inner")
    inner.objects.link(bpy.data.objects.new("leaf", scenes.mesh()))
    empty = scenes.link("empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", inner
    empty.visible_camera = False
    assert place(scenes.export(), "leaf").visibility == Visibility(0)


def test_excluded_collections_are_left_out_of_their_view_layer() -> None:
    collection = bpy.data.collections.new("off")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(bpy.data.objects.new("off", scenes.mesh()))
    scenes.link("on", scenes.mesh())
    assert len(scenes.export().instances) == 2
    bpy.context.view_layer.layer_collection.children["off"].exclude = True
    assert [item.name for item in scenes.export().instances] == ["on"]


def test_a_scale_of_zero_is_left_out_and_named() -> None:
    flat = scenes.link("flat", scenes.mesh())
    flat.scale = (1, 0, 1)
    tiny = scenes.link("tiny", scenes.mesh())
    tiny.scale = (1e-5, 1e-5, 1e-5)
    notes = Notes()
    assert [item.name for item in scenes.export(notes).instances] == ["tiny"]
    assert any("'flat'" in text and "(1, 0, 1)" in text for text in notes.warnings)


@pytest.mark.parametrize("scale", [1e-20, 1e20])
def test_a_scale_beyond_single_precision_is_left_out_and_named(scale: float) -> None:
    scenes.link("odd", scenes.mesh()).scale = (scale, scale, scale)
    notes = Notes()
    exported = scenes.export(notes)
    assert exported.instances == []
    exported.validate()
    assert any("'odd'" in text and f"{scale:g}" in text for text in notes.warnings)


def test_a_transform_that_is_not_a_number_is_an_error() -> None:
    scenes.link("lost", scenes.mesh()).location.x = float("nan")
    with pytest.raises(SceneError, match=r"'lost'.*nan"):
        scenes.export().validate()


def test_what_is_not_there_yet_is_named_once() -> None:
    curves = bpy.data.hair_curves.new("hair")
    scenes.link("hair", curves)
    scenes.link("fog", bpy.data.volumes.new("fog"))
    notes = Notes()
    exported = scenes.export(notes)
    assert not exported.instances
    assert sum("'hair'" in text for text in notes.warnings) == 1
    assert sum("'fog'" in text for text in notes.warnings) == 1


def test_a_view_layer_replaces_materials_and_world() -> None:
    own, override = bpy.data.materials.new("own"), bpy.data.materials.new("override")
    shown = scenes.plane(own)
    shown.data.materials.append(own)
    shown.data.polygons[0].material_index = 1
    layer = bpy.context.view_layer
    layer.material_override = override
    layer.world_override = bpy.data.worlds.new("sky")
    exported = scenes.export()
    assert [material.name for material in exported.materials] == ["override"]
    assert exported.instances[0].materials == (0,)
    assert exported.world.name == "sky"


def test_a_collection_that_gives_indirect_light_only_is_hidden_from_the_camera() -> None:
    collection = bpy.data.collections.new("indirect")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(bpy.data.objects.new("hidden", scenes.mesh()))
    scenes.link("seen", scenes.mesh())
    bpy.context.view_layer.layer_collection.children["indirect"].indirect_only = True
    exported = scenes.export()
    assert place(exported, "hidden").visibility == Visibility(0)
    assert place(exported, "seen").visibility == Visibility.CAMERA


def test_what_objects_ask_for_in_vain_is_named() -> None:
    shown, lamp = scenes.link("shown", scenes.mesh()), scenes.light("POINT")
    group = bpy.data.collections.new("group")
    lamp.light_linking.receiver_collection = group
    shown.is_shadow_catcher = shown.is_holdout = True
    shown.visible_glossy = False
    shown.modifiers.new("hair", "PARTICLE_SYSTEM")
    shown.particle_systems[0].settings.type = "HAIR"
    bpy.context.scene.render.use_motion_blur = True
    notes = Notes()
    scenes.export(notes)
    for what in ("holdout", "particle hair", "ray visibility other than to the camera", "shadow catcher"):
        assert f"Object 'shown': {what} is not there yet" in notes.warnings
    assert "Object 'Point': light linking is not there yet" in notes.warnings
    assert "Scene 'Scene': motion blur is not there yet" in notes.warnings
    assert len(notes.warnings) == 6
