"""Scenes of any size for `vlp-bpt bench growth`: a room with bumpy balls and lamps, made of numbers alone."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vlp_bpt.scene import Camera, Film, Instance, Lobe, LobeKind, Material, Mesh, PointLight, Scene

Doubles = NDArray[np.float64]

BALLS = (4, 4, 3)
POWER = 40.0  # W of all lamps together


def balls_and_lamps(triangles: int, lamps: int, side: int) -> Scene:
    """A cube of 2 m, open to the camera, with 48 balls of about `triangles` together and so many lamps; side x side
    pixels. The balls differ, so nothing is instanced; the lamps share the same power."""
    grey, blue = (Lobe(LobeKind.DIFFUSE, color) for color in ((0.7, 0.7, 0.7), (0.3, 0.4, 0.7)))
    scene = Scene(materials=[Material("wall", (grey,)), Material("ball", (blue,))], film=Film(side, side))
    scene.geometries.append(_room())
    scene.instances.append(Instance("room", 0, materials=(0,)))
    places = np.stack(np.meshgrid(*(np.linspace(-0.65, 0.65, n) for n in BALLS), indexing="ij"), -1).reshape(-1, 3)
    for i, place in enumerate(places):
        scene.geometries.append(_ball(f"ball {i}", place, max(triangles // len(places), 8), seed=i))
        scene.instances.append(Instance(f"ball {i}", i + 1, materials=(1,)))
    random = np.random.default_rng(0)
    for i, at in enumerate(random.uniform([-0.9, -0.9, 0.8], [0.9, 0.9, 0.95], (lamps, 3))):
        watts = POWER / lamps
        scene.lights.append(PointLight(f"lamp {i}", (float(at[0]), float(at[1]), float(at[2])), (watts,) * 3, 0.02))
    scene.camera = Camera(
        transform=np.array([[1, 0, 0, 0], [0, 0, -1, -3.4], [0, 1, 0, 0]], np.float32),
        half_width=0.42,
        half_height=0.42,
    )
    return scene


def _room() -> Mesh:
    """Five sides of a cube, without the one towards the camera (-y)."""
    corners = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], np.float32)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 2, 6, 4), (1, 5, 7, 3), (2, 3, 7, 6)]
    return Mesh("room", corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.int32))


def _ball(name: str, center: Doubles, triangles: int, seed: int) -> Mesh:
    """A ball of about so many triangles in rings, its surface moved in and out by waves of random directions."""
    rings = max(2, round(math.sqrt(triangles / 4)))  # 2 * rings segments: 4 rings² triangles, less those at the poles
    segments = 2 * rings
    theta, phi = np.linspace(0, np.pi, rings + 1)[:, None], np.arange(segments) * 2 * np.pi / segments
    grid = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], -1)
    points = grid.reshape(-1, 3)
    random = np.random.default_rng(seed)
    waves = random.normal(size=(3, 6)) * 6
    height = np.sin(points @ waves + random.uniform(0, 6.3, 6)).mean(axis=1)
    i, j = (index.ravel() for index in np.meshgrid(np.arange(rings), np.arange(segments), indexing="ij"))
    a, b = i * segments + j, i * segments + (j + 1) % segments
    c, d = a + segments, b + segments
    upper, lower = np.stack([a, c, d], -1)[i < rings - 1], np.stack([a, d, b], -1)[i > 0]
    moved = center + 0.14 * points * (1 + 0.25 * height[:, None])
    return Mesh(name, moved.astype(np.float32), np.concatenate([upper, lower]))
