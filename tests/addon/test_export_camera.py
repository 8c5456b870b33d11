"""A point that Blender sees at some place of the picture lies at that place for the exported camera too."""

from __future__ import annotations

from typing import Any

import bpy
import bpy_scenes as scenes
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector

from addon.export.notes import Notes
from vlp_bpt.scene import Camera, Projection

POINTS = [(0.3, 0.2, -2.0), (-0.5, 0.4, -1.0), (0.0, 0.0, 0.0), (0.7, -0.6, 1.0)]


def project(camera: Camera, point: Any) -> tuple[float, float]:
    """Where a point lies in the picture, 0 to 1 from its lower left corner: the meaning of `vlp_bpt.Camera`."""
    transform = np.asarray(camera.transform, np.float64)
    x, y, z = transform[:, :3].T @ (np.asarray(point) - transform[:, 3])
    depth = -z if camera.projection == Projection.PERSPECTIVE else 1.0
    return (
        0.5 + 0.5 * (x / depth - camera.shift[0]) / camera.half_width,
        0.5 + 0.5 * (y / depth - camera.shift[1]) / camera.half_height,
    )


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
@pytest.mark.parametrize(
    "size, aspect", [((64, 48), (1, 1)), ((48, 64), (1, 1)), ((64, 48), (1, 2)), ((60, 60), (3, 2))]
)
def test_framing(kind: str, fit: str, size: tuple[int, int], aspect: tuple[float, float]) -> None:
    shown = scenes.camera(
        type=kind, sensor_fit=fit, lens=35, sensor_height=20, ortho_scale=4, shift_x=0.2, shift_y=-0.1
    )
    shown.location = (0.5, -0.3, 5)
    shown.rotation_euler = (0.1, 0.2, 0.3)
    shown.scale = (2, 2, 2)  # does not change the picture
    settings = bpy.context.scene.render
    settings.resolution_x, settings.resolution_y = size
    settings.pixel_aspect_x, settings.pixel_aspect_y = aspect
    camera = scenes.export().camera
    for point in POINTS:
        seen = world_to_camera_view(bpy.context.scene, shown, Vector(point))
        assert project(camera, point) == pytest.approx((seen.x, seen.y), abs=2e-5)


def test_clipping() -> None:
    scenes.camera(clip_start=0.5, clip_end=20)
    camera = scenes.export().camera
    assert (camera.clip_start, camera.clip_end) == (0.5, 20)


def test_no_depth_of_field() -> None:
    scenes.camera()
    assert scenes.export().camera.aperture_radius == 0


def test_depth_of_field_by_distance() -> None:
    dof = scenes.camera(lens=50).data.dof
    dof.use_dof, dof.aperture_fstop, dof.focus_distance = True, 2.0, 3.0
    camera = scenes.export().camera
    assert camera.aperture_radius == pytest.approx(0.05 / 4)
    assert camera.focus_distance == 3


def test_a_focus_distance_of_zero_can_be_rendered() -> None:
    camera = scenes.camera()
    camera.data.dof.use_dof, camera.data.dof.focus_distance = True, 0.0
    exported = scenes.export()
    exported.validate()
    assert 0 < exported.camera.focus_distance < 1e-3


def test_depth_of_field_by_object_counts_along_the_view() -> None:
    dof = scenes.camera().data.dof
    target = scenes.link("target", None)
    target.location = (3, 4, 1)
    dof.use_dof, dof.focus_object = True, target
    assert scenes.export().camera.focus_distance == pytest.approx(4)


def test_depth_of_field_of_an_orthographic_camera() -> None:
    dof = scenes.camera(type="ORTHO").data.dof
    dof.use_dof, dof.aperture_fstop = True, 4.0
    assert scenes.export().camera.aperture_radius == pytest.approx(1 / 8)


def test_aperture_blades_are_reported() -> None:
    dof = scenes.camera().data.dof
    dof.use_dof, dof.aperture_blades = True, 6
    notes = Notes()
    scenes.export(notes)
    assert len(notes.warnings) == 1
    assert "'Camera'" in notes.warnings[0]
