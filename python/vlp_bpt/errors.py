"""The exceptions of VLP-BPT: every message names the datablock and the value at fault."""

from __future__ import annotations


class Error(Exception):
    """Base of every error that VLP-BPT raises on purpose."""


class SceneError(Error):
    """A scene that cannot be rendered: names the datablock and the value."""


class SettingsError(Error):
    """A render setting that is out of range or unknown: names the setting and the value."""


class ImageError(Error):
    """An image file that cannot be read or written: names the file."""


class DeviceError(Error):
    """A device that is absent, out of memory or failed: names the device and what was asked of it."""


class Cancelled(Error):
    """The render was cancelled before its first iteration was complete."""
