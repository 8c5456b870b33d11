"""The debug render: pictures of each strategy are what they say, add up to the render's, and are all on the sheet."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes_for_tests import assert_same_mean, blocks, render, settings
from test_transport import lit_by_area, lit_by_many

from vlp_bpt import SettingsError
from vlp_bpt.images import read_image
from vlp_bpt.scene import Film
from vlp_bpt.strategies import (
    SHEET,
    StrategyPictures,
    contact_sheet,
    render_strategies,
    strategies_of,
    write_strategies,
)

OPTIONS: dict[str, Any] = {
    "samples": 6, "light_path_length": 2, "eye_path_length": 3, "light_paths": 900, "filter": "BLACKMAN_HARRIS",
    "filter_width": 1.5,
}  # fmt: skip


@pytest.mark.parametrize(
    "change",
    [{}, {"splats": False}, {"hits": False}, {"vlp_connections": 0}, {"light_samples": 0}, {"weighting": "UNIFORM"},
     {"roulette": False}],
)  # fmt: skip
@pytest.mark.parametrize("film", [Film(24, 20), Film(24, 20, (3, 5, 11, 9))])
def test_weighted_pictures_add_up_to_the_render(change: dict[str, Any], film: Film) -> None:
    """The same iterations, so equal but for rounding."""
    scene = lit_by_many()
    scene.film = film
    options = settings(**(OPTIONS | change))
    pictures = render_strategies(scene, options)
    assert list(pictures.raw) == list(pictures.weighted) == list(strategies_of(options.resolved(24, 20)))
    total = np.sum([picture.astype(float) for picture in pictures.weighted.values()], axis=0)
    np.testing.assert_allclose(total, render(scene, options), rtol=1e-5, atol=1e-6)


def test_raw_pictures_of_a_length_show_the_same_light() -> None:
    """t-tests of blocks with Sidak's correction, a false-alarm rate of 1e-4 for each pair; 16 batches."""
    found = [
        render_strategies(lit_by_area(), settings(**(OPTIONS | {"samples": 96, "filter": "BOX", "seed": seed}))).raw
        for seed in range(16)
    ]
    by_light_samples = [s_t for s_t in found[0] if s_t[0] == 1]
    for s, t in found[0]:
        other = (1, s + t - 1)
        if s != 1 and other in by_light_samples:
            a, b = (blocks(np.stack([raw[key] for raw in found]).astype(float), 8) for key in ((s, t), other))
            assert_same_mean(a, b, f"({s}, {t}) and {other}")


def test_strategies_are_those_that_are_on() -> None:
    def shown(**options: Any) -> set[tuple[int, int]]:
        return set(strategies_of(settings(light_path_length=2, eye_path_length=2, **options).resolved(8, 8)))

    hits, samples, vlps, splats = {(0, 2), (0, 3)}, {(1, 2), (1, 3)}, {(2, 2), (2, 3), (3, 2), (3, 3)}, {(3, 1)}
    assert shown() == hits | samples | vlps | splats
    assert shown(hits=False, light_samples=0) == vlps | splats | {(2, 1)}
    assert shown(vlp_connections=0, splats=False) == hits | samples


def test_the_sheet_has_a_row_for_each_length_and_a_column_for_each_s() -> None:
    """Flat pictures of 256 x 128 pixels: tiles of 128 x 64, raw ones left, the weighted half as bright."""
    strategies = [(0, 2), (0, 3), (1, 2), (2, 1), (2, 2)]
    raw = {key: np.full((128, 256, 3), 1.0, np.float32) for key in strategies}
    weighted = {(s, t): picture / sum(s + t == sum(key) for key in strategies) for (s, t), picture in raw.items()}
    weighted[2, 2] = np.broadcast_to(np.float32([[[0.25, 0.5, 1]]]), (128, 256, 3))
    sheet = contact_sheet(StrategyPictures(raw, weighted, 1))
    assert sheet.shape == (3 * 66 + 2, 2 * (3 * 130 + 8), 4)
    for s, t in strategies:
        y, x = 66 * (4 - s - t) + 2 + 32, 130 * s + 2 + 64
        expected = (weighted[s, t] / weighted[s, t].max())[0, 0] if (s, t) == (2, 2) else weighted[s, t][0, 0]
        np.testing.assert_allclose(sheet[y, x + 398, :3], expected, rtol=1e-6)
        np.testing.assert_allclose(sheet[y, x, :3], 1, rtol=1e-6)
    assert (sheet[66 * 2 + 32, 130 + 64, :3] == np.float32(0.02)).all()  # (1, 1) is no strategy
    assert (sheet[..., 3] == 1).all()


def test_files(tmp_path: Path) -> None:
    pictures = render_strategies(lit_by_area(), settings(**OPTIONS))
    written = write_strategies(tmp_path / "new" / "folder", pictures)
    assert len(written) == 2 * len(pictures.raw) + 1
    assert read_image(tmp_path / "new/folder" / SHEET).pixels.max() > 0.5
    image = read_image(tmp_path / "new/folder/s3_t1_weighted.exr")
    np.testing.assert_array_equal(image.pixels[..., :3], pictures.weighted[3, 1])
    assert image.metadata["strategy"] == [3, 1, "weighted"]


def test_too_much_memory_is_refused() -> None:
    scene = lit_by_area()
    scene.film = Film(1920, 1080)
    with pytest.raises(SettingsError, match=r"would take 201\.9 GiB: choose a smaller picture, or shorter paths"):
        render_strategies(scene, settings(light_path_length=64, eye_path_length=64))
