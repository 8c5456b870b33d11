"""The benchmarks' arithmetic on known curves and noise, what they write, and short runs of them."""

from __future__ import annotations

import csv
import importlib
import os
from dataclasses import dataclass, field
from importlib import util
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from small_scenes import room

from vlp_bpt import Error, RenderSettings
from vlp_bpt.bench import agreement, claims, contestants, growth, main, peers, peers_report, plots, sweep
from vlp_bpt.bench.contestants import Contestant, Mitsuba, Ours, race
from vlp_bpt.bench.measure import Point, add_point, ladder, seconds_to, slope, ssim_at
from vlp_bpt.bench.remote import Remote, State
from vlp_bpt.snapshot import Snapshot, save_snapshot


def power_law(times: list[float], at_one: float = 0.2, exponent: float = 0.5) -> list[Point]:
    """Points whose 1 - SSIM_c is at_one * seconds**-exponent; ten samples a second."""
    return [Point(t, int(10 * t), 0.0, 1 - at_one * t**-exponent, 0.0, 1 / t) for t in times]


@pytest.fixture
def snapshot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A small scene in a folder of its own, where everything is written."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "room.vlp.npz"
    save_snapshot(path, Snapshot(room(24, 16), RenderSettings(), {}))
    return path


def read_csv(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


# Curves


def test_seconds_to_an_ssim_are_between_the_points_by_the_logarithms() -> None:
    points = power_law([1, 2, 8, 32])
    found = seconds_to(points, 1 - 0.2 * 5**-0.5)
    assert found is not None
    assert (found.kind, found.seconds) == ("", pytest.approx(5, rel=1e-9))
    assert str(found) == "5"


def test_seconds_to_an_ssim_outside_of_the_points_say_so() -> None:
    points = power_law([1, 2, 8, 32])
    beyond = seconds_to(points, 1 - 0.2 * 128**-0.5)
    assert beyond is not None
    assert (beyond.kind, beyond.seconds) == ("~", pytest.approx(128, rel=1e-9))
    before = seconds_to(points, 0.7)
    assert before is not None
    assert str(before) == "<1"
    assert seconds_to(points, 1 - 1e-6) is None  # thousands of times further than measured
    assert seconds_to([points[1], points[0]], 0.999) is None  # gets worse
    assert seconds_to(power_law([1, 2], exponent=1e-6), 0.998) is None  # hardly gets better


def test_ssim_at_a_time_or_a_number_of_samples() -> None:
    points = power_law([1, 4, 16])
    assert ssim_at(points, 9) == pytest.approx(1 - 0.2 / 3, rel=1e-9)
    assert ssim_at(points, 90, samples=True) == pytest.approx(1 - 0.2 / 3, rel=1e-9)
    assert ssim_at(points, 0.5) is None
    assert ssim_at(points, 17) is None


def test_the_ladder_ends_where_it_is_told() -> None:
    assert ladder(5) == [0.25, 0.5, 1, 2, 5]
    assert ladder(7) == [0.25, 0.5, 1, 2, 5, 7]
    assert slope([1, 10, 100], [2, 63.2455532, 2000]) == pytest.approx(1.5)


# Agreement


def batches_of(picture: np.ndarray, noise: float, count: int, seed: int = 0) -> list[tuple[np.ndarray, float]]:
    random = np.random.default_rng(seed)
    return [(picture * (1 + noise * random.normal(size=picture.shape)), 1.0 + i) for i in range(count)]


PICTURE = np.linspace(0.2, 1.0, 64 * 64 * 3).reshape(64, 64, 3)
(_FIRST, _), (_SECOND, _) = batches_of(PICTURE, 0.05, 2, seed=9)
HALVES = (_FIRST, _SECOND)


def test_the_same_picture_agrees() -> None:
    found = agreement.compare(batches_of(PICTURE, 0.1, 8), HALVES)
    assert found.agrees
    assert str(found).startswith("yes")


def test_a_region_that_is_brighter_does_not_agree() -> None:
    wrong = PICTURE.copy()
    wrong[16:32, 32:48, 1] *= 1.04
    found = agreement.compare(batches_of(wrong, 0.1, 8), HALVES)
    assert not found.agrees
    assert found.region == (1, 2, 1)
    assert found.region_difference == pytest.approx(0.04, abs=0.01)
    assert abs(found.difference) < 0.005  # the mean alone would not have shown it
    assert "at region (1, 2, 1)" in str(found)


def test_a_picture_upside_down_does_not_agree() -> None:
    assert not agreement.compare(batches_of(PICTURE[::-1], 0.1, 8), HALVES).agrees


def test_few_batches_raise_no_false_alarms() -> None:
    for seed in range(200):
        assert agreement.compare(batches_of(PICTURE, 1.0, 2, seed), HALVES).agrees


def test_noise_is_told_from_agreement() -> None:
    found = agreement.compare(batches_of(PICTURE, 4.0, 8), HALVES)
    assert found.agrees
    assert "noise" in str(found)


def test_increments_are_the_batches_of_running_means() -> None:
    parts = batches_of(PICTURE, 0.5, 8)
    running, total = [], np.zeros_like(PICTURE)
    for i, (picture, weight) in enumerate(parts):
        total = total + picture * weight
        running.append((total / sum(w for _, w in parts[: i + 1]), sum(w for _, w in parts[: i + 1])))
    found = agreement.increments(running)
    assert sum(weight for _, weight in found) == sum(weight for _, weight in parts)
    assert min(weight for _, weight in found) >= agreement.LEAST_BATCH * 36
    np.testing.assert_allclose(found[-1][0], parts[-1][0], rtol=1e-9)
    first = sum(p * w for p, w in parts[:3]) / 6  # weights 1 + 2 + 3 are the first to be enough
    np.testing.assert_allclose(found[0][0], first, rtol=1e-9)


# Processes


@dataclass
class Counter(Contestant):
    """Renders nothing: counts seconds, and fails as it is told."""

    fails: str = ""
    total: float = field(default=0.0, init=False)

    @property
    def window(self) -> str:
        return f"process {os.getpid()}"

    def prepare(self) -> None:
        if self.fails == "error":
            raise Error("material 'paint' shines")
        if self.fails == "exit":
            os._exit(7)

    def run(self, seconds: float) -> None:
        self.total += seconds
        self._count(seconds, int(1000 * seconds))

    def picture(self) -> np.ndarray:
        return np.full((2, 3, 3), self.total)


def test_a_remote_contestant_works_in_a_process_of_its_own() -> None:
    with Remote(Counter("counter")) as remote:
        remote.prepare()
        assert remote.window != f"process {os.getpid()}"
        remote.run(1.5)
        remote.run(0.5)
        assert (remote.seconds, remote.eye_samples, remote.rates) == (2.0, 2000, [1000.0, 1000.0])
        np.testing.assert_array_equal(remote.picture(), np.full((2, 3, 3), 2.0))
        assert remote.state.memory > 1 << 20


@pytest.mark.parametrize(("fails", "words"), [("error", "counter: material 'paint' shines"), ("exit", "exit code 7")])
def test_a_remote_failure_is_told(fails: str, words: str) -> None:
    with Remote(Counter("counter", fails=fails)) as remote, pytest.raises(Error, match=words):
        remote.prepare()


def test_race_goes_by_turns_to_the_same_instants() -> None:
    order: list[tuple[str, int]] = []
    runners = [Counter("a"), Counter("b")]
    race(runners, [1.0, 3.0], lambda c, i: order.append((c.name, i)))
    assert order == [("a", 0), ("b", 0), ("b", 1), ("a", 1)]
    assert [r.seconds for r in runners] == [3.0, 3.0]


# Peers


@pytest.mark.parametrize("overhead, pace", [(2.0, 0.04), (0.001, 0.1)])
def test_mitsuba_pays_for_a_launch_once(overhead: float, pace: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """In slices it makes about as many samples as in one go, whatever a launch costs without samples."""
    clock = SimpleNamespace(now=0.0)
    noise = np.random.default_rng(1)

    def launch(_loaded: Any, samples: int, _seed: int) -> np.ndarray:
        clock.now += (overhead + pace * samples) * noise.uniform(0.95, 1.05)
        return np.ones((512, 512, 3))

    monkeypatch.setattr(contestants.time, "perf_counter", lambda: clock.now)
    monkeypatch.setattr(contestants.mitsuba, "load", lambda *_: None)
    monkeypatch.setattr(contestants.mitsuba, "launch", launch)
    mitsuba = Mitsuba("Mitsuba", room(512, 512), 64)
    mitsuba.prepare()
    race([mitsuba], peers.instants(15.0), lambda *_: None)
    assert mitsuba.seconds == pytest.approx(15.0, rel=0.1)
    in_one_go = (mitsuba.seconds - overhead) / pace * 512 * 512
    assert mitsuba.eye_samples == pytest.approx(in_one_go, rel=0.15)
    assert mitsuba.picture() == pytest.approx(1.0)


def outcome(name: str, **values: Any) -> Any:
    state = State(window="", notes=["spheres are meshes"], processor=3.0, wall=2.0, memory=100 << 20)
    found = agreement.Agreement(0.001, (0, 0, 0), 0.002, 0.001, 0.002, True)
    base = {"scene": "box", "name": name, "state": state, "agreement": found, "own": False}
    return SimpleNamespace(**base, points=power_law([1, 4, 16]) if "points" not in values else values["points"])


def test_peers_write_tables(tmp_path: Path) -> None:
    peers_report.write(
        tmp_path, "As said.", [outcome("ours"), outcome("theirs", points=[])], ["luxcore is gone"], False
    )
    rows = read_csv(tmp_path / "results.csv")
    assert [row["renderer"] for row in rows] == ["ours"]
    assert float(rows[0]["processors"]) == 1.5
    assert float(rows[0]["seconds_to_0.93"]) == pytest.approx((0.2 / 0.07) ** 2, rel=0.05)
    assert len(read_csv(tmp_path / "curves.csv")) == 3
    page = (tmp_path / "report.md").read_text()
    assert "- luxcore is gone" in page
    assert "spheres are meshes" in page
    line = next(line for line in page.splitlines() if line.startswith("| theirs"))
    assert line.count(" - ") == 12  # it has no picture to judge


def test_missing_peers_are_named_with_what_installs_them(
    snapshot: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    find = util.find_spec
    monkeypatch.setattr(util, "find_spec", lambda name, *rest: None if name == "pyluxcore" else find(name, *rest))
    assert peers.missing(["vlp-bpt", "luxcore"]) == [
        "luxcore is missing and takes no part: pip install pyluxcore, or make bench-peers"
    ]
    words = ["--scenes", str(snapshot), "--size", "24", "--seconds", "0.8", "--reference-seconds", "0.8", "--no-plots"]
    assert main(["peers", *words, "--peers", "vlp-bpt", "cycles", "luxcore"]) == 0
    page = Path("out/bench-peers/report.md").read_text()
    assert "- luxcore is missing" in page
    assert "Cycles: renders .blend files alone" in page
    rows = read_csv(Path("out/bench-peers/results.csv"))
    assert [(row["renderer"], row["agrees"]) for row in rows] == [("VLP-BPT", "True")]
    assert "same picture" in capsys.readouterr().out


def test_a_scene_that_is_not_there_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    for command in (["peers", "--no-plots"], ["paper", "--no-plots"], ["modes"]):
        assert main([*command, "--scenes", "nowhere"]) == 1
        assert "scene 'nowhere'" in capsys.readouterr().err


# The paper


def test_paper_runs_and_says_what_holds(snapshot: Path) -> None:
    words = ["--scenes", str(snapshot), "--size", "24", "--seconds", "0.6", "--reference-seconds", "0.5"]
    assert main(["paper", *words, "--sweep-seconds", "0.05", "--sweep-l", "0", "1", "2", "--sweep-k", "2", "3"]) == 0
    folder = Path("out/bench-paper")
    rows = read_csv(folder / "iterations.csv")
    assert [row["device"] for row in rows] == ["CPU"] * len(rows)
    assert len(rows) == 3  # after 0.25, 0.5 and 0.6 s
    counts = [int(row["iterations"]) for row in rows]
    assert counts == sorted(counts)
    assert [(row["L"], row["K"]) for row in read_csv(folder / "sweep.csv")] == [
        ("0", "2"), ("1", "2"), ("2", "2"), ("0", "3"), ("1", "3"), ("2", "3"),
    ]  # fmt: skip
    for name in ("figure3.png", "ssim.png", "sweep.png"):
        assert (folder / name).read_bytes()[:4] == b"\x89PNG"
    assert "gives the best SSIM after 0.05 s" in (folder / "report.md").read_text()


def test_paper_refuses_a_device_that_there_is_not(snapshot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["paper", "--scenes", str(snapshot), "--no-plots", "--device", "toaster"]) == 1
    assert "--device toaster" in capsys.readouterr().err


def curve(scene: str, points: list[Point]) -> Any:
    rate = points[-1].samples / points[-1].seconds
    return SimpleNamespace(scene=scene, device="CPU", points=points, iterations_per_second=rate)


def test_claims_hold_or_not_by_what_was_measured() -> None:
    quoted = SimpleNamespace(ssim={1: 0.79, 5: 0.95, 60: 0.998}, iterations={"PC2": (10, 50), "PC3": (10, 200)})
    found = claims.claims([curve("box", power_law([0.5, 1, 4, 16]))], {}, {"box": quoted}, 5)
    verdicts = {claim.text: claim.verdict for claim in found}
    assert verdicts == {
        "box: SSIM 0.79 after 1 s (GTX 780)": claims.HOLDS,  # 0.8
        "box: SSIM 0.79 after 20 iterations (1 s of PC3)": claims.HOLDS,  # at 10 a second here after 2 s
        "box: SSIM 0.95 after 5 s (GTX 780)": claims.FAILS,  # 0.91
        "box: SSIM 0.95 after 100 iterations (5 s of PC3)": claims.FAILS,
        "box: SSIM 0.998 after 60 s (GTX 780)": claims.UNTESTED,
        "box: SSIM 0.998 after 1200 iterations (60 s of PC3)": claims.UNTESTED,
        "box: 50 iterations in 10 s (PC2)": claims.HOLDS,  # 100
        "box: 200 iterations in 10 s (PC3)": claims.FAILS,
        "box: iterations grow in proportion to time (Figure 3)": claims.HOLDS,
    }


def cell(L: int, K: int, ssim: float, spread: float = 0.001) -> sweep.Cell:
    return sweep.Cell(L, K, 5.0, 10, ssim, spread, 0.1, 0.08)


def test_the_claim_about_light_paths_is_held_against_the_noise() -> None:
    def verdict(*cells: sweep.Cell) -> str:
        return claims.shortest_light_paths("box", list(cells), 5).verdict

    assert verdict(cell(1, 5, 0.9), cell(2, 5, 0.8)) == claims.HOLDS
    assert verdict(cell(1, 5, 0.8), cell(2, 5, 0.9)) == claims.FAILS
    assert verdict(cell(1, 5, 0.8), cell(2, 5, 0.9), cell(1, 3, 0.9), cell(2, 3, 0.7)) == claims.PARTLY
    assert verdict(cell(1, 5, 0.8995), cell(2, 5, 0.9)) == claims.HOLDS  # within the noise
    assert verdict(cell(0, 5, 0.99), cell(1, 5, 0.9), cell(2, 5, 0.8)) == claims.HOLDS  # L = 0 has no VLPs


def test_the_sweep_parts_noise_from_lost_light() -> None:
    random = np.random.default_rng(0)
    truth = np.full((32, 32, 3), 0.5)
    first, second = (0.45 + 0.02 * random.normal(size=truth.shape) for _ in range(2))
    found = sweep.judge(1, 5, (first, 1.0, 3), (second, 1.0, 4), (truth, truth))
    scale = 0.5**2 + 0.01
    assert found.noise == pytest.approx(0.02**2 / 2 / scale, rel=0.1)
    assert found.lost == pytest.approx(0.05**2 / scale, rel=0.1)
    assert (found.seconds, found.iterations) == (2.0, 7)


# Growth


def grown(axis: str, sizes: list[int], cost: Any) -> list[growth.Sample]:
    return [
        growth.Sample(axis, n, cost(n), cost(n), cost(n), cost(n), 1, int(1e6 * cost(n)), int(1e6 * cost(n)))
        for n in sizes
    ]


def test_growth_worse_than_n_log_n_is_found() -> None:
    sizes = [1000, 10_000, 100_000, 1_000_000]
    quadratic = growth.fitted("triangles", grown("triangles", sizes, lambda n: 1e-9 * n**1.5))
    assert all(fit.worse and fit.late == pytest.approx(1.5, rel=1e-3) for fit in quadratic)
    fair = growth.fitted("triangles", grown("triangles", sizes, lambda n: 1e-6 * n * np.log(n + 1)))
    assert not any(fit.worse for fit in fair)
    assert all(fit.against == pytest.approx(1, abs=1e-3) for fit in fair)
    page = growth.report(grown("triangles", sizes, float), quadratic, [])
    assert "Grows faster than n log n: build over triangles" in page


def test_the_serial_share_is_that_of_amdahl() -> None:
    samples = grown("threads", [1, 2, 3, 4], lambda p: 2.0 * (0.1 + 0.9 / p))
    assert growth.serial_share(samples) == pytest.approx(0.1)
    assert growth.serial_share(samples[:1]) is None


def test_growth_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--most-triangles", "1000", "--most-lights", "1", "--most-side", "256", "--most-threads", "1"]
    assert main(["growth", *words, "--seconds", "0.01", "--output", str(tmp_path / "growth")]) == 0
    rows = read_csv(tmp_path / "growth" / "growth.csv")
    assert [row["axis"] for row in rows] == ["triangles", "lights", "pixels", "threads"]
    assert all(float(row["iteration_seconds"]) > 0 and int(row["core_bytes"]) > 0 for row in rows)
    assert main(["growth", "--most-triangles", "7", "--output", str(tmp_path), "--no-plots"]) == 1
    assert "sizes up to 7" in capsys.readouterr().err


def test_growth_scenes_have_the_size_that_is_asked_for() -> None:
    from vlp_bpt.bench.growth_scenes import balls_and_lamps

    scene = balls_and_lamps(100_000, 20, 64)
    assert not scene.validate()
    assert sum(len(g.triangles) for g in scene.geometries) == pytest.approx(100_000, rel=0.05)
    assert sum(light.power[0] for light in scene.lights) == pytest.approx(40)


# Plots


def test_without_matplotlib_it_is_said_what_to_do(
    snapshot: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    load = importlib.import_module

    def without(name: str, *rest: Any) -> Any:
        if name.startswith("matplotlib"):
            raise ImportError("no module named matplotlib")
        return load(name, *rest)

    monkeypatch.setattr(plots.importlib, "import_module", without)
    assert main(["growth"]) == 1
    assert "pip install matplotlib" in capsys.readouterr().err


def test_points_that_add_nothing_are_left_out() -> None:
    points: list[Point] = []
    for point in power_law([1, 1, 2]):
        add_point(points, point)
    assert [p.seconds for p in points] == [1, 2]


def test_ours_stops_at_the_time_it_is_given(snapshot: Path) -> None:
    runner = Ours("ours", room(24, 16), RenderSettings(samples=1 << 30))
    runner.run(0.2)
    assert 0.1 < runner.seconds < 2
    assert runner.picture().shape == (16, 24, 3)
