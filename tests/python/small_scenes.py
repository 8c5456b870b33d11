"""Small scenes for the tests of the package: one that renders in milliseconds, one that has something of everything."""

from __future__ import annotations

import numpy as np

from vlp_bpt.scene import (
    AreaLight,
    Camera,
    Film,
    Fresnel,
    Instance,
    Lobe,
    LobeKind,
    Material,
    Mesh,
    PointLight,
    Projection,
    Scene,
    Spheres,
    SpotLight,
    SunLight,
    Visibility,
    World,
)


def room(width: int = 16, height: int = 12) -> Scene:
    """A grey box, open towards the camera, with an area light under its ceiling."""
    corners = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], dtype=np.float32)
    quads = [(0, 1, 3, 2), (0, 2, 6, 4), (1, 5, 7, 3), (2, 3, 7, 6), (0, 4, 5, 1)]
    triangles = [corner for a, b, c, d in quads for corner in ((a, b, c), (a, c, d))]
    grey = Material("grey", (Lobe(LobeKind.DIFFUSE, (0.7, 0.7, 0.7)),))
    lamp = AreaLight("lamp", [[1, 0, 0, 0], [0, 0, 1, 0.9], [0, 1, 0, 0]], (10, 10, 10), (0.5, 0.5))  # type: ignore[arg-type]
    camera = Camera(transform=[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 3.5]])  # type: ignore[arg-type]
    mesh = Mesh("room", corners, np.array(triangles, dtype=np.int32))
    return Scene([mesh], [Instance("room", 0)], [grey], [lamp], camera=camera, film=Film(width, height))


def everything(seed: int = 1) -> Scene:
    """Every kind of datablock with every field away from its default."""
    random = np.random.default_rng(seed)

    def transform() -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
        return np.asarray(random.normal(size=(3, 4)), dtype=np.float32)

    mesh = Mesh(
        "Käfer",
        random.normal(size=(20, 3)).astype(np.float32),
        random.integers(0, 20, (9, 3)).astype(np.int32),
        random.normal(size=(9, 3, 3)).astype(np.float32),
        {"UVMap": random.random((9, 3, 2)).astype(np.float32), "$array": random.random((9, 3, 2)).astype(np.float32)},
        random.integers(0, 2, 9).astype(np.int32),
    )
    spheres = Spheres("balls", random.normal(size=(5, 3)), random.random(5), np.array([0, 1, 0, 1, 0]))  # type: ignore[arg-type]
    lobes = (
        Lobe(LobeKind.REFLECTION, (0.1, 0.2, 0.3), 0.3, 1.33, Fresnel.CONDUCTOR, (0.2, 0.9, 1.5), (3, 2, 1.9)),
        Lobe(LobeKind.DIFFUSE, (0.5, 1e-40, 0.5), layered_under=0, compensate=True),
    )
    return Scene(
        geometries=[mesh, spheres, Mesh("empty", np.zeros((0, 3)), np.zeros((0, 3), dtype=int))],  # type: ignore[arg-type]
        instances=[
            Instance("one", 0, transform(), (1, 0, 1), Visibility(0)),
            Instance("two", 1, transform(), (0,)),
            Instance("three", 2),
        ],
        materials=[Material("layers", lobes, (1.5, 0.0, 0.25)), Material("nothing")],
        lights=[
            PointLight("point", (1, 2, 3), (4, 5, 6), 0.25, Visibility.CAMERA),
            SpotLight("spot", transform(), (1, 1, 1), 1.0, 0.5, 0.1, Visibility.CAMERA),
            SunLight("sun", transform(), (2, 2, 2), 0.01, Visibility.CAMERA),
            AreaLight("area", transform(), (3, 3, 3), (0.5, 0.25), True, 1.5, Visibility.CAMERA),
        ],
        world=World("sky", (0.1, 0.2, 0.4), random.random((4, 8, 3)), [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]),  # type: ignore[arg-type]
        camera=Camera("cam", transform(), Projection.ORTHOGRAPHIC, 3, 2, (0.1, -0.2), 0.1, float("inf"), 0.01, 4),
        film=Film(64, 48, (3, 5, 20, 10), True),
    )
