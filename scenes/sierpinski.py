"""A Sierpinski pyramid of 781 spheres and two companions, 783 spheres of different sizes in empty space.

A square pyramid with all edges equal is five pyramids of half its size, one in each corner of its base and one on top,
and a hole between them. Each pyramid of the subdivision gets one sphere, the largest one around its axis that fits into
its hole, so 1 + 5 + 25 + 125 + 625 = 781 spheres in five generations, each half the size of the one before, and none
touches another. A mirror and a glass sphere stand beside the pyramid: 783.

    python scenes/sierpinski.py              writes sierpinski.blend: point clouds, so every sphere is analytic
    python scenes/sierpinski.py --mesh PATH [--levels N]
        writes the same spheres as instances of smooth meshes of 12 * 4**N triangles, for renderers whose point
        clouds are not spheres everywhere (Cycles' are not inside glass)
"""

from __future__ import annotations

import argparse
from pathlib import Path

import builder
import numpy as np

GENERATIONS = 5
HEIGHT = np.sqrt(2.0)  # of a pyramid whose base is the square from (-1, -1) to (1, 1): edges of length 2
HOLE_HEIGHT = np.sqrt(2.0) - 1.0  # of the hole's centre: it touches the upper pyramid's base and the four
HOLE_RADIUS = 1.0 - np.sqrt(0.5)  # inner edges of the lower pyramids, z = h/2 and the lines from 0 to (±1, ±1, h) / 2
CORNERS = np.array([(-1, -1, 0), (1, -1, 0), (-1, 1, 0), (1, 1, 0), (0, 0, HEIGHT)])

COMPANION_RADIUS = 0.27
MIRROR_AT, GLASS_AT = (-0.9, -0.1, 1.0), (0.62, -1.3, 0.92)


def generations() -> list[tuple[np.ndarray, np.ndarray]]:
    """Centres (5**g, 3) and radii (5**g,) of each generation g, in metres."""
    centers = np.array([(0.0, 0.0, HOLE_HEIGHT)])
    result = []
    for g in range(GENERATIONS):
        result.append((centers, np.full(len(centers), HOLE_RADIUS / 2**g)))
        centers = np.concatenate([(centers + corner) / 2 for corner in CORNERS])
    return result


def clouds() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """The spheres of each object: name -> centres (n, 3), radii (n,)."""
    g = generations()
    mirror_c, mirror_r = np.vstack([g[0][0], MIRROR_AT]), np.append(g[0][1], COMPANION_RADIUS)
    glass_c, glass_r = np.vstack([g[1][0], GLASS_AT]), np.append(g[1][1], COMPANION_RADIUS)
    return {
        "mirror": (mirror_c, mirror_r),
        "glass": (glass_c, glass_r),
        "glossy": g[2],
        "diffuse red": g[3],
        "diffuse blue": g[4],
    }


def materials() -> dict[str, builder.bpy.types.Material]:
    """One material for each object of `clouds`."""
    return {
        "mirror": builder.glossy("mirror", (0.9, 0.9, 0.9), 0.0),
        "glass": builder.glass("glass", (0.8, 0.97, 0.9), 1.5),
        "glossy": builder.glossy("glossy", (0.9, 0.65, 0.3), 0.3),
        "diffuse red": builder.diffuse("diffuse red", (0.7, 0.15, 0.1)),
        "diffuse blue": builder.diffuse("diffuse blue", (0.2, 0.4, 0.75)),
    }


def add_instances(
    name: str, centers: np.ndarray, radii: np.ndarray, levels: int, material: builder.bpy.types.Material
) -> None:
    """The same spheres as instances of one smooth mesh."""
    data = builder.applied(builder.mesh_sphere(name, (0, 0, 0), 1.0, levels, material))
    for i, (center, radius) in enumerate(zip(centers, radii, strict=True)):
        obj = builder.link(data, f"{name}.{i:03}")
        obj.location, obj.scale = center, (radius,) * 3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mesh", type=Path, help="write the variant made of meshes to this file")
    parser.add_argument("--levels", type=int, default=3, help="subdivisions of the meshes")
    args = parser.parse_args()

    scene = builder.new_file("sierpinski", 512, 512)
    builder.set_world(scene, (0.06, 0.075, 0.1))
    material = materials()
    count = 0
    for name, (centers, radii) in clouds().items():
        if args.mesh:
            add_instances(name, centers, radii, args.levels, material[name])
        else:
            builder.spheres(name, centers, radii, material[name])
        count += len(centers)
    print(count, "spheres")
    builder.area_lamp("light", (34.0, 31.0, 27.0), (1.0, 1.0), (-1.6, -2.6, 3.2), (0.0, 0.0, 0.5))
    builder.camera(scene, (0.75, -4.5, 1.5), (0.06, 0.0, 0.55), 56.0, 36.0, clip_start=0.1)
    builder.save(scene, "sierpinski", args.mesh)


if __name__ == "__main__":
    main()
