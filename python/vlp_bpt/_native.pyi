"""Types of the native core (see _native.py). Shapes in comments; arrays must be C-contiguous and of the stated type."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

_Float32 = NDArray[np.float32]
_Int32 = NDArray[np.int32]
_Triple = tuple[float, float, float]

__version__: str
isa: str

def cpu_supports_avx2() -> bool: ...
def devices() -> list[dict[str, Any]]: ...
def plan_memory(scene: Scene, settings: dict[str, Any]) -> dict[str, dict[str, int]]: ...  # bytes by device and part

class Scene:
    def __init__(self) -> None: ...
    def add_mesh(
        self,
        positions: _Float32,  # (V, 3)
        triangles: _Int32,  # (T, 3)
        corner_normals: _Float32 | None,  # (T, 3, 3)
        uvs: _Float32 | None,  # (T, 3, 2)
        material_index: _Int32 | None,  # (T,)
    ) -> int: ...
    def add_spheres(
        self,
        centers: _Float32,  # (N, 3)
        radii: _Float32,  # (N,)
        material_index: _Int32 | None,  # (N,)
    ) -> int: ...
    def add_material(
        self,
        kinds: _Int32,  # (n,)
        fresnels: _Int32,  # (n,)
        weights: _Float32,  # (n, 3)
        roughness: _Float32,  # (n,)
        ior: _Float32,  # (n,)
        f0: _Float32,  # (n, 3)
        f82: _Float32,  # (n, 3)
        layered_under: _Int32,  # (n,)
        compensate: _Int32,  # (n,)
        emission: _Triple,
    ) -> int: ...
    def add_instance(
        self,
        geometry: int,
        transform: _Float32,  # (3, 4)
        materials: _Int32,  # (slots,)
        visibility: int,
    ) -> None: ...
    def add_point_light(self, position: _Triple, power: _Triple, radius: float, visibility: int) -> bool: ...
    def add_spot_light(
        self, transform: _Float32, power: _Triple, spot_size: float, blend: float, radius: float, visibility: int
    ) -> bool: ...
    def add_sun_light(self, transform: _Float32, irradiance: _Triple, angle: float, visibility: int) -> bool: ...
    def add_area_light(
        self,
        transform: _Float32,
        power: _Triple,
        size_x: float,
        size_y: float,
        ellipse: bool,
        spread: float,
        visibility: int,
    ) -> bool: ...
    def set_world(self, radiance: _Triple) -> None: ...
    def set_world_image(
        self,
        texels: _Float32,  # (height, width, 3), row 0 at the pole below
        to_image: _Float32,  # (3, 3): rotation from the world to the picture
    ) -> None: ...
    def set_camera(
        self,
        transform: _Float32,
        projection: int,
        half_width: float,
        half_height: float,
        shift_x: float,
        shift_y: float,
        clip_start: float,
        clip_end: float,
        aperture_radius: float,
        focus_distance: float,
    ) -> None: ...
    def set_film(
        self, width: int, height: int, x: int, y: int, window_width: int, window_height: int, transparent: bool
    ) -> None: ...
    def build(self, threads: int = 0) -> None: ...
    # After build(), before parts are added anew and build() is called again.
    def reopen(self, materials: bool, lamps: bool, world: bool) -> None: ...
    # After reopen(), what stays: as many vertices or spheres elsewhere, and other transforms; arrays as for add_*.
    def move_mesh(
        self,
        geometry: int,
        positions: _Float32,
        corner_normals: _Float32 | None,
        uvs: _Float32 | None,
        material_index: _Int32 | None,
    ) -> None: ...
    def move_spheres(
        self, geometry: int, centers: _Float32, radii: _Float32, material_index: _Int32 | None
    ) -> None: ...
    def move_instance(self, instance: int, transform: _Float32) -> None: ...
    # origins, directions (n, 3), t_max (n,); gives t, u, v, primitive, instance, each (n,), and normal (n, 3)
    def intersect(self, origins: _Float32, directions: _Float32, t_max: _Float32) -> dict[str, NDArray[Any]]: ...
    def occluded(self, origins: _Float32, directions: _Float32, t_max: _Float32) -> NDArray[np.uint8]: ...
    def info(self) -> dict[str, Any]: ...

class Renderer:
    def __init__(self, scene: Scene, settings: dict[str, Any]) -> None: ...
    def iterate(self, count: int) -> int: ...
    def cancel(self) -> None: ...
    def rest(self) -> None: ...
    def settle(self) -> int: ...  # sums come from the devices; below 0: so many iterations are lost
    def update(self, scene: Scene, settings: dict[str, Any]) -> None: ...  # all but `device` and `threads`
    def set_deadline(self, seconds: float) -> None: ...
    def progress(self) -> float: ...
    def read(self, out: _Float32) -> None: ...  # (height, width, 4)
    def read_guided(self, color: _Float32, albedo: _Float32, normal: _Float32) -> None: ...  # (height, width, 3)
    def film_state(self) -> NDArray[np.int64]: ...  # (height, width, 4 or with guides 13, 2): low and high words
    def add_film_state(self, state: NDArray[np.int64], iterations: int) -> None: ...
    def lost_light(self, threads: int) -> list[float]: ...  # share and its standard error
    def memory(self) -> dict[str, dict[str, int]]: ...  # bytes by device and part
    @property
    def uploaded_bytes(self) -> int: ...
    @property
    def iterations(self) -> int: ...
    @property
    def vlps(self) -> int: ...
    @property
    def eye_samples(self) -> int: ...
    @property
    def dropped(self) -> int: ...
    @property
    def eye_form(self) -> str: ...  # "paths" or "wavefront"
    @property
    def light_paths(self) -> int: ...  # of one iteration; 0 where nothing needs them
    @property
    def light_rounds(self) -> int: ...  # R: how many times the paths that leave VLPs
    @property
    def first_connections(self) -> int: ...  # C F; 0 where none are made
    @property
    def portals(self) -> int: ...  # that light from infinity is sent through
    @property
    def favoured_lights(self) -> int: ...  # that half of the light paths begin at; 0: none in particular
    @property
    def paths(self) -> int: ...
    @property
    def ranges(self) -> dict[int, int]: ...  # of iterations done: end by begin
    @property
    def notes(self) -> list[str]: ...  # about devices
    @property
    def kappa(self) -> float: ...

class StrategyRenderer:
    def __init__(self, scene: Scene, settings: dict[str, Any]) -> None: ...
    def iterate(self, iteration: int) -> None: ...
    def read(self, s: int, t: int, weighted: bool, out: _Float32) -> None: ...  # (height, width, 3)
