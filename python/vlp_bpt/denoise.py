"""Denoising with Intel's Open Image Denoise 2: the library that Blender brings, or that of the package `pyoidn`."""

from __future__ import annotations

import ctypes
import ctypes.util
import functools
import importlib.util
import os
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._worker import run_aside
from .errors import Cancelled, DeviceError

_NAMES = {
    "linux": "libOpenImageDenoise.so.2*",
    "darwin": "libOpenImageDenoise.2*dylib",
    "win32": "OpenImageDenoise.dll",
}
_CPU, _FLOAT3, _CANCELLED = 1, 3, 6  # of OIDNDeviceType, OIDNFormat, OIDNError
_LEAST_SIDE = 32  # pixels: smaller pictures are mirrored up to it, as the network makes up what is beyond their edges
_SAID_CANCELLED = "denoising was cancelled"

_Monitor = ctypes.CFUNCTYPE(ctypes.c_bool, ctypes.c_void_p, ctypes.c_double)
_Float32 = NDArray[np.float32]


def denoise(
    pixels: _Float32,
    albedo: _Float32 | None = None,
    normal: _Float32 | None = None,
    *,
    prefilter: bool = True,
    threads: int = 0,
    cancelled: Callable[[], bool] | None = None,
) -> _Float32:
    """The picture without its noise: a new array of the shape of `pixels`, (height, width, 3 or 4) linear float32.

    albedo in [0, 1] and normal in [-1, 1], both (height, width, 3), guide it; a normal needs an albedo. prefilter: they
    are noisy and are denoised first. Alpha stays as it is. Numbers that are not finite count as 0. threads: 0 for all.
    `cancelled` is asked about 20 times a second. Raises DeviceError where the library is missing or fails, Cancelled
    when `cancelled` said so, ValueError for other shapes.
    """
    height, width = pixels.shape[:2]
    guides = {name: image for name, image in (("albedo", albedo), ("normal", normal)) if image is not None}
    if pixels.ndim != 3 or pixels.shape[2] not in (3, 4) or ("normal" in guides and "albedo" not in guides):
        raise ValueError(f"pixels of shape {pixels.shape} with {', '.join(guides) or 'no guides'}")
    for name, image in guides.items():
        if image.shape != (height, width, 3):
            raise ValueError(f"{name} of shape {image.shape} for pixels of shape {pixels.shape}")
    library = load()
    if pixels.size == 0:
        return pixels.copy()
    images = {name: _prepared(image) for name, image in (guides | {"color": pixels[..., :3]}).items()}
    if cancelled is not None and cancelled():
        raise Cancelled(_SAID_CANCELLED)
    stop = threading.Event()

    def work() -> _Float32:
        with _Device(library, threads, stop) as device:
            for name in guides if prefilter else ():
                images[name] = device.run({name: images[name]})
            return device.run(images, hdr=True, cleanAux=prefilter and bool(guides))

    def ask() -> None:
        if cancelled is not None and cancelled():
            stop.set()

    result = run_aside(work, name="vlp-bpt denoiser", poll=ask, stop=stop.set)
    (above, _), (left, _) = _margins((height, width))
    return np.concatenate([result[above : above + height, left : left + width], pixels[..., 3:]], axis=2)


@functools.cache
def load() -> ctypes.CDLL:
    """The library, its functions typed. Raises DeviceError where there is none, or of another major version."""
    failures = []
    for path in _candidates():
        try:
            return _typed(ctypes.CDLL(path))
        except (OSError, AttributeError) as error:
            failures.append(f"; '{path}' cannot be used: {error}")
    raise DeviceError(
        "denoising needs Open Image Denoise 2, which is not here: pip install 'vlp-bpt[denoise]', or render without "
        "(denoise = off)" + "".join(failures)
    )


def _candidates() -> Iterator[str]:
    """Paths of the library: first the one that this process holds, so that there are not two."""
    maps = Path("/proc/self/maps")
    if maps.is_file():
        lines = maps.read_text(errors="replace").splitlines()
        yield from dict.fromkeys(line[line.index("/") :] for line in lines if "/libOpenImageDenoise.so" in line)
    folders = []
    if "bpy" in sys.modules and (script := getattr(sys.modules["bpy"], "__file__", None)):
        blender = Path(script).parents[4]  # of BLENDER/5.2/scripts/modules/bpy/__init__.py
        folders += [blender / "lib", blender / "blender.shared"]
    for package, inside in (("pyoidn", ("oidn/lib", "oidn/bin")), ("bpy", ("lib", ""))):
        spec = importlib.util.find_spec(package) if package not in sys.modules else None
        if spec is not None and spec.origin is not None:
            folders += [Path(spec.origin).parent / folder for folder in inside]
    for folder in folders:
        yield from map(str, sorted(folder.glob(_NAMES.get(sys.platform, _NAMES["linux"]))))
    if system := ctypes.util.find_library("OpenImageDenoise"):
        yield system


def _typed(library: ctypes.CDLL) -> ctypes.CDLL:
    text, pointer, size = ctypes.c_char_p, ctypes.c_void_p, ctypes.c_size_t
    signatures: dict[str, tuple[Any, tuple[Any, ...]]] = {
        "oidnNewDevice": (pointer, (ctypes.c_int,)),
        "oidnSetDeviceInt": (None, (pointer, text, ctypes.c_int)),
        "oidnSetDeviceBool": (None, (pointer, text, ctypes.c_bool)),
        "oidnCommitDevice": (None, (pointer,)),
        "oidnGetDeviceError": (ctypes.c_int, (pointer, ctypes.POINTER(text))),
        "oidnReleaseDevice": (None, (pointer,)),
        "oidnNewFilter": (pointer, (pointer, text)),
        "oidnSetSharedFilterImage": (None, (pointer, text, pointer, ctypes.c_int, *[size] * 5)),
        "oidnSetFilterBool": (None, (pointer, text, ctypes.c_bool)),
        "oidnSetFilterProgressMonitorFunction": (None, (pointer, _Monitor, pointer)),
        "oidnCommitFilter": (None, (pointer,)),
        "oidnExecuteFilter": (None, (pointer,)),
        "oidnReleaseFilter": (None, (pointer,)),
    }
    for name, (result, arguments) in signatures.items():  # an AttributeError in version 1
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


class _Device:
    """The processor as the library sees it, for the length of a `with`; `stop` ends what it does."""

    def __init__(self, library: ctypes.CDLL, threads: int, stop: threading.Event) -> None:
        self._library, self._stop = library, stop
        self._device = library.oidnNewDevice(_CPU)
        if not self._device:
            self._check()
        library.oidnSetDeviceInt(self._device, b"numThreads", threads)
        library.oidnSetDeviceBool(self._device, b"setAffinity", False)  # Blender's other threads need the cores too
        library.oidnCommitDevice(self._device)
        self._check()

    def __enter__(self) -> _Device:
        return self

    def __exit__(self, *_: object) -> None:
        self._library.oidnReleaseDevice(self._device)

    def run(self, images: dict[str, _Float32], **switches: bool) -> _Float32:
        """One pass of the filter "RT" over images (height, width, 3)."""
        library = self._library
        height, width, _ = next(iter(images.values())).shape
        output = np.empty((height, width, 3), np.float32)
        keep_going = _Monitor(lambda _pointer, _share: not self._stop.is_set())
        made = library.oidnNewFilter(self._device, b"RT")
        try:
            for name, image in {**images, "output": output}.items():
                layout = (_FLOAT3, width, height, 0, 0, 0)  # packed
                library.oidnSetSharedFilterImage(made, name.encode(), image.ctypes.data, *layout)
            for name, value in switches.items():
                library.oidnSetFilterBool(made, name.encode(), value)
            library.oidnSetFilterProgressMonitorFunction(made, keep_going, None)
            library.oidnCommitFilter(made)
            library.oidnExecuteFilter(made)
        finally:
            library.oidnReleaseFilter(made)
        self._check()
        if self._stop.is_set():
            raise Cancelled(_SAID_CANCELLED)
        return output

    def _check(self) -> None:
        message = ctypes.c_char_p()
        code = self._library.oidnGetDeviceError(self._device, ctypes.byref(message))
        if code == _CANCELLED:
            raise Cancelled(_SAID_CANCELLED)
        if code:
            raise DeviceError(
                f"denoising failed: {os.fsdecode(message.value or b'')} (Open Image Denoise, error {code})"
            )


def _prepared(image: _Float32) -> _Float32:
    """A packed copy for the library: large enough, and with 0 for numbers that are not finite."""
    finite = np.nan_to_num(np.asarray(image, np.float32), nan=0.0, posinf=0.0, neginf=0.0)
    return np.ascontiguousarray(np.pad(finite, (*_margins(image.shape[:2]), (0, 0)), mode="symmetric"))


def _margins(sides: Sequence[int]) -> list[tuple[int, int]]:
    """What a picture needs before and behind each of its sides to be large enough."""
    missing = [max(_LEAST_SIDE - side, 0) for side in sides]
    return [(m // 2, m - m // 2) for m in missing]
