"""Image files, read and written through OpenImageIO: OpenEXR with metadata and exact sums, PNG encoded for sRGB."""

from __future__ import annotations

import importlib
import json
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import ImageError
from .metrics import srgb_decode, srgb_encode

_PREFIX = "vlp:"  # of this package's attributes, each holding one JSON value
_BLENDER_PREFIX = "VLP_BPT."  # of what the add-on stamps into files that Blender writes, plain text
_HALF_MAX = 65504.0
_STATE = "vlp_bpt.sums"  # the part of an EXR file that holds a film state
_WORDS = 4  # of 32 bits, in a sum
# Pictures that a file keeps beside its own, under Cycles' names: the picture before denoising, and what guided that.
NOISY, ALBEDO, NORMAL = "Noisy Image", "Denoising Albedo", "Denoising Normal"
_LAYERS = {NOISY: "RGBA", ALBEDO: "RGB", NORMAL: "XYZ"}  # their channels


class Depth(StrEnum):
    """The numbers of an image file: FLOAT and HALF for .exr, INT8 and INT16 for .png."""

    FLOAT = "float"
    HALF = "half"
    INT8 = "8"
    INT16 = "16"


DEPTHS: dict[str, tuple[Depth, ...]] = {".exr": (Depth.FLOAT, Depth.HALF), ".png": (Depth.INT8, Depth.INT16)}


@dataclass
class Image:
    """A picture: pixels (height, width, 4) float32, linear Rec. 709, premultiplied alpha, row 0 at the bottom.

    metadata: what is known about it, as JSON values; a render's are those of `Renderer.metadata`. film_state: the exact
    sums behind the pixels (height, width, 4 or 13, 2) int64, for `merge`; None where they are not kept. layers: further
    pictures (height, width, 4 or 3) under the names NOISY, ALBEDO and NORMAL, where it was denoised.
    """

    pixels: NDArray[np.float32]
    metadata: dict[str, Any] = field(default_factory=dict)
    film_state: NDArray[np.int64] | None = None
    layers: dict[str, NDArray[np.float32]] = field(default_factory=dict)


def check_output(path: str | Path, depth: Depth | None = None) -> Depth:
    """The depth that a file at `path` would be written with; raises ImageError where its name or folder is no good."""
    path = Path(path)
    depths = DEPTHS.get(path.suffix.lower())
    if depths is None:
        raise ImageError(f"'{path}': pictures are written as {' or '.join(DEPTHS)}, not '{path.suffix}'")
    if depth is not None and depth not in depths:
        raise ImageError(f"'{path}': depth {depth} is not one of {', '.join(depths)} for {path.suffix.lower()}")
    if not path.parent.is_dir():
        raise ImageError(f"'{path}': there is no folder '{path.parent}'")
    if path.is_dir():
        raise ImageError(f"'{path}': is a folder")
    return depth or depths[0]


def write_image(path: str | Path, image: Image, depth: Depth | None = None) -> None:
    """Writes .exr (linear float or half) or .png (sRGB-encoded 8 or 16 bits, alpha not premultiplied).

    The file appears whole or not at all. Metadata goes into attributes named `vlp:...`; layers of an .exr into further
    channels, a film state into a second part. Raises ImageError naming the file.
    """
    from . import __version__

    path, depth = Path(path), check_output(path, depth)
    if image.film_state is not None and path.suffix.lower() != ".exr":
        raise ImageError(f"'{path}': only .exr can hold the exact sums of a range of iterations")
    oiio = _oiio()
    formats = {Depth.FLOAT: oiio.FLOAT, Depth.HALF: oiio.HALF, Depth.INT8: oiio.UINT8, Depth.INT16: oiio.UINT16}
    pixels = np.asarray(image.pixels, dtype=np.float32)[::-1]
    names = ["R", "G", "B", "A"][: pixels.shape[2]]
    if path.suffix.lower() == ".exr":
        for layer, picture in image.layers.items():
            pixels = np.concatenate([pixels, picture[::-1]], axis=2)
            names += [f"{layer}.{channel}" for channel in _LAYERS[layer]]
    if depth in (Depth.INT8, Depth.INT16):
        pixels = _to_integers(pixels, depth)
    elif depth == Depth.HALF:
        pixels = np.clip(pixels, -_HALF_MAX, _HALF_MAX)
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, formats[depth])
    spec.channelnames = tuple(names[:channels])
    spec.attribute("Software", f"VLP-BPT {__version__}")
    spec.attribute("compression", "zip")
    for name, value in image.metadata.items():
        spec.attribute(_PREFIX + name, json.dumps(value))
    if path.suffix.lower() == ".png":
        spec.attribute("oiio:ColorSpace", "sRGB")
        spec.attribute("oiio:UnassociatedAlpha", 1)
    else:
        _place_window(spec, image.metadata.get("film"))
    parts = [(spec, np.ascontiguousarray(pixels))]
    if image.film_state is not None:
        parts.append(_state_part(oiio, spec, image.film_state))
    _write_parts(oiio, path, parts)


def read_image(path: str | Path) -> Image:
    """Reads any picture that OpenImageIO knows: integers are taken as sRGB-encoded with plain alpha, floats as linear.

    One channel becomes grey, absent alpha 1; of a file with layers, the first `...Combined` one is read. Raises
    ImageError naming the file.
    """
    path = Path(path)
    if not path.is_file():
        raise ImageError(f"'{path}': there is no such file")
    oiio = _oiio()
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    file = oiio.ImageInput.open(str(path), config)
    if file is None:
        raise ImageError(f"'{path}': cannot be read: {oiio.geterror()}")
    try:
        spec = file.spec()
        raw = file.read_image(0, 0, 0, spec.nchannels, oiio.FLOAT)
        if raw is None:
            raise ImageError(f"'{path}': cannot be read: {file.geterror()}")
        metadata = {attribute.name: attribute.value for attribute in spec.extra_attribs}
        known = {name[len(_PREFIX) :]: value for name, value in metadata.items() if name.startswith(_PREFIX)}
        try:
            known = {name: json.loads(value) for name, value in known.items()}
        except ValueError:
            raise ImageError(f"'{path}': its VLP-BPT metadata is damaged") from None
        known |= {name: str(value) for name, value in metadata.items() if name.startswith(_BLENDER_PREFIX)}
        raw, names = raw.reshape(spec.height, spec.width, spec.nchannels), list(spec.channelnames)
        pixels, layers = _to_rgba(raw, names), _layers(raw, names)
        if spec.format.basetype in (oiio.UINT8, oiio.UINT16, oiio.UINT32):
            pixels[..., :3] = srgb_decode(pixels[..., :3]) * pixels[..., 3:]
        image = Image(np.ascontiguousarray(pixels[::-1]), known, layers=layers)
        _read_further_parts(oiio, file, path, image)
        return image
    finally:
        file.close()


def _oiio() -> Any:
    try:
        return importlib.import_module("OpenImageIO")
    except ImportError as error:
        raise ImageError(
            f"image files need OpenImageIO, which is missing (pip install OpenImageIO): {error}"
        ) from error


def _to_integers(pixels: NDArray[np.float32], depth: Depth) -> NDArray[Any]:
    """sRGB-encoded, alpha not premultiplied, rounded; without the alpha channel where all is opaque."""
    alpha = np.clip(np.nan_to_num(pixels[..., 3:]), 0.0, 1.0)
    color = np.nan_to_num(pixels[..., :3], nan=0.0, posinf=float(np.finfo(np.float32).max))
    color = np.divide(color, alpha, out=np.zeros_like(color), where=alpha > 0)
    encoded = srgb_encode(color)
    if (alpha < 1).any():
        encoded = np.concatenate([encoded, alpha], axis=2)
    most, kind = (255, np.uint8) if depth == Depth.INT8 else (65535, np.uint16)
    return np.rint(encoded * most).astype(kind)


def _to_rgba(raw: NDArray[np.float32], names: list[str]) -> NDArray[np.float32]:
    layer = next((name[: -len("R")] for name in names if name == "R" or name.endswith("Combined.R")), "")
    if all(layer + channel in names for channel in "RGB"):
        chosen = [names.index(layer + channel) for channel in "RGBA" if layer + channel in names]
    else:  # grey, with or without alpha
        chosen = [0, 0, 0] + ([1] if raw.shape[2] == 2 else [])
    rgba = np.ones((*raw.shape[:2], 4), dtype=np.float32)
    rgba[..., : len(chosen)] = raw[..., chosen]
    return rgba


def _layers(raw: NDArray[np.float32], names: list[str]) -> dict[str, NDArray[np.float32]]:
    """Those of the first view layer that has them; only whole ones."""
    found = {}
    for layer, channels in _LAYERS.items():
        first = next((name for name in names if name.split(".")[-2:] == [layer, channels[0]]), None)
        wanted = [f"{first[:-1]}{channel}" for channel in channels] if first is not None else []
        if wanted and all(name in names for name in wanted):
            found[layer] = np.ascontiguousarray(raw[::-1][..., [names.index(name) for name in wanted]])
    return found


def _place_window(spec: Any, film: dict[str, Any] | None) -> None:
    """Tells where in the whole picture the rendered window lies; files count y from the top."""
    if film is not None:
        x, y, _, height = film["window"]
        spec.x, spec.y = x, film["height"] - y - height
        spec.full_x = spec.full_y = 0
        spec.full_width, spec.full_height = film["width"], film["height"]


def _state_part(oiio: Any, picture: Any, state: NDArray[np.int64]) -> tuple[Any, NDArray[Any]]:
    count = _WORDS * state.shape[2]
    words = np.ascontiguousarray(state[::-1]).astype("<i8").view("<u4").reshape(picture.height, picture.width, count)
    spec = oiio.ImageSpec(picture.width, picture.height, count, oiio.UINT32)
    spec.channelnames = _state_channels(count)
    for name in ("x", "y", "full_x", "full_y", "full_width", "full_height"):
        setattr(spec, name, getattr(picture, name))
    spec.attribute("compression", "zip")
    spec.attribute("oiio:subimagename", _STATE)
    picture.attribute("oiio:subimagename", "picture")
    return spec, np.ascontiguousarray(words)


def _state_channels(count: int) -> tuple[str, ...]:
    return tuple(f"sum.{i:02}" for i in range(count))  # file order is alphabetical


def _read_further_parts(oiio: Any, file: Any, path: Path, image: Image) -> None:
    """The exact sums, and layers where Blender gave each a part of its own."""
    part = 1
    while file.seek_subimage(part, 0):
        spec = file.spec()
        if spec.get_string_attribute("oiio:subimagename") == _STATE:
            image.film_state = _read_state(oiio, file, part, path)
        elif (spec.height, spec.width) == image.pixels.shape[:2]:
            raw = file.read_image(part, 0, 0, spec.nchannels, oiio.FLOAT)
            if raw is None:
                raise ImageError(f"'{path}': cannot be read: {file.geterror()}")
            found = _layers(raw.reshape(spec.height, spec.width, spec.nchannels), list(spec.channelnames))
            image.layers = found | image.layers
        part += 1


def _read_state(oiio: Any, file: Any, part: int, path: Path) -> NDArray[np.int64]:
    spec = file.spec()
    words = file.read_image(part, 0, 0, spec.nchannels, oiio.UINT32)
    count = spec.nchannels
    if words is None or count % _WORDS or spec.channelnames != _state_channels(count):
        raise ImageError(f"'{path}': its exact sums cannot be read: {file.geterror()}")
    state = np.ascontiguousarray(words.reshape(spec.height, spec.width, count)[::-1], dtype="<u4").view("<i8")
    return state.astype(np.int64).reshape(spec.height, spec.width, count // _WORDS, 2)


def _write_parts(oiio: Any, path: Path, parts: list[tuple[Any, NDArray[Any]]]) -> None:
    unfinished = path.with_name(f"{path.stem}.unfinished{path.suffix.lower()}")
    output = oiio.ImageOutput.create(str(unfinished))
    if output is None:
        raise ImageError(f"'{path}': cannot be written: {oiio.geterror()}")
    try:
        specs = tuple(spec for spec, _ in parts)
        for i, (spec, pixels) in enumerate(parts):
            opened = (
                output.open(str(unfinished), specs if len(specs) > 1 else spec)
                if i == 0
                else output.open(str(unfinished), spec, "AppendSubimage")
            )
            if not opened or not output.write_image(pixels):
                raise ImageError(f"'{path}': cannot be written: {output.geterror()}")
        if not output.close():
            raise ImageError(f"'{path}': cannot be written: {output.geterror()}")
        unfinished.replace(path)
    except OSError as error:
        raise ImageError(f"'{path}': cannot be written: {error.strerror}") from error
    finally:
        output.close()
        unfinished.unlink(missing_ok=True)
