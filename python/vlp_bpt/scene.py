"""Scenes as validated dataclasses of numpy arrays: what the add-on exports and the native core renders.

Units are Blender's: metres, watts, radians, linear Rec. 709 colour. Matrices map column vectors, (3, 4) affine.
Array fields accept anything that `numpy.asarray` does and are kept C-contiguous in the stated dtype, without a copy
where they are already; a wrong shape raises `SceneError`. `Scene.validate` checks what the values say.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum, IntFlag

import numpy as np
from numpy.typing import NDArray

from . import _arrays

Float32 = NDArray[np.float32]
Int32 = NDArray[np.int32]
Rgb = tuple[float, float, float]

IDENTITY: Float32 = np.eye(3, 4, dtype=np.float32)


class LobeKind(IntEnum):
    """The scattering lobes; the same numbers as `LobeKind` in native/scene/material.h."""

    DIFFUSE = 0  # Lambertian reflection
    TRANSLUCENT = 1  # Lambertian transmission
    REFLECTION = 2  # GGX reflection with a Fresnel term of `fresnel`; a mirror when roughness is 0
    DIELECTRIC = 3  # GGX reflection and refraction shared by the dielectric Fresnel term (glass)
    REFRACTION = 4  # GGX refraction alone, without Fresnel
    TRANSPARENT = 5  # passes straight through; never a path vertex


class Fresnel(IntEnum):
    """The Fresnel term of a REFLECTION lobe; the same numbers as `Fresnel` in native/scene/material.h."""

    NONE = 0  # reflects `f0` at every angle (Blender's Glossy BSDF)
    DIELECTRIC = 1  # unpolarised dielectric of index `ior`, its reflection tinted by `f0`
    SCHLICK = 2  # `f0` at normal incidence, `f82` tint near 82 degrees (Principled metal)
    CONDUCTOR = 3  # complex index: `f0` holds eta and `f82` holds k, per channel
    TINTED_DIELECTRIC = 4  # as DIELECTRIC, but `f0` tints normal incidence alone (Principled's specular tint)


class Visibility(IntFlag):
    """Which rays see an instance or a lamp; the same bits as in native/scene/scene_view.h."""

    CAMERA = 1
    ALL = 1


@dataclass(frozen=True)
class Lobe:
    """One scattering lobe of a material.

    `weight` scales the whole lobe; its own colours are `f0` and `f82` (see `Fresnel`), so that mixing leaves them be.
    A DIELECTRIC lobe has a DIELECTRIC or TINTED_DIELECTRIC term (NONE is read as DIELECTRIC), and `f82` tints what it
    refracts; so does the `f82` of a REFRACTION.
    `roughness` is Blender's: alpha = roughness**2; below 0.0038 the lobe is specular (a delta distribution).
    `layered_under` names the index, in the material's tuple, of the lobe that lies above this one: its light is
    reduced by what that lobe reflects (Principled's diffuse base under its specular layer), -1 for none.
    `compensate` adds back the energy that single-scattering GGX loses (Blender's MULTI_GGX).
    """

    kind: LobeKind
    weight: Rgb = (1.0, 1.0, 1.0)
    roughness: float = 0.0
    ior: float = 1.5
    fresnel: Fresnel = Fresnel.NONE
    f0: Rgb = (1.0, 1.0, 1.0)
    f82: Rgb = (1.0, 1.0, 1.0)
    layered_under: int = -1
    compensate: bool = False


@dataclass(frozen=True)
class Material:
    """A surface: a weighted list of lobes and the radiance it emits on both sides (W / m² / sr)."""

    name: str = "material"
    lobes: tuple[Lobe, ...] = ()
    emission: Rgb = (0.0, 0.0, 0.0)


@dataclass
class Mesh:
    """A triangle mesh in its own space.

    positions (V, 3) float32; triangles (T, 3) int32 into positions; corner_normals (T, 3, 3) float32 or None when
    flat; uvs: name -> (T, 3, 2) float32, the first is the active one; material_index (T,) int32 slot per triangle
    or None for slot 0.
    """

    name: str
    positions: Float32
    triangles: Int32
    corner_normals: Float32 | None = None
    uvs: dict[str, Float32] = field(default_factory=dict)
    material_index: Int32 | None = None

    def __post_init__(self) -> None:
        where = f"mesh '{self.name}'"
        self.positions = _arrays.float32(f"{where}: positions", self.positions, (None, 3))
        self.triangles = _arrays.int32(f"{where}: triangles", self.triangles, (None, 3))
        count = len(self.triangles)
        if self.corner_normals is not None:
            self.corner_normals = _arrays.float32(f"{where}: corner_normals", self.corner_normals, (count, 3, 3))
        self.uvs = {name: _arrays.float32(f"{where}: uvs '{name}'", uv, (count, 3, 2)) for name, uv in self.uvs.items()}
        if self.material_index is not None:
            self.material_index = _arrays.int32(f"{where}: material_index", self.material_index, (count,))


@dataclass
class Spheres:
    """Analytic spheres in their own space: centers (N, 3), radii (N,) float32, material_index (N,) int32 or None."""

    name: str
    centers: Float32
    radii: Float32
    material_index: Int32 | None = None

    def __post_init__(self) -> None:
        where = f"spheres '{self.name}'"
        self.centers = _arrays.float32(f"{where}: centers", self.centers, (None, 3))
        self.radii = _arrays.float32(f"{where}: radii", self.radii, (len(self.centers),))
        if self.material_index is not None:
            self.material_index = _arrays.int32(f"{where}: material_index", self.material_index, (len(self.centers),))


@dataclass
class Instance:
    """A placed geometry: index into `Scene.geometries`, object-to-world (3, 4), a scene material for each slot."""

    name: str
    geometry: int
    transform: Float32 = field(default_factory=lambda: IDENTITY.copy())
    materials: tuple[int, ...] = (0,)
    visibility: Visibility = Visibility.ALL

    def __post_init__(self) -> None:
        self.transform = _arrays.float32(f"instance '{self.name}': transform", self.transform, (3, 4))


@dataclass
class PointLight:
    """A sphere of `radius` (0: a point) that emits `power` watts per channel: intensity power / (4 pi) W/sr."""

    name: str
    position: Rgb
    power: Rgb
    radius: float = 0.0
    visibility: Visibility = Visibility(0)


@dataclass
class SpotLight:
    """A point light seen through a cone along -z of `transform`: full angle `spot_size`, soft edge share `blend`.

    Its intensity on the axis is power / (4 pi), as Blender's: the cone takes light away, it does not concentrate it.
    """

    name: str
    transform: Float32
    power: Rgb
    spot_size: float = 0.785398
    blend: float = 0.15
    radius: float = 0.0
    visibility: Visibility = Visibility(0)

    def __post_init__(self) -> None:
        self.transform = _arrays.float32(f"spot light '{self.name}': transform", self.transform, (3, 4))


@dataclass
class SunLight:
    """Light from infinity along -z of `transform`: `irradiance` W/m² per channel on a facing surface, disc of full
    `angle` (0: a delta direction)."""

    name: str
    transform: Float32
    irradiance: Rgb
    angle: float = 0.0
    visibility: Visibility = Visibility(0)

    def __post_init__(self) -> None:
        self.transform = _arrays.float32(f"sun light '{self.name}': transform", self.transform, (3, 4))


@dataclass
class AreaLight:
    """A flat emitter in the xy plane of `transform`, shining along -z, that emits `power` watts per channel.

    `size` (x, y) are full widths before the transform; `ellipse` cuts the rectangle to its inscribed ellipse.
    `spread` in (0, pi]: pi is Lambertian; less narrows the beam as Blender's spread does, at the same power.
    """

    name: str
    transform: Float32
    power: Rgb
    size: tuple[float, float] = (1.0, 1.0)
    ellipse: bool = False
    spread: float = 3.141592653589793
    visibility: Visibility = Visibility(0)

    def __post_init__(self) -> None:
        self.transform = _arrays.float32(f"area light '{self.name}': transform", self.transform, (3, 4))


Light = PointLight | SpotLight | SunLight | AreaLight


@dataclass
class World:
    """The environment: radiance (W / m² / sr) from every direction that nothing else fills.

    Constant, or `radiance` times an equirectangular `image`: (H, W, 3) linear, not negative, row 0 at the bottom (-z),
    the direction (cos a, sin a, 0) at column (1/2 - a / 2 pi) W, as Blender's Environment Texture has it. `rotation`
    (3, 3) turns directions of the world into those of the image.
    """

    name: str = "World"
    radiance: Rgb = (0.0, 0.0, 0.0)
    image: Float32 | None = None
    rotation: Float32 = field(default_factory=lambda: np.eye(3, dtype=np.float32))

    def __post_init__(self) -> None:
        where = f"world '{self.name}'"
        self.rotation = _arrays.float32(f"{where}: rotation", self.rotation, (3, 3))
        if self.image is not None:
            self.image = _arrays.float32(f"{where}: image", self.image, (None, None, 3))


class Projection(IntEnum):
    """The camera's projection; the same numbers as in native/scene/scene_view.h."""

    PERSPECTIVE = 0
    ORTHOGRAPHIC = 1


@dataclass
class Camera:
    """A camera that looks along -z of `transform`, y up.

    `half_width`, `half_height`: for PERSPECTIVE, tangents of half the field of view (the film at distance 1); for
    ORTHOGRAPHIC, half the extent of the view in metres. `shift` moves the film's centre, in the same unit.
    `aperture_radius` (m) and `focus_distance` (m) give thin-lens depth of field (0: a pinhole).
    """

    name: str = "Camera"
    transform: Float32 = field(default_factory=lambda: IDENTITY.copy())
    projection: Projection = Projection.PERSPECTIVE
    half_width: float = 0.36
    half_height: float = 0.36
    shift: tuple[float, float] = (0.0, 0.0)
    clip_start: float = 0.0
    clip_end: float = float("inf")
    aperture_radius: float = 0.0
    focus_distance: float = 1.0

    def __post_init__(self) -> None:
        self.transform = _arrays.float32(f"camera '{self.name}': transform", self.transform, (3, 4))


@dataclass
class Film:
    """The picture: full resolution, the window of it to render (x, y, width, height; y counts from the bottom) and
    whether the background is transparent."""

    width: int = 512
    height: int = 512
    window: tuple[int, int, int, int] | None = None
    transparent: bool = False

    @property
    def render_window(self) -> tuple[int, int, int, int]:
        """The window, or the whole picture where none is set: (x, y, width, height)."""
        return self.window if self.window is not None else (0, 0, self.width, self.height)


@dataclass
class Scene:
    """Everything that a render needs. `camera` is None where there is none, which cannot be rendered."""

    geometries: list[Mesh | Spheres] = field(default_factory=list)
    instances: list[Instance] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    world: World = field(default_factory=World)
    camera: Camera | None = field(default_factory=Camera)
    film: Film = field(default_factory=Film)

    def validate(self) -> list[str]:
        """Checks every value; returns warnings about what is odd but can be rendered (albedo above 1, no light).

        Raises SceneError naming the datablock, the field and the value for what cannot be rendered.
        """
        from .validation import validate

        return validate(self)
