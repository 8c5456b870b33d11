"""The benchmark of starts: its ratios and its page, what it makes of Cycles' words, and a short run of it."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from vlp_bpt import Error
from vlp_bpt.bench import main, start_engines
from vlp_bpt.bench.remote import apart
from vlp_bpt.bench.start import COSTS, ratio, report, verdict
from vlp_bpt.bench.start_engines import CYCLES, OURS, Start, Watch, part_of

MIB = 2**20
CORNELL = Path(__file__).resolve().parents[2] / "scenes" / "cornell_box.blend"
SECONDS, PROCESSOR, PEAK, HELD = COSTS


def starts(engine: str, seconds: list[float], peak: int | None = 100 * MIB) -> list[Start]:
    return [Start(engine, 1, s, 2 * s, peak, peak, {"tree": 0.5 * s}) for s in seconds]


def test_the_ratio_is_the_median_over_neighbours() -> None:
    ours, theirs = starts(OURS, [1, 20, 3]), starts(CYCLES, [2, 20, 2])  # the machine was busy once
    assert ratio(SECONDS, ours, theirs) == pytest.approx(1.0)
    assert ratio(PROCESSOR, ours, theirs) == pytest.approx(1.0)
    assert ratio(PEAK, starts(OURS, [1], 120 * MIB), starts(CYCLES, [1])) == pytest.approx(1.2)


def test_what_a_system_does_not_tell_has_no_ratio() -> None:
    assert ratio(PEAK, starts(OURS, [1], None), starts(CYCLES, [1], None)) is None
    assert verdict(PEAK, None) == "-"


def test_a_ratio_is_held_against_what_may_be_taken() -> None:
    assert verdict(SECONDS, 1.0) == "1: yes"
    assert verdict(SECONDS, 1.01) == "1: NO"
    assert verdict(PEAK, 1.19) == "1.2: yes"
    assert verdict(HELD, 7.0) == "-"  # nothing is asked of it


def test_the_page_has_a_table_for_each_number_of_threads() -> None:
    runs = [*starts(OURS, [1, 1, 1]), *starts(CYCLES, [2, 2, 2])]
    page = report("million", 32, runs + [replace(s, threads=2, seconds=3.0) for s in runs])
    assert "medians of 3 starts" in page
    assert "| 1 thread " in page and "| 2 threads " in page
    assert "| seconds                            | 1       | 2      | 0.5   | 1: yes   |" in page
    assert "Cycles: tree 1.000 s, the rest 1.000 s." in page


@pytest.mark.parametrize(
    ("words", "part"),
    [
        ("Mem: 0M | Synchronizing object | ball 47", "reading the scene"),
        ("Mem: 31M | Updating Scene BVH | Building BVH 0%", "tree"),
        ("Mem: 0M | Updating Meshes", ""),
        ("Mem: 85M | Sample 0/1", ""),
    ],
)
def test_parts_are_told_by_what_cycles_says(words: str, part: str) -> None:
    assert part_of(words) == part


def test_a_watch_ends_at_the_first_iteration() -> None:
    watch = Watch()
    with pytest.raises(Error, match="no iteration"):
        watch.result(OURS, 1)
    watch.begin()
    owner = SimpleNamespace(add=sum)
    watch.time(owner, "add", "sum")
    assert owner.add([1, 2]) == 3
    watch.end()
    first = watch.result(OURS, 1)
    watch.end()
    assert watch.result(OURS, 1) == first
    assert list(first.parts) == ["sum"]
    assert 0 <= first.parts["sum"] <= first.seconds


def failing() -> None:
    raise Error("on purpose")


def test_work_in_a_process_of_its_own_answers_or_says_what_went_wrong() -> None:
    assert apart("sum", sum, [1, 2]) == 3
    with pytest.raises(Error, match="sum: TypeError"):
        apart("sum", sum, 1)
    with pytest.raises(Error, match="it: on purpose"):
        apart("it", failing)


def test_starts_run(tmp_path: Path) -> None:
    pytest.importorskip("bpy")
    words = ["start", str(CORNELL), "--runs", "1", "--threads", "1", "--size", "8", "--output", str(tmp_path)]
    assert main(words) == 0
    with (tmp_path / "start.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["engine"] for row in rows] == list(start_engines.ENGINES)
    assert all(float(row["seconds"]) > 0 and "tree" in row["parts"] for row in rows)
    assert "The scene cornell_box at 8 x 8 pixels" in (tmp_path / "report.md").read_text()


def test_only_blender_files_are_started(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    snapshot = tmp_path / "room.vlp.npz"
    snapshot.touch()
    assert main(["start", str(snapshot)]) == 1
    assert "only a .blend" in capsys.readouterr().err
    assert main(["start", "--runs", "0"]) == 1
