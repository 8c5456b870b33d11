"""Small scenes made in Python, and what tests need to render and compare them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from stats import mean_p, sidak

from vlp_bpt import Renderer, RenderSettings, Scene
from vlp_bpt.scene import Camera, Film, Instance, Lobe, LobeKind, Material, Mesh, Projection, Spheres

Array = NDArray[np.float64]
Point = tuple[float, float, float]

DIFFUSE_HALF = Material("half", (Lobe(LobeKind.DIFFUSE, (0.5, 0.5, 0.5)),))


def grey(albedo: float, emission: float = 0.0) -> Material:
    return Material(f"grey {albedo} {emission}", (Lobe(LobeKind.DIFFUSE, (albedo,) * 3),), (emission,) * 3)


def quad(*corners: Point, name: str = "quad") -> Mesh:
    """Four corners, counter-clockwise from where the normal points."""
    return Mesh(name, np.array(corners, np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.int32))


def square(side: float, center: Point = (0, 0, 0), name: str = "square") -> Mesh:
    """In the plane of constant z, its normal along +z."""
    x, y, z = center
    h = side / 2
    return quad((x - h, y - h, z), (x + h, y - h, z), (x + h, y + h, z), (x - h, y + h, z), name=name)


def cube(side: float = 2.0, inward: bool = False) -> Mesh:
    """Around the origin; its sides face outward, or inward."""
    h = side / 2
    corners = np.array([[x, y, z] for z in (-h, h) for y in (-h, h) for x in (-h, h)], np.float32)
    triangles = np.array(
        [[0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4],
         [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5]], np.int32)  # fmt: skip
    return Mesh("cube", corners, triangles[:, ::-1] if inward else triangles)


def ball(rings: int = 12, segments: int = 24, smooth: bool = True, inward: bool = False) -> Mesh:
    """A mesh of radius 1 around the origin, with the normals of a round one where it is `smooth`."""
    theta, phi = np.linspace(0, np.pi, rings + 1), np.arange(segments) * 2 * np.pi / segments
    sin, cos = np.sin(theta)[:, None], np.cos(theta)[:, None]
    grid = np.stack(np.broadcast_arrays(sin * np.cos(phi), sin * np.sin(phi), cos), axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rings), np.arange(segments), indexing="ij")
    a, b = i * segments + j, i * segments + (j + 1) % segments
    c, d = a + segments, b + segments
    triangles = np.concatenate(
        [np.stack([a, c, d], -1)[:-1].reshape(-1, 3), np.stack([a, d, b], -1)[1:].reshape(-1, 3)]
    )
    if inward:
        triangles = triangles[:, ::-1]
    normals = grid[triangles] * (-1 if inward else 1) if smooth else None
    return Mesh("ball", grid, triangles, normals)


def sphere(center: Point = (0, 0, 0), radius: float = 1.0) -> Spheres:
    return Spheres("sphere", np.array([center], np.float32), np.array([radius], np.float32))


def transform(position: Point = (0, 0, 0), scale: Point = (1, 1, 1)) -> NDArray[np.float32]:
    matrix = np.zeros((3, 4), np.float32)
    matrix[:, :3] = np.diag(scale)
    matrix[:, 3] = position
    return matrix


def looking(eye: Point, target: Point, half_size: float, up: Point = (0, 0, 1), **options: Any) -> Camera:
    back = np.subtract(eye, target) / np.linalg.norm(np.subtract(eye, target))
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    matrix = np.stack([right, np.cross(back, right), back, np.array(eye, float)], axis=1)
    return Camera(transform=matrix, half_width=half_size, half_height=half_size, **options)


def from_above(height: float, half_size: float) -> Camera:
    """Looks straight down with parallel rays: pixel (x, y) sees (x, y) of the ground, in metres from the centre."""
    return Camera(
        transform=transform((0, 0, height)),
        projection=Projection.ORTHOGRAPHIC,
        half_width=half_size,
        half_height=half_size,
    )


class Builder:
    """Fills a scene, one object after the other."""

    def __init__(self, pixels: int | tuple[int, int] = 16, camera: Camera | None = None) -> None:
        width, height = (pixels, pixels) if isinstance(pixels, int) else pixels
        self.scene = Scene(film=Film(width, height))
        if camera is not None:
            self.scene.camera = camera

    def add(self, geometry: Mesh | Spheres, material: Material, matrix: NDArray[np.float32] | None = None) -> Builder:
        if material not in self.scene.materials:
            self.scene.materials.append(material)
        self.scene.geometries.append(geometry)
        self.scene.instances.append(
            Instance(
                f"{geometry.name} {len(self.scene.instances)}",
                len(self.scene.geometries) - 1,
                transform() if matrix is None else matrix,
                (self.scene.materials.index(material),),
            )
        )
        return self


def settings(**values: Any) -> RenderSettings:
    """Few and fixed, for tests: one thread for each of the two processors, a box filter; as many samples everywhere,
    so that means of pixels are nearly normal."""
    defaults: dict[str, Any] = {
        "samples": 16, "light_path_length": 3, "eye_path_length": 5, "light_paths": 256, "vlp_connections": 1,
        "light_samples": 1, "adaptive": False, "filter": "BOX", "filter_width": 1.0, "threads": 2,
    }  # fmt: skip
    return RenderSettings.from_dict(defaults | values)


def render(scene: Scene, options: RenderSettings) -> Array:
    """The picture (h, w, 3), without alpha."""
    renderer = Renderer(scene, options)
    renderer.iterate(options.samples)
    assert renderer.statistics.dropped == 0
    return renderer.read()[..., :3].astype(np.float64)


def batches(scene: Scene, options: RenderSettings, count: int = 8, seed: int = 0) -> Array:
    """Independent pictures (count, h, w, 3) of seeds `seed`, `seed` + 1, ..."""
    values = options.to_dict()
    return np.stack([render(scene, RenderSettings.from_dict(values | {"seed": seed + i})) for i in range(count)])


def blocks(pictures: Array, side: int = 4) -> Array:
    """Means over blocks of side x side pixels: (n, h, w, c) -> (n, h / side, w / side, c)."""
    n, h, w, c = pictures.shape
    return pictures.reshape(n, h // side, side, w // side, side, c).mean(axis=(2, 4))


def assert_same_mean(a: Array, b: Array, what: str, false_alarm: float = 1e-4) -> None:
    """Sets of batches (n, ...) have equal means: t-tests of every element with Sidak's correction; prints figures."""
    p = mean_p(a, b)
    threshold = sidak(false_alarm, p.size)
    noise = np.sqrt(a.var(axis=0, ddof=1) / len(a) + b.var(axis=0, ddof=1) / len(b))
    level = np.abs(b.mean(axis=0))
    ratio = a.mean() / b.mean()
    typical = np.median(noise / level)
    print(f"{what}: ratio of means {ratio:.4f}, noise of an element {typical:.2%}, smallest p {p.min():.2g}")
    assert p.min() >= threshold, (
        f"{what}: p = {p.min():.2g} < {threshold:.2g} at {np.unravel_index(p.argmin(), p.shape)}"
    )


def assert_mean(
    a: Array, expected: Array | float, what: str, false_alarm: float = 1e-4, rounding: float = 1e-5
) -> None:
    """Batches (n, ...) have the expected means: t-tests of every element with Sidak's correction. `rounding` is the
    relative error that single precision may leave."""
    expected = np.broadcast_to(np.asarray(expected, float), a.shape[1:])
    exact = np.repeat(expected[None], len(a), axis=0)
    excess = np.abs(a.mean(axis=0) - expected) - rounding * np.abs(expected)
    p = np.where(excess <= 0, 1.0, mean_p(a, exact))
    threshold = sidak(false_alarm, p.size)
    ratio, noise = a.mean() / expected.mean(), np.median(a.std(axis=0, ddof=1) / len(a) ** 0.5) / expected.mean()
    print(f"{what}: {ratio:.5f} times the expected, noise of an element {noise:.2%}, smallest p {p.min():.2g}")
    assert p.min() >= threshold, (
        f"{what}: p = {p.min():.2g} < {threshold:.2g} at {np.unravel_index(p.argmin(), p.shape)}"
    )
