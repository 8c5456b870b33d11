"""Render settings: one dataclass, the same names as in Blender, on the command line and in the native core."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Mode(StrEnum):
    """Presets of the same code: what they set is in `MODE_PRESETS`."""

    PAPER = "PAPER"
    BALANCED = "BALANCED"
    REFERENCE = "REFERENCE"


class Weighting(StrEnum):
    """How the strategies that can make a path share it (Veach 1997, 9.2)."""

    UNIFORM = "UNIFORM"
    BALANCE = "BALANCE"
    POWER = "POWER"


class Filter(StrEnum):
    """The pixel filter; `filter_width` is its full width in pixels."""

    BOX = "BOX"
    GAUSSIAN = "GAUSSIAN"
    BLACKMAN_HARRIS = "BLACKMAN_HARRIS"


class Device(StrEnum):
    """Where the passes run."""

    AUTO = "AUTO"
    CPU = "CPU"
    CUDA = "CUDA"
    HYBRID = "HYBRID"


@dataclass
class RenderSettings:
    """What to compute. A field left at None takes the value that `mode` gives it (see `resolved`).

    samples: iterations. time_limit: seconds, 0 for none. light_path_length: L, most surface hits of a light path.
    eye_path_length: K, most surface hits of an eye path. light_paths: N, light paths of one iteration (0: chosen from
    the picture's size). vlp_connections: C, virtual light points joined to one eye vertex. light_samples: S, light
    samples at one eye vertex. threads: 0 for all.
    """

    mode: Mode = Mode.BALANCED
    samples: int = 128
    time_limit: float = 0.0
    light_path_length: int | None = None
    eye_path_length: int | None = None
    light_paths: int | None = None
    vlp_connections: int | None = None
    light_samples: int | None = None
    weighting: Weighting | None = None
    filter: Filter = Filter.BLACKMAN_HARRIS
    filter_width: float = 1.5
    device: Device = Device.AUTO
    threads: int = 0
    seed: int = 0
