"""The package `vlp_bpt` that does the work: a wheel inside the extension, found or missed with one clear line."""

from __future__ import annotations

import importlib
import sys
from typing import Any


class CoreMissing(Exception):
    """The core cannot be loaded by this Blender's Python: the message says why and what to do."""


def load(module: str = "vlp_bpt") -> Any:
    """A module of the core. Raises CoreMissing, whatever keeps it from loading."""
    try:
        return importlib.import_module(module)
    except Exception as error:
        version = f"{sys.version_info.major}.{sys.version_info.minor}"
        raise CoreMissing(
            f"VLP-BPT's core cannot be loaded by Python {version} ({error}): "
            "install the extension's zip that is made for this Blender and system"
        ) from error
