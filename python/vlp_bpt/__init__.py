"""VLP-BPT: bidirectional path tracing with virtual light points, after Celestino et al. 2014."""

from importlib import metadata as _metadata

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

try:
    __version__ = _metadata.version("vlp_bpt")
except _metadata.PackageNotFoundError:  # run from the source tree
    __version__ = "0.0.0"
