"""Image files: what is written is read back, the right way up, with its metadata and exact sums."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio  # type: ignore[import-not-found]  # noqa: N813
import pytest

from vlp_bpt import __version__
from vlp_bpt.errors import ImageError
from vlp_bpt.images import Depth, Image, check_output, read_image, write_image
from vlp_bpt.metrics import srgb_encode

METADATA: dict[str, Any] = {
    "settings": {"mode": "PAPER", "light_paths": None},
    "iterations": 12,
    "seconds": 1.5,
    "note": "Grüße",
    "film": {"width": 20, "height": 10, "window": [3, 1, 7, 5]},
}


def picture(height: int = 5, width: int = 7, *, opaque: bool = False) -> np.ndarray[Any, np.dtype[np.float32]]:
    random = np.random.default_rng(0)
    pixels = random.random((height, width, 4), dtype=np.float32)
    if opaque:
        pixels[..., 3] = 1
    pixels[..., :3] *= pixels[..., 3:]
    return pixels


def attributes(path: Path, config: Any = None) -> dict[str, Any]:
    file = oiio.ImageInput.open(str(path))
    found = {attribute.name: attribute.value for attribute in file.spec().extra_attribs}
    found["nchannels"] = file.spec().nchannels
    found["format"] = str(file.spec().format)
    found["window"] = (file.spec().x, file.spec().y, file.spec().full_width, file.spec().full_height)
    file.close()
    return found


def test_exr_keeps_every_bit(tmp_path: Path) -> None:
    pixels = picture()
    pixels[0, 0, :3] = 1e30, -2.5, 1e-40
    write_image(tmp_path / "a.exr", Image(pixels, METADATA))
    read = read_image(tmp_path / "a.exr")
    assert read.pixels.dtype == np.float32
    assert np.array_equal(read.pixels, pixels)
    assert read.metadata == METADATA
    assert read.film_state is None
    assert [path.name for path in tmp_path.iterdir()] == ["a.exr"]


def test_exr_tells_others_what_it_is(tmp_path: Path) -> None:
    write_image(tmp_path / "a.exr", Image(picture(), METADATA))
    found = attributes(tmp_path / "a.exr")
    assert found["Software"] == f"VLP-BPT {__version__}"
    assert json.loads(found["vlp:settings"]) == METADATA["settings"]
    assert found["window"] == (3, 4, 20, 10)  # y from the top: 10 - 1 - 5


def test_half_is_rounded_and_never_infinite(tmp_path: Path) -> None:
    pixels = picture()
    pixels[0, 0, 0] = 1e30
    write_image(tmp_path / "a.exr", Image(pixels), Depth.HALF)
    read = read_image(tmp_path / "a.exr").pixels
    assert attributes(tmp_path / "a.exr")["format"] == "half"
    assert read[0, 0, 0] == 65504
    assert np.allclose(read.ravel()[1:], pixels.ravel()[1:], rtol=2**-11, atol=1e-7)


@pytest.mark.parametrize(("depth", "most", "kind"), [(Depth.INT8, 255, "uint8"), (Depth.INT16, 65535, "uint16")])
def test_png_is_encoded_for_srgb(tmp_path: Path, depth: Depth, most: int, kind: str) -> None:
    pixels = picture(opaque=True)
    pixels[0, 0, :3] = 5, -1, np.nan
    write_image(tmp_path / "a.png", Image(pixels, METADATA), depth)
    file = oiio.ImageInput.open(str(tmp_path / "a.png"))
    raw = file.read_image(0, 0, 0, 3, kind)
    file.close()
    expected = np.rint(srgb_encode(np.nan_to_num(pixels[::-1, :, :3])) * most)
    assert np.array_equal(raw, expected)
    found = attributes(tmp_path / "a.png")
    assert (found["nchannels"], found["format"]) == (3, kind)
    read = read_image(tmp_path / "a.png")
    assert np.abs(srgb_encode(read.pixels[..., :3]) - expected[::-1] / most).max() < 1e-6
    assert (read.pixels[..., 3] == 1).all()
    assert read.metadata == METADATA


def test_png_with_alpha_is_not_premultiplied(tmp_path: Path) -> None:
    pixels = np.zeros((1, 2, 4), dtype=np.float32)
    pixels[0, 0] = 0.25, 0.125, 0.0, 0.5
    pixels[0, 1] = 0.3, 0.3, 0.3, 0.0  # light without a surface: lost in a PNG
    write_image(tmp_path / "a.png", Image(pixels), Depth.INT16)
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    file = oiio.ImageInput.open(str(tmp_path / "a.png"), config)
    raw = file.read_image(0, 0, 0, 4, "uint16")
    file.close()
    assert raw[0, 0].tolist() == [*np.rint(srgb_encode([0.5, 0.25, 0.0]) * 65535), 32768]
    assert raw[0, 1].tolist() == [0, 0, 0, 0]
    assert np.allclose(read_image(tmp_path / "a.png").pixels, [[[0.25, 0.125, 0, 0.5], [0, 0, 0, 0]]], atol=2e-5)


def test_rows_go_from_the_bottom(tmp_path: Path) -> None:
    pixels = np.zeros((3, 2, 4), dtype=np.float32)
    pixels[0] = 1  # the lowest row
    for name in ("a.exr", "a.png"):
        write_image(tmp_path / name, Image(pixels))
        file = oiio.ImageInput.open(str(tmp_path / name))
        raw = file.read_image(0, 0, 0, 3, "float")
        file.close()
        assert raw[:, 0, 0].tolist() == [0, 0, 1]


def test_exact_sums_travel_along(tmp_path: Path) -> None:
    state = np.random.default_rng(1).integers(-(2**63), 2**63, (5, 7, 4, 2))
    write_image(tmp_path / "a.exr", Image(picture(), METADATA, state))
    read = read_image(tmp_path / "a.exr")
    assert read.film_state is not None
    assert read.film_state.dtype == np.int64
    assert np.array_equal(read.film_state, state)
    assert np.array_equal(read.pixels, picture())
    assert read.metadata == METADATA
    with pytest.raises(ImageError, match=r"a\.png': only \.exr can hold the exact sums"):
        write_image(tmp_path / "a.png", Image(picture(), {}, state))


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (("Y",), [[0.1, 0.1, 0.1, 1.0]]),
        (("Y", "A"), [[0.1, 0.1, 0.1, 0.2]]),
        (("R", "G", "B"), [[0.1, 0.2, 0.3, 1.0]]),
        (("ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B"), [[0.1, 0.2, 0.3, 1.0]]),
        (("Depth.Z", "R", "G", "B", "A"), [[0.2, 0.3, 0.4, 0.5]]),
    ],
)
def test_channels_of_other_files(tmp_path: Path, names: tuple[str, ...], expected: list[list[float]]) -> None:
    spec = oiio.ImageSpec(1, 1, len(names), oiio.FLOAT)
    spec.channelnames = names
    file = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    file.open(str(tmp_path / "a.exr"), spec)
    file.write_image(np.array([[[0.1, 0.2, 0.3, 0.4, 0.5][: len(names)]]], dtype=np.float32))
    file.close()
    assert np.allclose(read_image(tmp_path / "a.exr").pixels, [expected])


@pytest.mark.parametrize(
    ("name", "depth", "message"),
    [
        ("a.jpg", None, r"a\.jpg': pictures are written as \.exr or \.png, not '\.jpg'"),
        ("a", None, r"a': pictures are written as \.exr or \.png, not ''"),
        ("a.png", Depth.HALF, r"a\.png': depth half is not one of 8, 16 for \.png"),
        ("a.exr", Depth.INT8, r"a\.exr': depth 8 is not one of float, half for \.exr"),
        ("none/a.exr", None, r"a\.exr': there is no folder '.*none'"),
    ],
)
def test_files_that_cannot_be_written_are_named(tmp_path: Path, name: str, depth: Depth | None, message: str) -> None:
    for act in (
        lambda: check_output(tmp_path / name, depth),
        lambda: write_image(tmp_path / name, Image(picture()), depth),
    ):
        with pytest.raises(ImageError, match=message):
            act()
    assert list(tmp_path.iterdir()) == []


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    (tmp_path / "a.exr").mkdir()
    with pytest.raises(ImageError, match=r"a\.exr': is a folder"):
        write_image(tmp_path / "a.exr", Image(picture()))


def test_a_failed_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.exr"
    write_image(path, Image(picture()))
    before = path.read_bytes()
    monkeypatch.setattr(Path, "replace", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left on device")))
    with pytest.raises(ImageError, match=r"a\.exr': cannot be written: No space left on device"):
        write_image(path, Image(picture() * 2))
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    with pytest.raises(ImageError, match=r"none\.exr': there is no such file"):
        read_image(tmp_path / "none.exr")
    (tmp_path / "junk.exr").write_bytes(b"junk")
    with pytest.raises(ImageError, match=r"junk\.exr': cannot be read: "):
        read_image(tmp_path / "junk.exr")
    write_image(tmp_path / "cut.exr", Image(picture(64, 64)))
    whole = (tmp_path / "cut.exr").read_bytes()
    (tmp_path / "cut.exr").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ImageError, match=r"cut\.exr': cannot be read: "):
        read_image(tmp_path / "cut.exr")


def test_without_openimageio_it_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "OpenImageIO", None)
    with pytest.raises(ImageError, match="image files need OpenImageIO, which is missing"):
        write_image(tmp_path / "a.exr", Image(picture()))
