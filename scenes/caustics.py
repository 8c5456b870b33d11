"""The Cornell box's room with a mirror sphere and a glass sphere, and the caustics they throw."""

from __future__ import annotations

import builder
import cornell_box

LEVELS = 6  # 49,152 triangles a sphere: fine enough to refract as a sphere does
RADIUS = 100.0  # mm
MIRROR_AT, GLASS_AT = (390.0, RADIUS, 370.0), (165.0, RADIUS, 180.0)  # in the box's own millimetres


def main() -> None:
    scene = builder.new_file("caustics", 512, 512)
    cornell_box.add_room(scene)
    mirror = builder.glossy("mirror", (0.95, 0.95, 0.95), 0.0)
    glass = builder.glass("glass", (1.0, 1.0, 1.0), 1.5)
    builder.mesh_sphere("mirror sphere", cornell_box.place(MIRROR_AT), RADIUS / 1000, LEVELS, mirror)
    builder.mesh_sphere("glass sphere", cornell_box.place(GLASS_AT), RADIUS / 1000, LEVELS, glass)
    builder.save(scene, "caustics")


if __name__ == "__main__":
    main()
