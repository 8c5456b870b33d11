"""Point clouds to `vlp_bpt.Spheres`: each point is an analytic sphere, as in Cycles."""

from __future__ import annotations

from typing import Any

import numpy as np

from vlp_bpt.scene import Spheres

DEFAULT_RADIUS = 0.01  # metres: what Blender draws for points without a radius


def export_pointcloud(pointcloud: Any, name: str) -> Spheres | None:
    """The spheres of an evaluated point cloud under `name`, or None where it has no point."""
    count = len(pointcloud.points)
    if count == 0:
        return None
    centers = np.empty(count * 3, np.float32)
    pointcloud.attributes["position"].data.foreach_get("vector", centers)
    radii = np.full(count, DEFAULT_RADIUS, np.float32)
    if "radius" in pointcloud.attributes:
        pointcloud.attributes["radius"].data.foreach_get("value", radii)
    material_index = None
    attribute = pointcloud.attributes.get("material_index")
    if attribute is not None and attribute.data_type == "INT":
        material_index = np.empty(count, np.int32)
        attribute.data.foreach_get("value", material_index)
    return Spheres(name, centers.reshape(-1, 3), radii, material_index)
