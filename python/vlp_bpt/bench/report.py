"""What every benchmark writes besides plots: Markdown tables and pages, CSV files, and what machine it was."""

from __future__ import annotations

import csv
import os
import platform
from collections.abc import Sequence
from pathlib import Path

from vlp_bpt import __version__
from vlp_bpt.render import devices

Cell = str | int | float | bool | None


def markdown_table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """A Markdown table with its columns aligned."""
    widths = [max(len(line[i]) for line in [head, *lines]) for i in range(len(head))]
    rule = ["-" * width for width in widths]
    return "\n".join(
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) + " |"
        for line in [head, rule, *lines]
    )


def write_csv(path: Path, rows: Sequence[dict[str, Cell]]) -> None:
    """A line for each row; the columns are those of the first, all rows have the same."""
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]) if rows else [])
        writer.writeheader()
        writer.writerows(rows)


def number(value: float | None, digits: int = 3) -> str:
    """Some significant digits; a dash for what is not known."""
    return "-" if value is None else f"{value:.{digits}g}"


def machine() -> str:
    """The devices, the processor and the versions, in one sentence."""
    names = ", ".join(f"{d['name']} ({d['isa']})" if d["kind"] == "CPU" else str(d["name"]) for d in devices())
    other = " (busy with other work: times are too long)" if busy() else ""
    return (
        f"VLP-BPT {__version__} on {names}; {processor()}, {os.cpu_count()} cores{other}, {platform.system()}, "
        f"Python {platform.python_version()}."
    )


def busy() -> bool:
    """Whether this machine, on which a benchmark has just kept all cores at work, has had much more to do than that."""
    return hasattr(os, "getloadavg") and os.getloadavg()[0] > 1.5 * (os.cpu_count() or 1)


def processor() -> str:
    """The processor's name as the system has it."""
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()
