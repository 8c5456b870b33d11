"""kernel-resources.py LOG LIMITS: what ptxas -v says of each kernel, as a table; fails where one takes too much.

LIMITS is a Markdown table with the columns kernel, architecture, registers, stack, spill stores, spill loads (bytes).
Kernels that stand in one of LOG and LIMITS alone fail too. With --write the table is written to LIMITS instead.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

HEAD = ("kernel", "architecture", "registers", "stack", "spill stores", "spill loads")
Table = dict[tuple[str, str], tuple[int, ...]]


def parse_log(text: str) -> Table:
    """{(kernel, architecture): (registers, stack, spill stores, spill loads)} of our own kernels."""
    table: Table = {}
    entry: tuple[str, str] | None = None
    memory = (0, 0, 0)
    for line in text.splitlines():
        if match := re.search(r"Compiling entry function '(\S+)' for 'sm_(\w+)'", line):
            name = re.search(r"\d(light_pass|list_stored|eye_pass|guided_eye_pass)E", match[1])
            entry = (name[1], f"sm_{match[2]}") if name else None
        elif match := re.search(r"(\d+) bytes stack frame, (\d+) bytes spill stores, (\d+) bytes spill loads", line):
            memory = (int(match[1]), int(match[2]), int(match[3]))
        elif (match := re.search(r"Used (\d+) registers", line)) and entry:
            table[entry] = (int(match[1]), *memory)
            entry = None
    return table


def parse_limits(text: str) -> Table:
    rows = [
        [cell.strip() for cell in line.strip("| \n").split("|")] for line in text.splitlines() if line.startswith("|")
    ]
    return {(row[0], row[1]): tuple(int(cell) for cell in row[2:]) for row in rows[2:]}


def render(table: Table) -> str:
    lines = [HEAD, ["---"] * len(HEAD), *([*key, *map(str, value)] for key, value in sorted(table.items()))]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def main(log: str, limits: str, *options: str) -> int:
    found = parse_log(Path(log).read_text())
    if not found:
        print(f"kernel-resources: {log} tells of no kernel", file=sys.stderr)
        return 1
    print(render(found), end="")
    if "--write" in options:
        Path(limits).write_text(render(found))
        return 0
    allowed = parse_limits(Path(limits).read_text())
    worse = [
        f"{kernel} on {architecture}: {name} {value}, at most {most}"
        for (kernel, architecture), values in found.items()
        for name, value, most in zip(HEAD[2:], values, allowed.get((kernel, architecture), (-1,) * 4), strict=True)
        if value > most
    ]
    worse += [f"{kernel} on {architecture} was not compiled" for kernel, architecture in allowed.keys() - found.keys()]
    for line in worse:
        print(f"kernel-resources: {line}", file=sys.stderr)
    return 1 if worse else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
