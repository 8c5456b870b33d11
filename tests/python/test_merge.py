"""Merging files: the picture of one render, or a message that says which file does not belong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_scenes import room

from vlp_bpt import ImageError, Mode, Renderer, RenderSettings
from vlp_bpt.images import Image, read_image, write_image
from vlp_bpt.merge import merge_images
from vlp_bpt.scene import Scene
from vlp_bpt.snapshot import scene_digest


def part(path: Path, begin: int, end: int, scene: Scene | None = None, **settings: Any) -> Path:
    scene = scene or room()
    renderer = Renderer(scene, RenderSettings(samples=end - begin, adaptive=False, **settings), first_iteration=begin)
    image = renderer.render()
    image.metadata["scene"] = scene_digest(scene)
    image.film_state = renderer.film_state()
    write_image(path, image)
    return path


def test_parts_make_the_whole(tmp_path: Path) -> None:
    whole = read_image(part(tmp_path / "whole.exr", 0, 12))
    a, b, c = (part(tmp_path / f"{begin}.exr", begin, end, threads=1) for begin, end in ((0, 5), (5, 6), (6, 12)))
    merged = merge_images([c, a, b])
    assert np.array_equal(merged.pixels, whole.pixels)
    assert np.array_equal(merged.film_state, whole.film_state)  # type: ignore[arg-type]
    assert merged.metadata["ranges"] == [[0, 12]]
    assert merged.metadata["iterations"] == merged.metadata["settings"]["samples"] == 12
    assert merged.metadata["statistics"] == whole.metadata["statistics"]


def test_merged_files_merge_again(tmp_path: Path) -> None:
    whole = read_image(part(tmp_path / "whole.exr", 0, 9))
    a, b, c = (part(tmp_path / f"{begin}.exr", begin, begin + 3) for begin in (0, 3, 6))
    outer = merge_images([a, c])
    assert outer.metadata["ranges"] == [[0, 3], [6, 9]]
    write_image(tmp_path / "outer.exr", outer)
    assert np.array_equal(merge_images([b, tmp_path / "outer.exr"]).pixels, whole.pixels)


def test_parts_that_stop_by_their_noise_merge(tmp_path: Path) -> None:
    a = part(tmp_path / "a.exr", 0, 500, noise_threshold=0.04)
    first = read_image(a).metadata
    b = part(tmp_path / "b.exr", 500, 510)
    merged = merge_images([a, b])
    assert merged.metadata["ranges"] == [[0, first["iterations"]], [500, 510]]
    assert "noise" in first
    assert "noise" not in merged.metadata  # that of a part alone


def test_a_window_merges(tmp_path: Path) -> None:
    scene = room()
    scene.film.window = (2, 3, 5, 4)
    whole = read_image(part(tmp_path / "whole.exr", 0, 4, scene))
    a, b = part(tmp_path / "a.exr", 0, 1, scene), part(tmp_path / "b.exr", 1, 4, scene)
    assert np.array_equal(merge_images([a, b]).pixels, whole.pixels)


def test_what_does_not_belong_is_named(tmp_path: Path) -> None:
    first = part(tmp_path / "first.exr", 0, 4)

    def refusal(other: Path) -> str:
        with pytest.raises(ImageError) as error:
            merge_images([first, other])
        return str(error.value).replace(f"{tmp_path}/", "")

    overlap = part(tmp_path / "overlap.exr", 3, 6)
    assert refusal(overlap) == "'overlap.exr': has iterations 3:6, some of which are in 'first.exr' too"
    assert "some of which are in 'first.exr' too" in refusal(first)
    seed = part(tmp_path / "seed.exr", 4, 6, seed=1)
    assert refusal(seed) == "'seed.exr': was rendered with seed = 1 but 'first.exr' has 0"
    mode = part(tmp_path / "mode.exr", 4, 6, mode=Mode.PAPER)
    assert refusal(mode).startswith("'mode.exr': was rendered with eye_path_length = 5 but 'first.exr' has ")
    size = part(tmp_path / "size.exr", 4, 6, room(20, 12), light_paths=16 * 12)
    assert refusal(size) == "'size.exr': was rendered from another film than 'first.exr'"
    darker = room()
    darker.lights[0].power = (1, 1, 1)  # type: ignore[union-attr]
    assert refusal(part(tmp_path / "scene.exr", 4, 6, darker)) == (
        "'scene.exr': was rendered from another scene than 'first.exr'"
    )
    write_image(tmp_path / "plain.exr", Image(np.zeros((12, 16, 4), dtype=np.float32)))
    assert refusal(tmp_path / "plain.exr") == (
        "'plain.exr': holds no exact sums: render its part with --iterations A:B to an .exr file"
    )
    assert refusal(tmp_path / "none.exr") == "'none.exr': there is no such file"


def test_nothing_to_merge() -> None:
    with pytest.raises(ImageError, match="no files to merge"):
        merge_images([])
