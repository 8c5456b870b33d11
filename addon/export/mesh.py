"""Evaluated meshes to `vlp_bpt.Mesh`: bulk reads only, through attributes or the arrays behind them.

`vertices.foreach_get('co')` and `loop_triangles.foreach_get(...)` cost 50 to 200 times what these reads do.
"""

from __future__ import annotations

import ctypes
from typing import Any

import bpy
import numpy as np

from vlp_bpt.scene import Float32, Int32, Mesh


def export_mesh(mesh: bpy.types.Mesh, name: str) -> Mesh | None:
    """The triangles of an evaluated mesh under `name`, or None where it has no face."""
    mesh.calc_loop_triangles()
    if not mesh.loop_triangles:
        return None
    corners = _triangle_corners(mesh)
    triangles = _gather(_attribute(mesh, ".corner_vert", "value", np.int32, 1), corners)
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    return Mesh(
        name=name,
        positions=_attribute(mesh, "position", "vector", np.float32, 3),
        triangles=triangles,
        corner_normals=_corner_normals(mesh, corners, triangles),
        uvs={} if layer is None else {layer.name: _gather(_read(layer.uv, "vector", np.float32, 2), corners)},
        material_index=_material_index(mesh, len(triangles)),
    )


def _corner_normals(mesh: bpy.types.Mesh, corners: Int32, triangles: Int32) -> Float32 | None:
    """Normals at each triangle's corners, or None where every face is flat."""
    if mesh.normals_domain == "FACE":
        return None
    if mesh.normals_domain == "POINT":
        return _gather(_read(mesh.vertex_normals, "vector", np.float32, 3), triangles)
    return _gather(_read(mesh.corner_normals, "vector", np.float32, 3), corners)


def _material_index(mesh: bpy.types.Mesh, triangle_count: int) -> Int32 | None:
    """The material slot of each triangle, or None where it is the first everywhere."""
    if "material_index" not in mesh.attributes:
        return None
    of_polygon = _attribute(mesh, "material_index", "value", np.int32, 1)
    if not of_polygon.any():
        return None
    return np.repeat(of_polygon, _triangles_in_polygons(mesh, triangle_count))


def _triangles_in_polygons(mesh: bpy.types.Mesh, triangle_count: int) -> Int32:
    """How many triangles each polygon was cut into: its corners less two. Triangles lie in the polygons' order."""
    count = len(mesh.polygons)
    offsets = _memory(mesh.polygons, np.int32, count + 1)
    if offsets[0] != 0 or offsets[count] != len(mesh.loops):  # not the layout that we know
        offsets = np.append(_read(mesh.polygons, "loop_start", np.int32, 1), np.int32(len(mesh.loops)))
    sizes = np.diff(offsets) - 2
    if int(sizes.sum()) != triangle_count or sizes.min() < 0:
        of_triangle = _read(mesh.loop_triangles, "polygon_index", np.int32, 1)
        sizes = np.bincount(of_triangle, minlength=count).astype(np.int32)
    return sizes


def _triangle_corners(mesh: bpy.types.Mesh) -> Int32:
    """(T, 3) corner (loop) indices of each triangle: Blender keeps exactly this array behind `loop_triangles`."""
    count = len(mesh.loop_triangles)
    corners = _memory(mesh.loop_triangles, np.int32, 3 * count).reshape(count, 3)
    if all(tuple(corners[i]) == tuple(mesh.loop_triangles[i].loops) for i in (0, count // 2, count - 1)):
        return corners
    return _read(mesh.loop_triangles, "loops", np.int32, 3)


def _attribute(geometry: Any, name: str, field: str, dtype: Any, width: int) -> Any:
    return _read(geometry.attributes[name].data, field, dtype, width)


def _read(collection: Any, field: str, dtype: Any, width: int) -> Any:
    """A collection's field as an array of (count, width), or (count,) where the width is one."""
    values = np.empty(len(collection) * width, dtype)
    collection.foreach_get(field, values)
    return values.reshape(-1, width) if width > 1 else values


def _gather(values: Any, index: Int32) -> Any:
    """values[index], some five times as fast: Blender's indices need no check."""
    return np.take(values, index, axis=0, mode="clip")


def _memory(collection: Any, dtype: Any, count: int) -> Any:
    """A copy of the array that a collection stands on. Only valid while its evaluated mesh lives."""
    size = count * np.dtype(dtype).itemsize
    source = (ctypes.c_char * size).from_address(collection[0].as_pointer())
    return np.frombuffer(source, dtype, count).copy()
