"""A diffuse room that no lamp shines into: all its light has bounced next door and comes through a door ajar."""

from __future__ import annotations

from math import cos, radians, sin

import builder
from mathutils import Matrix

HEIGHT, THICK = 2.6, 0.1  # m, of the rooms and of their walls
ROOM = (-2.2, 2.2, -2.4, 1.6)  # the room in view: x from, x to, y from, y to; the other one lies beyond y = 1.6 + THICK
BEYOND = 4.2  # y where the other room ends
DOOR = (0.5, 1.4, 2.05)  # x from, x to, height of the opening
AJAR = 25.0  # degrees


def add_rooms(white: builder.bpy.types.Material, warm: builder.bpy.types.Material) -> None:
    """Floor, ceiling, outer walls, and the wall with the doorway between the two rooms."""
    x0, x1, y0, y1 = ROOM
    t = THICK
    builder.block("floor", (x0 - t, y0 - t, -t), (x1 + t, BEYOND + t, 0), warm)
    builder.block("ceiling", (x0 - t, y0 - t, HEIGHT), (x1 + t, BEYOND + t, HEIGHT + t), white)
    builder.block("left wall", (x0 - t, y0, 0), (x0, BEYOND, HEIGHT), white)
    builder.block("right wall", (x1, y0, 0), (x1 + t, BEYOND, HEIGHT), white)
    builder.block("front wall", (x0 - t, y0 - t, 0), (x1 + t, y0, HEIGHT), white)
    builder.block("far wall", (x0 - t, BEYOND, 0), (x1 + t, BEYOND + t, HEIGHT), white)
    builder.block("wall left of the door", (x0, y1, 0), (DOOR[0], y1 + t, HEIGHT), white)
    builder.block("wall right of the door", (DOOR[1], y1, 0), (x1, y1 + t, HEIGHT), white)
    builder.block("wall over the door", (DOOR[0], y1, DOOR[2]), (DOOR[1], y1 + t, HEIGHT), white)


def add_door(wood: builder.bpy.types.Material) -> None:
    """The panel, hinged on the right of the opening, swung into the room beyond."""
    width, gap = DOOR[1] - DOOR[0] - 0.02, 0.01
    panel = builder.block("door", (-width, 0, gap), (0, 0.04, DOOR[2] - gap), wood)
    hinge = Matrix.Translation((DOOR[1] - 0.01, ROOM[3] + THICK, 0))
    panel.matrix_world = hinge @ Matrix.Rotation(-radians(AJAR), 4, "Z")


def add_furniture() -> None:
    """A table with three things on it."""
    wood = builder.diffuse("table", (0.35, 0.2, 0.1))
    builder.block("table top", (-1.3, -0.1, 0.70), (0.1, 0.7, 0.75), wood)
    for i, (x, y) in enumerate([(-1.25, -0.05), (-0.01, -0.05), (-1.25, 0.59), (-0.01, 0.59)]):
        builder.block(f"leg {i}", (x, y, 0), (x + 0.06, y + 0.06, 0.70), wood)
    green = builder.diffuse("green", (0.2, 0.5, 0.25))
    blue = builder.diffuse("blue", (0.15, 0.25, 0.6))
    red = builder.diffuse("red", (0.65, 0.12, 0.1))
    builder.mesh_sphere("ball", (-0.25, 0.25, 0.93), 0.18, 4, red)
    cube = builder.block("cube", (-0.14, -0.14, 0), (0.14, 0.14, 0.28), blue)
    cube.matrix_world = Matrix.Translation((-0.65, 0.35, 0.75)) @ Matrix.Rotation(radians(30), 4, "Z")
    sides = 24
    ring = [(0.12 * cos(2 * radians(180) * i / sides), 0.12 * sin(2 * radians(180) * i / sides)) for i in range(sides)]
    points = [(x, y, z) for z in (0.0, 0.4) for x, y in ring]
    faces = [(i, (i + 1) % sides, sides + (i + 1) % sides, sides + i) for i in range(sides)]
    faces += [tuple(range(sides))[::-1], tuple(range(sides, 2 * sides))]
    column = builder.mesh("column", points, faces, green)
    column.location = (-1.08, 0.3, 0.75)


def main() -> None:
    scene = builder.new_file("indirect_room", 256, 256)
    white = builder.diffuse("white", (0.75, 0.75, 0.73))
    warm = builder.diffuse("floor", (0.5, 0.42, 0.33))
    wood = builder.diffuse("door", (0.55, 0.38, 0.22))
    add_rooms(white, warm)
    add_door(wood)
    add_furniture()
    # Next door on the left, shining straight at the far wall: it lights nothing with y < 2.1, so nothing on this side.
    builder.area_lamp("light", (800.0, 700.0, 575.0), (0.6, 0.6), (-1.2, 2.1, 1.6), (-1.2, 4.0, 1.6))
    builder.camera(scene, (-0.5, -2.2, 1.45), (-0.05, 1.0, 1.02), 24.0, 32.0, clip_start=0.05)
    builder.save(scene, "indirect_room")


if __name__ == "__main__":
    main()
