"""The scene's camera to `vlp_bpt.Camera`: framing from Blender's own projection matrix, so that both agree."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from vlp_bpt.scene import Camera, Float32, Projection

from .notes import ExportError, Notes

LEAST_FOCUS_DISTANCE = 1e-5  # metres: what stands for zero, as in Cycles


def export_camera(depsgraph: bpy.types.Depsgraph, width: int, height: int, notes: Notes) -> Camera:
    """The camera for a picture of width x height pixels, before any border is cut out of it.

    Raises ExportError without a camera, or with one whose projection is not there yet.
    """
    scene = depsgraph.scene_eval
    if scene.camera is None:
        raise ExportError(f"Scene '{scene.name}' has no camera: add one, or choose one in the scene properties")
    camera_object = scene.camera.evaluated_get(depsgraph)
    data = camera_object.data
    if camera_object.type != "CAMERA":
        raise ExportError(f"Camera '{camera_object.name}' is a {camera_object.type.lower()}, not a camera")
    if data.type not in ("PERSP", "ORTHO"):
        raise ExportError(
            f"Camera '{camera_object.name}': type {data.type} is not there yet, only perspective and orthographic"
        )
    perspective = data.type == "PERSP"
    matrix = np.array(
        camera_object.calc_matrix_camera(
            depsgraph, x=width, y=height, scale_x=scene.render.pixel_aspect_x, scale_y=scene.render.pixel_aspect_y
        )
    )
    center = matrix[:2, 2] if perspective else -matrix[:2, 3]
    half_width, half_height = 1.0 / matrix[0, 0], 1.0 / matrix[1, 1]
    camera = Camera(
        name=camera_object.name,
        transform=rigid(camera_object.matrix_world),
        projection=Projection.PERSPECTIVE if perspective else Projection.ORTHOGRAPHIC,
        half_width=float(half_width),
        half_height=float(half_height),
        shift=(float(center[0] * half_width), float(center[1] * half_height)),
        clip_start=data.clip_start,
        clip_end=data.clip_end,
    )
    if data.dof.use_dof:
        _depth_of_field(camera, camera_object, notes)
    return camera


def _depth_of_field(camera: Camera, camera_object: bpy.types.Object, notes: Notes) -> None:
    """Thin-lens radius and focus as Cycles has them: an orthographic camera counts as a lens of one metre."""
    data = camera_object.data
    lens = data.lens * 1e-3 if data.type == "PERSP" else 1.0
    camera.aperture_radius = lens / (2.0 * max(data.dof.aperture_fstop, 1e-5))
    camera.focus_distance = _focus_distance(camera, data.dof)
    if data.dof.aperture_blades >= 3 or data.dof.aperture_ratio != 1.0:
        notes.warn(f"Camera '{camera_object.name}': aperture blades and ratio are not there yet, the lens is round")


def _focus_distance(camera: Camera, dof: Any) -> float:
    target = dof.focus_object
    if target is None:
        return max(float(dof.focus_distance), LEAST_FOCUS_DISTANCE)
    matrix = target.matrix_world
    if target.type == "ARMATURE" and dof.focus_subtarget:
        bone = target.pose.bones.get(dof.focus_subtarget)
        matrix = matrix @ bone.matrix if bone else matrix
    offset = np.array(matrix.translation) - camera.transform[:, 3]
    return max(abs(float(offset @ camera.transform[:, 2])), LEAST_FOCUS_DISTANCE)


def rigid(matrix: Any) -> Float32:
    """A (3, 4) transform with its axes scaled to one: a camera's or lamp's scale does not change its picture."""
    transform = np.array(matrix, np.float64)[:3]
    lengths = np.linalg.norm(transform[:, :3], axis=0)
    transform[:, :3] /= np.where(lengths > 0, lengths, 1.0)
    return transform.astype(np.float32)
