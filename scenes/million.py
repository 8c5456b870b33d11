"""The Cornell room with 48 displaced balls of 20,480 triangles each, 983,040 in all: too large to be kept as a file.

    python scenes/million.py --output out/million.blend

The balls are flat-shaded and their bumps go deep, so that light is caught between them and rays find no order.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import builder
import cornell_box
import numpy as np

BALLS = (4, 3, 4)  # along x, y (away) and z
SUBDIVISIONS = 6  # of an icosahedron: 20 * 4**5 triangles
LOW, HIGH = np.array([-0.21, 0.08, 0.07]), np.array([0.21, 0.48, 0.42])  # of the balls' centres, in metres
RADIUS, DEPTH = 0.055, 0.25  # metres, and the bumps' share of it
COLORS = {"white": (0.74, 0.74, 0.74), "blue": (0.2, 0.35, 0.7), "yellow": (0.75, 0.6, 0.15)}


def ball_mesh(name: str, seed: int) -> builder.bpy.types.Mesh:
    """A ball of radius about RADIUS whose surface is moved in and out by waves of random directions."""
    import bmesh  # which bpy brings with it

    shape = bmesh.new()
    bmesh.ops.create_icosphere(shape, subdivisions=SUBDIVISIONS, radius=1.0)
    data = builder.bpy.data.meshes.new(name)
    shape.to_mesh(data)
    shape.free()
    points = np.empty(3 * len(data.vertices), np.float32)
    data.vertices.foreach_get("co", points)
    points = points.reshape(-1, 3)
    random = np.random.default_rng(seed)
    waves = random.normal(size=(12, 3)) * np.repeat([3.0, 6.0, 12.0], 4)[:, None]
    height = np.sin(points @ waves.T + random.uniform(0, 2 * np.pi, 12)) @ np.repeat([0.5, 0.3, 0.15], 4) / 4
    data.vertices.foreach_set("co", (RADIUS * points * (1 + DEPTH * height[:, None])).astype(np.float32).ravel())
    data.update()
    return data


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, required=True, help="the .blend to write")
    args = parser.parse_args()
    scene = builder.new_file("million", 512, 512)
    cornell_box.add_room(scene)
    materials = [builder.diffuse(f"ball {name}", color) for name, color in COLORS.items()]
    places = np.stack(np.meshgrid(*(np.linspace(0, 1, n) for n in BALLS), indexing="ij"), axis=-1).reshape(-1, 3)
    for i, place in enumerate(places):
        data = ball_mesh(f"ball {i:02}", seed=i)
        data.materials.append(materials[i % len(materials)])
        builder.link(data, data.name).location = LOW + place * (HIGH - LOW)
    builder.save(scene, "million", args.output)


if __name__ == "__main__":
    main()
