"""VLP-BPT: bidirectional path tracing with virtual light points, after Celestino et al. 2014."""

from importlib import metadata as _metadata

from . import render as _render
from .errors import Cancelled, DeviceError, Error, ImageError, SceneError, SettingsError
from .render import Renderer, Statistics, devices
from .scene import Scene
from .settings import Device, Filter, Mode, RenderSettings, Weighting

__all__ = [
    "Cancelled",
    "Device",
    "DeviceError",
    "Error",
    "Filter",
    "ImageError",
    "Mode",
    "RenderSettings",
    "Renderer",
    "Scene",
    "SceneError",
    "SettingsError",
    "Statistics",
    "Weighting",
    "__version__",
    "devices",
]


def _version() -> str:
    try:
        return _metadata.version("vlp_bpt")
    except _metadata.PackageNotFoundError:  # run from a folder: the core knows as well
        try:
            return str(_render.load_native().__version__)
        except DeviceError:
            return "0.0.0"


__version__ = _version()
