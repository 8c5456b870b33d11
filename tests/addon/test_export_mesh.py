"""Exported meshes are bit for bit what Blender's slow, documented calls give."""

from __future__ import annotations

from typing import Any

import bpy
import bpy_scenes as scenes
import numpy as np
import pytest

from addon.export.mesh import export_mesh


def expected(mesh: Any) -> dict[str, Any]:
    """A mesh's triangles through the documented API alone."""
    mesh.calc_loop_triangles()
    corners = np.array([triangle.loops[:] for triangle in mesh.loop_triangles])
    positions = np.array([vertex.co for vertex in mesh.vertices], np.float32)
    layer = next((item for item in mesh.uv_layers if item.active_render), None)
    uv = None if layer is None else np.array([item.uv for item in layer.data], np.float32)[corners]
    return {
        "points": positions[[triangle.vertices[:] for triangle in mesh.loop_triangles]],
        "normals": np.array([item.vector for item in mesh.corner_normals], np.float32)[corners],
        "uv": uv,
        "material": np.array([triangle.material_index for triangle in mesh.loop_triangles]),
    }


def check(mesh: Any) -> Any:
    exported = export_mesh(mesh, "checked")
    assert exported is not None
    wanted = expected(mesh)
    assert np.array_equal(scenes.triangle_points(exported), wanted["points"])
    if exported.corner_normals is not None:
        assert np.array_equal(exported.corner_normals, wanted["normals"])
    else:
        flat = [triangle.normal[:] for triangle in mesh.loop_triangles]
        assert np.allclose(wanted["normals"], np.array(flat, np.float32)[:, None], atol=1e-6)
    if wanted["uv"] is not None:
        assert np.array_equal(next(iter(exported.uvs.values())), wanted["uv"])
    index = exported.material_index
    assert np.array_equal(np.zeros(len(wanted["material"])) if index is None else index, wanted["material"])
    return exported


def add(operator: str, **options: Any) -> Any:
    getattr(bpy.ops.mesh, operator)(**options)
    return bpy.context.object.data


def test_flat_faces_need_no_normals() -> None:
    exported = check(add("primitive_cube_add"))
    assert exported.corner_normals is None
    assert len(exported.triangles) == 12


def test_smooth_faces_have_the_vertices_normals() -> None:
    mesh = add("primitive_uv_sphere_add")
    mesh.shade_smooth()
    assert mesh.normals_domain == "POINT"
    assert check(mesh).corner_normals is not None


def test_sharp_edges_split_normals() -> None:
    mesh = add("primitive_cylinder_add", vertices=24)  # end caps of 24 corners: polygons, not only quads
    mesh.shade_smooth()
    mesh.set_sharp_from_angle(angle=0.6)
    assert mesh.normals_domain == "CORNER"
    assert check(mesh).corner_normals is not None


def test_custom_normals() -> None:
    mesh = add("primitive_grid_add", x_subdivisions=3, y_subdivisions=4)
    mesh.normals_split_custom_set([(0.6, 0.0, 0.8)] * len(mesh.loops))
    assert np.allclose(check(mesh).corner_normals, (0.6, 0.0, 0.8), atol=1e-3)


def test_materials_by_face_of_mixed_polygons() -> None:
    mesh = add("primitive_cone_add", vertices=7, end_fill_type="NGON")
    for _ in range(3):
        mesh.materials.append(bpy.data.materials.new("m"))
    mesh.polygons.foreach_set("material_index", np.arange(len(mesh.polygons), dtype=np.int32) % 3)
    assert set(check(mesh).material_index) == {0, 1, 2}


def test_the_uv_map_for_rendering_is_chosen() -> None:
    mesh = add("primitive_ico_sphere_add", subdivisions=2)
    second = mesh.uv_layers.new(name="second")
    second.data.foreach_set("uv", np.random.default_rng(1).random(2 * len(mesh.loops)).astype(np.float32))
    second.active_render = True
    assert list(check(mesh).uvs) == ["second"]


def test_no_faces_is_no_geometry() -> None:
    assert export_mesh(scenes.mesh("edges", ([(0, 0, 0), (1, 0, 0)], [(0, 1)], [])), "edges") is None
    assert export_mesh(bpy.data.meshes.new("nothing"), "nothing") is None


@pytest.mark.parametrize("levels", [1, 3])
def test_modifiers_are_applied(levels: int) -> None:
    add("primitive_cube_add")
    modifier = bpy.context.object.modifiers.new("subdivide", "SUBSURF")
    modifier.levels = modifier.render_levels = levels
    (geometry,) = scenes.export().geometries
    assert len(geometry.triangles) == 12 * 4**levels


def test_text_curves_surfaces_and_metaballs_come_as_their_meshes() -> None:
    text = scenes.link("Text", bpy.data.curves.new("Text", "FONT"))
    text.data.body = "VLP"
    bpy.ops.curve.primitive_bezier_circle_add()
    bpy.context.object.data.bevel_depth = 0.1
    bpy.ops.object.metaball_add(type="BALL")
    bpy.ops.surface.primitive_nurbs_surface_sphere_add()
    exported = scenes.export()
    names = {instance.name for instance in exported.instances}
    assert names == {"Text", "BézierCircle", "Mball", "SurfSphere"} or len(names) == 4
    for instance in exported.instances:
        assert len(exported.geometries[instance.geometry].triangles) > 10, instance.name
    shown = text.evaluated_get(bpy.context.evaluated_depsgraph_get())
    wanted = expected(shown.to_mesh())["points"]
    shown.to_mesh_clear()
    (placed,) = (instance for instance in exported.instances if instance.name == "Text")
    assert np.array_equal(scenes.triangle_points(exported.geometries[placed.geometry]), wanted)


def test_an_object_in_edit_mode_is_exported() -> None:
    add("primitive_cube_add")
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        (geometry,) = scenes.export().geometries
        assert len(geometry.triangles) == 12
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
