"""LuxCore as a peer: our scenes in its terms, rendered by its path tracer or its bidirectional one.

What has no equivalent raises `NotConvertible`; `notes` says what is only nearly the same. How the two are brought
together:

- **Lamps** neither block nor reflect light here; in LuxCore they are surfaces. One that hangs right before a diffuse
  surface reflects as that surface does, since it hides it. Elsewhere lamps let light through where all else is diffuse:
  LuxCore then does not show them, but lights by them (BIDIRCPU's indirect room is 2 % too dark with such a lamp); or
  else they are black.
- **Spheres** are instances of one smooth mesh: LuxCore has no spheres.
- **Rough mirrors** here reflect their colour at every angle; LuxCore's metal turns white at grazing angles.
"""

from __future__ import annotations

import time
from functools import cache
from math import atan, degrees, isclose, pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vlp_bpt.errors import Error
from vlp_bpt.render import load_native
from vlp_bpt.scene import (
    AreaLight,
    Camera,
    Film,
    Fresnel,
    Instance,
    LobeKind,
    Material,
    Mesh,
    Projection,
    Scene,
    Visibility,
)
from vlp_bpt.upload import upload

Doubles = NDArray[np.float64]

SMOOTH = 0.0038  # Blender's roughness below which a lobe is a delta distribution
BEHIND = 0.02  # of a lamp's width: what lies closer behind it is hidden by it
RINGS, SEGMENTS = 64, 128  # of the mesh that stands for spheres


class NotConvertible(Error):
    """LuxCore has no equivalent: names the datablock and what about it."""


@cache
def module() -> Any:
    """The pyluxcore module, silent. It replaces malloc, so NumPy has to be there before it."""
    import pyluxcore

    pyluxcore.Init(lambda _: None)
    return pyluxcore


class Session:
    """A render that goes on in slices. engine: PATHCPU or BIDIRCPU; values: further properties of the configuration."""

    def __init__(self, scene: Scene, engine: str, values: dict[str, Any], *, threads: int, seed: int) -> None:
        lux = module()
        self.film = scene.film
        converter = _Converter(scene)
        self.notes = converter.notes
        configuration = {
            "renderengine.type": engine,
            "renderengine.seed": seed + 1,
            "sampler.type": "SOBOL",
            "sampler.sobol.adaptive.strength": 0.0,
            "film.width": scene.film.width,
            "film.height": scene.film.height,
            "film.filter.type": "NONE",  # a box of one pixel
            "film.imagepipelines.0.0.type": "NOP",
            "native.threads.count": threads,
            **values,
        }
        self._session = lux.RenderSession(lux.RenderConfig(_properties(configuration), converter.result))
        self._started = False

    def run(self, seconds: float) -> tuple[float, int]:
        """Renders about so long; returns the seconds that it took and the eye samples that it made."""
        before = self._samples() if self._started else 0
        began = time.perf_counter()
        if self._started:
            self._session.Resume()
        else:
            self._session.Start()
            self._started = True
        time.sleep(seconds)
        self._session.Pause()
        took = time.perf_counter() - began
        return took, self._samples() - before

    def picture(self) -> NDArray[np.float32]:
        """(h, w, 3) linear RGB so far, top row first."""
        pixels = np.zeros((self.film.height, self.film.width, 3), np.float32)
        self._session.GetFilm().GetOutputFloat(module().FilmOutputType.RGB, pixels, 0, True)
        return np.ascontiguousarray(pixels[::-1])

    def stop(self) -> None:
        """Ends the render's threads."""
        if self._started:
            self._session.Stop()

    def _samples(self) -> int:
        self._session.UpdateStats()
        return int(self._session.GetStats().Get("stats.renderengine.total.samplecount").GetFloat())


def _properties(values: dict[str, Any]) -> Any:
    lux = module()
    properties = lux.Properties()
    for name, value in values.items():
        properties.Set(lux.Property(name, value))
    return properties


class _Converter:
    """Fills a scene of LuxCore's: `result`, and `notes` about what is not the same."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.notes = scene, list[str]()
        self.result = module().Scene()
        self.values: dict[str, Any] = {}
        self._meshes: set[str] = set()
        if scene.camera is None:
            raise NotConvertible("the scene has no camera")
        if scene.world.image is not None:
            raise NotConvertible(f"world '{scene.world.name}' has an image")
        self._camera(scene.camera, scene.film)
        for index, material in enumerate(scene.materials):
            self._material(index, material)
        for index, instance in enumerate(scene.instances):
            self._instance(index, instance)
        for index, light in enumerate(scene.lights):
            if not isinstance(light, AreaLight):
                raise NotConvertible(f"light '{light.name}' is a {type(light).__name__}")
            self._lamp(index, light)
        if any(scene.world.radiance):
            self._set("scene.lights.world", type="constantinfinite", color=_list(scene.world.radiance))
        self.result.Parse(_properties(self.values))

    def _set(self, prefix: str, **values: Any) -> None:
        self.values |= {f"{prefix}.{name}": value for name, value in values.items()}

    def _material(self, index: int, material: Material) -> None:
        name = f"scene.materials.m{index}"
        if any(material.emission):
            raise NotConvertible(f"material '{material.name}' shines")
        if len(material.lobes) > 1:
            raise NotConvertible(f"material '{material.name}' has {len(material.lobes)} lobes")
        if not material.lobes:
            self._set(name, type="matte", kd=[0.0, 0.0, 0.0])
            return
        lobe = material.lobes[0]
        smooth = lobe.roughness < SMOOTH
        weight, f0, f82 = (np.asarray(color, np.float64) for color in (lobe.weight, lobe.f0, lobe.f82))
        if lobe.kind == LobeKind.DIFFUSE:
            self._set(name, type="matte", kd=_list(weight))
        elif lobe.kind == LobeKind.REFLECTION and lobe.fresnel == Fresnel.NONE and smooth:
            self._set(name, type="mirror", kr=_list(weight * f0))
        elif lobe.kind == LobeKind.REFLECTION and lobe.fresnel == Fresnel.NONE:
            color = f"scene.textures.m{index}"
            self._set(color, type="fresnelcolor", kr=_list(weight * f0))
            alpha = lobe.roughness**2
            self._set(name, type="metal2", fresnel=f"m{index}", uroughness=alpha, vroughness=alpha)
            self.notes.append(f"material '{material.name}' turns white at grazing angles")
        elif lobe.kind == LobeKind.DIELECTRIC and lobe.fresnel != Fresnel.TINTED_DIELECTRIC and smooth:
            self._set(name, type="glass", kr=_list(weight * f0), kt=_list(weight * f82), interiorior=float(lobe.ior))
        elif lobe.kind == LobeKind.TRANSPARENT and lobe.weight == (1.0, 1.0, 1.0):
            self._set(name, type="null")
        else:
            raise NotConvertible(f"material '{material.name}': {lobe.kind.name} with roughness {lobe.roughness:g}")

    def _instance(self, index: int, instance: Instance) -> None:
        geometry = self.scene.geometries[instance.geometry]
        if not instance.visibility & Visibility.CAMERA:
            raise NotConvertible(f"instance '{instance.name}' is hidden from the camera")
        matrix = np.asarray(instance.transform, np.float64)
        count = len(geometry.triangles if isinstance(geometry, Mesh) else geometry.centers)
        slots = np.zeros(count, np.int32) if geometry.material_index is None else geometry.material_index
        for slot, material in enumerate(instance.materials):
            members = np.flatnonzero(slots == slot)
            if not len(members):
                continue
            name = f"i{index}_{slot}"
            if isinstance(geometry, Mesh):
                points, normals = _placed(geometry, matrix, members)
                self._mesh(name, points, normals)
                self._object(name, name, material)
                continue
            if "ball" not in self._meshes:
                self._mesh("ball", *_ball())
                self.notes.append(f"spheres are meshes of {2 * (RINGS - 1) * SEGMENTS} triangles")
            for i in members:
                placed = np.eye(4)
                placed[:3, :3] = matrix[:, :3] * geometry.radii[i]
                placed[:3, 3] = matrix[:, :3] @ geometry.centers[i] + matrix[:, 3]
                self._object(f"{name}_{i}", "ball", material, placed)

    def _mesh(self, name: str, points: Doubles, normals: Doubles | None) -> None:
        """Triangles by their corners, (n, 3, 3)."""
        corners = [tuple(p) for p in points.reshape(-1, 3).tolist()]
        faces = [(3 * i, 3 * i + 1, 3 * i + 2) for i in range(len(points))]
        turned = None if normals is None else [tuple(n) for n in normals.reshape(-1, 3).tolist()]
        self.result.DefineMesh(name, corners, faces, turned, None, None, None)
        self._meshes.add(name)

    def _object(self, name: str, shape: str, material: int, placed: Doubles | None = None) -> None:
        self._set(f"scene.objects.{name}", shape=shape, material=f"m{material}")
        if placed is not None:
            self._set(f"scene.objects.{name}", transformation=_list(placed.T.ravel()))

    def _lamp(self, index: int, light: AreaLight) -> None:
        if light.ellipse or not isclose(light.spread, pi, rel_tol=1e-5):
            raise NotConvertible(f"light '{light.name}' is an ellipse or has a spread of {light.spread:g}")
        matrix = np.asarray(light.transform, np.float64)
        x, y, at = matrix[:, 0] * light.size[0] / 2, matrix[:, 1] * light.size[1] / 2, matrix[:, 3]
        across = np.cross(x, y)
        if across @ matrix[:, 2] > 0:  # LuxCore shines where the normal points, along -z here
            x, across = -x, -across
        corners = [at - x - y, at + x - y, at + x + y, at - x + y]
        radiance = np.asarray(light.power, np.float64) / (pi * 4 * float(np.linalg.norm(across)))
        name = f"lamp{index}"
        self.result.DefineMesh(
            name, [tuple(c.tolist()) for c in corners], [(0, 1, 2), (0, 2, 3)], None, None, None, None
        )
        self._set(f"scene.objects.{name}", shape=name, material=name)
        if not light.visibility & Visibility.CAMERA:
            self._set(f"scene.objects.{name}", camerainvisible=True)
        reflected = self._hidden_by(light, max(light.size))
        self._set(f"scene.materials.{name}", type="matte", kd=_list(reflected), emission=_list(radiance))
        if reflected.any():
            return
        if all(lobe.kind == LobeKind.DIFFUSE for material in self.scene.materials for lobe in material.lobes):
            self._set(f"scene.materials.{name}", transparency=0.0)
            self.notes.append(f"light '{light.name}' is not seen")
        else:
            self.notes.append(f"light '{light.name}' blocks light")

    def _hidden_by(self, light: AreaLight, width: float) -> Doubles:
        """The reflectance of the diffuse surface right behind a lamp, black where there is none."""
        native = load_native().Scene()
        upload(self.scene, native)
        native.build(1)
        origin, back = (np.ascontiguousarray(light.transform[:, i].reshape(1, 3), np.float32) for i in (3, 2))
        hit = native.intersect(origin, back, np.array([BEHIND * width], np.float32))
        if not np.isfinite(hit["t"][0]) or hit["instance"][0] < 0:
            return np.zeros(3)
        instance = self.scene.instances[int(hit["instance"][0])]
        slots = self.scene.geometries[instance.geometry].material_index
        slot = 0 if slots is None else int(slots[int(hit["primitive"][0])])
        lobes = self.scene.materials[instance.materials[slot]].lobes
        diffuse = [lobe.weight for lobe in lobes if lobe.kind == LobeKind.DIFFUSE]
        return np.asarray(diffuse[0] if diffuse else (0.0, 0.0, 0.0), np.float64)

    def _camera(self, camera: Camera, film: Film) -> None:
        if film.window is not None:
            raise NotConvertible("the film has a window")
        if camera.projection != Projection.PERSPECTIVE or camera.aperture_radius > 0 or camera.shift != (0.0, 0.0):
            raise NotConvertible(f"camera '{camera.name}' is not a pinhole in the middle of its picture")
        matrix = np.asarray(camera.transform, np.float64)
        width, height = camera.half_width, camera.half_height
        least = min(width, height)
        row = 2 * height / film.height  # LuxCore's picture lies one row too low
        self._set(
            "scene.camera",
            type="perspective",
            fieldofview=degrees(2 * atan(least)),
            screenwindow=[-width / least, width / least, (-height - row) / least, (height - row) / least],
            up=_list(matrix[:, 1]),
            cliphither=max(camera.clip_start, 1e-4),
            clipyon=min(camera.clip_end, 1e6),
        )
        self._set("scene.camera.lookat", orig=_list(matrix[:, 3]), target=_list(matrix[:, 3] - matrix[:, 2]))


def _list(values: Any) -> list[float]:
    return [float(value) for value in np.asarray(values).ravel()]


def _placed(geometry: Mesh, matrix: Doubles, members: NDArray[np.intp]) -> tuple[Doubles, Doubles | None]:
    """Triangles in world space by their corners, (n, 3, 3), and their normals; wound so that they face the same way."""
    points = geometry.positions[geometry.triangles[members]] @ matrix[:, :3].T + matrix[:, 3]
    normals = None
    if geometry.corner_normals is not None:
        normals = geometry.corner_normals[members] @ np.linalg.inv(matrix[:, :3])
        normals = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    if np.linalg.det(matrix[:, :3]) < 0:
        points, normals = points[:, ::-1], None if normals is None else normals[:, ::-1]
    return points, normals


def _ball() -> tuple[Doubles, Doubles]:
    """A sphere of radius 1 by its triangles' corners, which are their own normals: (n, 3, 3) twice."""
    theta, phi = np.linspace(0, pi, RINGS + 1)[:, None], np.arange(SEGMENTS + 1) * 2 * pi / SEGMENTS
    across, along = np.sin(theta), np.cos(theta) * np.ones_like(phi)
    grid = np.stack([across * np.cos(phi), across * np.sin(phi), along], axis=-1)
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, :-1], grid[1:, 1:]
    lower = np.stack([a, c, d], axis=-2)[:-1].reshape(-1, 3, 3)
    upper = np.stack([a, d, b], axis=-2)[1:].reshape(-1, 3, 3)
    points = np.concatenate([lower, upper])
    return points, points
