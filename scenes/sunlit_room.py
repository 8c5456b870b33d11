"""A room that sun and sky light through a window, in a wide land: what is drawn of buildings before they are built.

python scenes/sunlit_room.py --output out/sunlit_room.blend
"""

from __future__ import annotations

import argparse
from pathlib import Path

import builder

WIDTH, DEPTH, HEIGHT = 6.0, 4.0, 3.0  # m, along x, y and z
WALL = 0.2  # m
WINDOW = (1.0, 3.0, 0.9, 2.3)  # in the wall at x = WIDTH: y from, y to, z from, z to
LAND = 25.0  # m to each side
SUN_FROM = (10.0, 4.0, 8.0)


def add_room() -> None:
    """Floor, ceiling and walls, one of them around the window."""
    white = builder.diffuse("white", (0.75, 0.73, 0.7))
    wood = builder.diffuse("floor", (0.45, 0.3, 0.2))
    y0, y1, z0, z1 = WINDOW
    outside = WIDTH + WALL
    builder.block("floor", (0, 0, -0.1), (WIDTH, DEPTH, 0), wood)
    builder.block("ceiling", (-WALL, -WALL, HEIGHT), (outside, DEPTH + WALL, HEIGHT + WALL), white)
    builder.block("back wall", (-WALL, DEPTH, -0.1), (outside, DEPTH + WALL, HEIGHT), white)
    builder.block("front wall", (-WALL, -WALL, -0.1), (outside, 0, HEIGHT), white)
    builder.block("left wall", (-WALL, 0, -0.1), (0, DEPTH, HEIGHT), white)
    builder.block("below the window", (WIDTH, 0, -0.1), (outside, DEPTH, z0), white)
    builder.block("above the window", (WIDTH, 0, z1), (outside, DEPTH, HEIGHT), white)
    builder.block("before the window", (WIDTH, 0, z0), (outside, y0, z1), white)
    builder.block("behind the window", (WIDTH, y1, z0), (outside, DEPTH, z1), white)


def add_furniture() -> None:
    """A table, a shelf and a ball."""
    oak, red, blue = (
        builder.diffuse(name, color)
        for name, color in (("oak", (0.5, 0.35, 0.2)), ("red", (0.6, 0.12, 0.1)), ("blue", (0.15, 0.25, 0.6)))
    )
    builder.block("table top", (2.2, 2.0, 0.70), (3.8, 3.0, 0.75), oak)
    for i, (x, y) in enumerate([(2.25, 2.05), (3.69, 2.05), (2.25, 2.89), (3.69, 2.89)]):
        builder.block(f"leg {i}", (x, y, 0), (x + 0.06, y + 0.06, 0.70), oak)
    builder.block("shelf", (4.4, 3.6, 0), (5.6, 3.98, 1.6), blue)
    builder.mesh_sphere("ball", (3.0, 2.5, 0.95), 0.2, 4, red)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, required=True, help="the .blend to write")
    args = parser.parse_args()
    scene = builder.new_file("sunlit_room", 512, 512)
    add_room()
    add_furniture()
    builder.block("land", (-LAND, -LAND, -0.5), (LAND, LAND, -0.1), builder.diffuse("land", (0.25, 0.3, 0.15)))
    sun = builder.bpy.data.lights.new("sun", "SUN")
    sun.energy, sun.color, sun.angle = 15.0, (1.0, 0.9, 0.75), 0.01
    builder.link(sun, "sun").matrix_world = builder.look_at(SUN_FROM, (0, 0, 0))
    builder.set_world(scene, (0.6, 0.8, 1.2))
    builder.camera(scene, (0.3, 0.4, 1.7), (5.0, 2.8, 1.1), 22.0, 32.0, clip_start=0.05)
    builder.save(scene, "sunlit_room", args.output)


if __name__ == "__main__":
    main()
