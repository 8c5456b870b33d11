"""The same seed makes the same picture, bit for bit, whatever the threads, the crop and the ranges of iterations."""

from __future__ import annotations

import os
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes_for_tests import Array, assert_same_mean, blocks, settings
from test_transport import lit_by_area, lit_by_many

from vlp_bpt import Renderer, RenderSettings, _native
from vlp_bpt.scene import Film

OPTIONS: dict[str, Any] = {
    "samples": 8,
    "light_path_length": 3,
    "light_paths": 3000,
    "splats": True,
    "filter": "BLACKMAN_HARRIS",
    "filter_width": 1.5,
}


def rendered(film: Film | None = None, first: int = 0, count: int = 8, **options: Any) -> Renderer:
    scene = lit_by_many()
    scene.film = film or Film(48, 40)
    renderer = Renderer(scene, settings(**(OPTIONS | options)), first_iteration=first)
    assert renderer.iterate(count) == count
    return renderer


def test_twice_the_same() -> None:
    assert np.array_equal(rendered().film_state(), rendered().film_state())


def test_seeds_differ() -> None:
    assert not np.array_equal(rendered().read(), rendered(seed=1).read())


@pytest.mark.parametrize("threads", [2, 3, 7])
def test_threads_change_no_bit(threads: int) -> None:
    assert np.array_equal(rendered(threads=threads).film_state(), rendered(threads=1).film_state())


@pytest.mark.parametrize("window", [(0, 0, 48, 40), (5, 7, 20, 18), (17, 3, 1, 1), (40, 32, 8, 8), (0, 39, 48, 1)])
def test_a_window_is_cut_from_the_picture(window: tuple[int, int, int, int]) -> None:
    x, y, width, height = window
    whole, part = rendered().film_state(), rendered(Film(48, 40, window)).film_state()
    assert np.array_equal(part, whole[y : y + height, x : x + width])


def test_ranges_merge_to_the_whole() -> None:
    whole = rendered(count=16, samples=16)
    first, second, third = rendered(count=8), rendered(first=8, count=5), rendered(first=13, count=3)
    for order in ([first, second, third], [third, first, second]):
        merged = rendered(count=0)
        for part in order:
            merged.add_film_state(part.film_state(), part.iterations)
        assert merged.iterations == 16
        assert np.array_equal(merged.film_state(), whole.film_state())
        assert np.array_equal(merged.read(), whole.read())


def test_iterations_one_by_one_are_the_same() -> None:
    whole, steps = rendered(), rendered(count=0)
    for _ in range(8):
        steps.iterate(1)
    assert np.array_equal(steps.film_state(), whole.film_state())


def test_film_state_is_the_exact_sum_of_iterations() -> None:
    """Every iteration read alone, added as fractions, is the sum that the film holds and the mean that it reads.
    Without splats, whose sums have more bits than what is read."""
    film = Film(6, 5)
    total = np.zeros((5, 6, 4), object)
    for i in range(8):
        single = rendered(film, first=i, count=1, splats=False).read()
        total += np.vectorize(Fraction, otypes=[object])(single.astype(object))
    whole = rendered(film, splats=False)
    words = whole.film_state().astype(object)
    held = np.vectorize(lambda low, high: Fraction(int(low) % 2**64, 2**64) + int(high), otypes=[object])(
        words[..., 0], words[..., 1]
    )
    # A sample keeps 64 bits after the point, so each of the 8 lost less than 2^-64
    assert (np.abs(held - total) <= Fraction(8, 2**64)).all()
    np.testing.assert_array_equal(whole.read(), (total / 8).astype(np.float64).astype(np.float32))


ISA_SCRIPT = """
import sys
import numpy as np
from scenes_for_tests import batches, settings
from test_transport import lit_by_area
from vlp_bpt import _native
assert _native.isa == sys.argv[1]
options = settings(samples=64, light_path_length=2, eye_path_length=4, light_paths=500)
np.save(sys.argv[2], batches(lit_by_area(), options, 12, int(sys.argv[3])))
"""


def test_instruction_sets_agree(tmp_path: Path) -> None:
    """Rounding sends paths other ways, so pictures agree in the mean: other seeds, a false-alarm rate of 1e-4."""
    if not _native.cpu_supports_avx2():
        pytest.skip("this processor has no AVX2")
    found: dict[str, Array] = {}
    folder = Path(__file__).parent
    for seed, isa in ((0, "baseline"), (100, "avx2")):
        path = os.pathsep.join([str(folder), str(folder.parent), *sys.path])
        env = os.environ | {"VLP_BPT_ISA": isa, "PYTHONPATH": path}
        file = tmp_path / f"{isa}.npy"
        subprocess.run([sys.executable, "-c", ISA_SCRIPT, isa, str(file), str(seed)], env=env, check=True)
        found[isa] = blocks(np.load(file))
    assert_same_mean(found["baseline"], found["avx2"], "instruction sets")


def test_settings_by_name_render_alike() -> None:
    scene = lit_by_area()
    a, b = Renderer(scene, settings()), Renderer(scene, RenderSettings.from_dict(settings().to_dict()))
    assert a.iterate(2) == b.iterate(2) == 2
    assert np.array_equal(a.film_state(), b.film_state())
