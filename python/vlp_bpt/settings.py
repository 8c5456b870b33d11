"""Render settings: one dataclass, the same names as in Blender, on the command line and in the native core."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from enum import StrEnum
from operator import index
from typing import Any

import numpy as np

from .errors import SettingsError


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


@dataclass(frozen=True)
class ModePreset:
    """What a mode gives to the settings that are left at None, and the room that automatic `light_paths` may take.

    Automatic N is one light path for so many pixels, and at most light_vertices / L: a stored light vertex takes 64
    bytes. How the figures were chosen: native/integrator/README.md.
    """

    light_path_length: int
    eye_path_length: int
    vlp_connections: int
    vlp_candidates: int
    light_samples: int
    splats: bool
    roulette: bool
    adaptive: bool
    weighting: Weighting
    pixels_per_light_path: int
    light_vertices: int


MODE_PRESETS: dict[Mode, ModePreset] = {
    Mode.PAPER: ModePreset(1, 5, 1, 1, 1, False, False, False, Weighting.UNIFORM, 1, light_vertices=1 << 23),
    Mode.BALANCED: ModePreset(12, 16, 1, 8, 1, True, True, True, Weighting.BALANCE, 8, light_vertices=1 << 23),
    Mode.REFERENCE: ModePreset(64, 64, 1, 8, 1, True, True, False, Weighting.BALANCE, 4, light_vertices=1 << 21),
}

# The least and the most that a number may be, both allowed.
RANGES: dict[str, tuple[float, float]] = {
    "samples": (1, 2**31 - 1),
    "time_limit": (0.0, 1e9),
    "noise_threshold": (0.0, 1e9),
    "light_path_length": (0, 64),
    "eye_path_length": (1, 64),
    "light_paths": (0, 2**26),
    "vlp_connections": (0, 1024),
    "vlp_candidates": (1, 1024),
    "light_samples": (0, 1024),
    "clamp_direct": (0.0, 1e9),
    "clamp_indirect": (0.0, 1e9),
    "filter_width": (0.01, 10.0),
    "threads": (0, 1024),
    "seed": (0, 2**32 - 1),
}

_ENUMS: dict[str, type[StrEnum]] = {"mode": Mode, "weighting": Weighting, "filter": Filter, "device": Device}
_REALS = ("time_limit", "noise_threshold", "clamp_direct", "clamp_indirect", "filter_width")
_SWITCHES = ("splats", "roulette", "adaptive", "hits", "denoise", "denoise_prefilter")
_ON_OFF = {"on": True, "true": True, "yes": True, "1": True, "off": False, "false": False, "no": False, "0": False}
# What a mode decides where it is None.
FROM_MODE = (
    "light_path_length",
    "eye_path_length",
    "light_paths",
    "vlp_connections",
    "vlp_candidates",
    "light_samples",
    "splats",
    "roulette",
    "adaptive",
    "weighting",
)


@dataclass
class RenderSettings:
    """What to compute. A field left at None takes the value that `mode` gives it (see `resolved`).

    samples: iterations. time_limit: seconds, 0 for none. noise_threshold: the render stops once its noise, measured as
    `vlp_bpt.noise` says, is as low as that, if `samples` and `time_limit` do not end it before; 0 for none.
    light_path_length: L, most surface hits of a light path. eye_path_length: K, most surface hits of an eye path.
    light_paths: N, light paths of one iteration (0: chosen from the picture's size). vlp_connections: C, virtual light
    points joined to one eye vertex. vlp_candidates: M, how many each of them is chosen from, by the light that it
    would bring if nothing stood between. light_samples: S, light samples at one eye vertex. splats: light paths are
    joined to the lens. roulette: paths end at random, the dimmer the sooner, and those that go on make up for it; else
    all of them go on up to L and K. adaptive: from the fifth iteration on, iterations take more samples in pixels that
    are noisier and fewer in others, one a pixel on average; without bias (native/film/sample_rates.h). And
    where a trial of the scene finds that it pays (native/renderer/trial.h), up to eight times `light_paths` are joined
    to the lens, and up to eight times `vlp_connections` are made at the surface that the camera sees, or none anywhere,
    and no light paths at all; eye paths may then be as long as both kinds together.
    hits: eye paths that meet a light count.
    clamp_direct, clamp_indirect: the most that one find of light after at most one surface, or after more, may add to
    a pixel (mean of its channels); 0: no limit. Clamping removes bright specks and the light in them: it is a bias.
    denoise: the finished picture is denoised by Open Image Denoise, guided by colours and normals that the eye paths
    gather meanwhile. denoise_prefilter: these are denoised first, which takes several times as long as the picture
    alone and leaves less error. threads: 0 for all.

    C = 0, S = 0, splats and hits switch strategies off. Those that are left share the light that they can find, and
    the light that none of them finds is missing: without hits, lamps themselves and what only mirrors show of them.
    """

    mode: Mode = Mode.BALANCED
    samples: int = 128
    time_limit: float = 0.0
    noise_threshold: float = 0.0
    light_path_length: int | None = None
    eye_path_length: int | None = None
    light_paths: int | None = None
    vlp_connections: int | None = None
    vlp_candidates: int | None = None
    light_samples: int | None = None
    splats: bool | None = None
    roulette: bool | None = None
    adaptive: bool | None = None
    hits: bool = True
    weighting: Weighting | None = None
    clamp_direct: float = 0.0
    clamp_indirect: float = 0.0
    filter: Filter = Filter.BLACKMAN_HARRIS
    filter_width: float = 1.5
    denoise: bool = False
    denoise_prefilter: bool = True
    device: Device = Device.AUTO
    threads: int = 0
    seed: int = 0

    def validate(self) -> None:
        """Brings every field to its type (enums from their names, integers from whole numbers).

        Raises SettingsError naming the setting and the value that is not one of its values or out of its range.
        """
        for field in fields(self):
            setattr(self, field.name, _checked(field.name, getattr(self, field.name)))

    def resolved(self, width: int, height: int) -> ResolvedSettings:
        """These settings with nothing left open, for a picture of width x height pixels at full resolution.

        A border render has the same `light_paths` as the whole picture: crop changes the pixels, not N.
        Raises SettingsError as `validate` does.
        """
        values = {field.name: _checked(field.name, getattr(self, field.name)) for field in fields(self)}
        preset = MODE_PRESETS[values["mode"]]
        for name in FROM_MODE:
            if values[name] is None:
                values[name] = getattr(preset, name, 0)
        if values["light_paths"] == 0:
            most = preset.light_vertices // max(values["light_path_length"], 1)
            values["light_paths"] = max(min(width * height // preset.pixels_per_light_path, most), 1)
        return ResolvedSettings(**values)

    def to_dict(self) -> dict[str, Any]:
        """The settings as JSON values (enums by name) under their fixed names; None where the mode decides."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: str(value) if isinstance(value, StrEnum) else value for name, value in values.items()}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> RenderSettings:
        """Settings from what `to_dict` gave; names left out keep their defaults.

        Raises SettingsError for an unknown name, which it answers with the closest known one, or a bad value.
        """
        return RenderSettings(**{name: _checked(_known(name), value) for name, value in values.items()})

    @classmethod
    def from_strings(cls, values: Mapping[str, str]) -> RenderSettings:
        """Settings from text, as typed after `--set`: numbers, enum names in any case, `on` and `off`, `auto` for what
        the mode gives.

        Raises SettingsError as `from_dict` does.
        """
        return cls.from_dict({name: _parsed(_known(name), text) for name, text in values.items()})


@dataclass
class ResolvedSettings(RenderSettings):
    """Settings with nothing left open: made by `RenderSettings.resolved`, taken by the native core."""

    light_path_length: int = 1
    eye_path_length: int = 1
    light_paths: int = 1
    vlp_connections: int = 1
    vlp_candidates: int = 1
    light_samples: int = 1
    splats: bool = True
    roulette: bool = True
    adaptive: bool = True
    weighting: Weighting = Weighting.BALANCE


def _known(name: str) -> str:
    names = [field.name for field in fields(RenderSettings)]
    if name in names:
        return name
    close = difflib.get_close_matches(name.lower().replace("-", "_"), names, n=1)
    hint = f"did you mean {close[0]}?" if close else f"known settings: {', '.join(names)}"
    raise SettingsError(f"unknown setting '{name}': {hint}")


def _parsed(name: str, text: str) -> Any:
    text = text.strip()
    if name in FROM_MODE and text.lower() in ("auto", "none"):
        return None
    if name in _ENUMS:
        return text.upper()
    if name in _SWITCHES:
        return _ON_OFF.get(text.lower(), text)
    try:
        return float(text) if name in _REALS else int(text)
    except ValueError:
        kind = "a number" if name in _REALS else "a whole number"
        raise SettingsError(f"{name} = '{text}': must be {kind}") from None


def _checked(name: str, value: Any) -> Any:
    """The value as the setting's type; raises SettingsError where it has no place there."""
    if value is None and name in FROM_MODE:
        return None
    if name in _ENUMS:
        try:
            return _ENUMS[name](value)
        except ValueError:
            choices = ", ".join(_ENUMS[name])
            raise SettingsError(f"{name} = {value!r}: must be one of {choices}") from None
    if name in _SWITCHES:
        if not isinstance(value, (bool, np.bool_)):
            raise SettingsError(f"{name} = {value!r}: must be on or off")
        return bool(value)
    low, high = RANGES[name]
    try:
        if isinstance(value, bool):
            raise TypeError
        number = float(value) if name in _REALS else index(value)
    except (TypeError, ValueError):
        kind = "a number" if name in _REALS else "a whole number"
        raise SettingsError(f"{name} = {value!r}: must be {kind}") from None
    if math.isnan(number) or not low <= number <= high:
        raise SettingsError(f"{name} = {value!r}: must be from {low:.12g} to {high:.12g}")
    return number
