"""kernel-resources.py LOG LIBRARY NVDISASM LIMITS: what each kernel takes, as tables; fails where one takes too much.

LOG is what ptxas -v says and LIBRARY what it made, uncompressed. LIMITS is a Markdown file that begins with the first
table: registers, stack (bytes), spill stores and loads (bytes, with the functions that the kernel calls). Kernels that
stand in one of LOG and LIMITS alone fail too. The second table counts instructions by function: all, those in double
precision, and those of the special function units (MUFU: reciprocals, roots) with the files that most of them come
from. With --write both tables are written to LIMITS instead.
"""

from __future__ import annotations

import re
import struct
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

HEAD = ("kernel", "architecture", "registers", "stack", "spill stores", "spill loads")
COUNTED = ("function", "instructions", "double precision", "special functions", "most of them in")
FILES = 4  # named at most
Row = tuple[str, ...]
Table = dict[Row, tuple[Any, ...]]

_PASSES = "LightPass|CountStored|ListStored|EyePass|GuidedEyePass|Commit|AddMoments|TellVariance"
_WAVEFRONT = "CountSamples|FindSurfaces|CountKinds|SortPaths|GatherLight|SeeConnections"
_OF_SINKS = "BeginPaths|ArriveAtSurfaces|GoOn|MeanSamples"
_BENCH = "(?:Wide|Compressed)(?:Closest|Any)"
_KERNEL = re.compile(rf"\d(?:({_PASSES}|{_WAVEFRONT}|{_BENCH})|({_OF_SINKS})INS_\d+(Pixel|Guided)SinkEE)E")
_MACHINE_CUDA = 190
_DOUBLE = re.compile(r"D(ADD|MUL|FMA|SETP|MNMX)\b|MUFU\.\w+64H|[FI]2[FI]\S*F64")


def kernel_of(symbol: str) -> str:
    """The name of a kernel of our own; "" for another."""
    if not (match := _KERNEL.search(symbol)):
        return ""
    return match[1] or match[2] + (" with guides" if match[3] == "Guided" else "")


def parse_log(text: str) -> Table:
    """{(kernel, architecture): (registers, stack, spill stores, spill loads)} of our own kernels."""
    table: Table = {}
    entry: Row | None = None
    stack = stores = loads = 0
    for line in text.splitlines():
        if match := re.search(r"Compiling entry function '(\S+)' for 'sm_(\w+)'", line):
            name = kernel_of(match[1])
            entry = (name, f"sm_{match[2]}") if name else None
            stack = stores = loads = 0
        elif match := re.search(r"(\d+) bytes stack frame, (\d+) bytes spill stores, (\d+) bytes spill loads", line):
            stack, stores, loads = max(stack, int(match[1])), stores + int(match[2]), loads + int(match[3])
        elif (match := re.search(r"Used (\d+) registers", line)) and entry:
            cumulative = re.search(r"(\d+) bytes cumulative stack size", line)
            table[entry] = (int(match[1]), int(cumulative[1]) if cumulative else stack, stores, loads)
            entry = None
    return table


def cubins(library: bytes) -> Iterator[bytes]:
    """The GPU's programs in a library: 64-bit ELF files of their own."""
    at = library.find(b"\x7fELF\x02")
    while at >= 0:
        machine, sections = struct.unpack_from("<18xH20xQ", library, at)
        size, count = struct.unpack_from("<HH", library, at + 58)
        if machine == _MACHINE_CUDA:
            yield library[at : at + sections + size * count + 2**20]  # what stands behind it does no harm
        at = library.find(b"\x7fELF\x02", at + 1)


def count_instructions(assembly: str) -> Table:
    """{(kernel, architecture, function): (all, double, special, files)}; the library's divisions are one function."""
    counts: dict[Row, Counter[str]] = {}
    files: dict[Row, Counter[str]] = {}
    architecture = re.search(r"\bsm_(\d+\w?)", assembly)
    kernel = function = file = ""
    for line in assembly.splitlines():
        if match := re.match(r"\s*\.section\s+\.text\.(\S+?),", line):
            kernel = kernel_of(match[1])
            function = "the kernel itself" if kernel else ""
        elif match := re.match(r"\s*\.type\s+\$\S+\$(\S+),@function", line):
            function = re.sub(r"^_ZN3vlp(\d+)(.*)", lambda m: m[2][: int(m[1])], match[1])
            function = "divisions and roots" if function.startswith("__cuda_") else function
        elif match := re.search(r'//## File "\S*?(?:native/)?(\w+/\w+\.\w+|\w+)", line \d+', line):
            file = match[1]
        elif kernel and (match := re.match(r"\s+/\*[0-9a-f]{4,}\*/\s+\{?\s*(?:@!?U?P\w+\s+)?([A-Z]\S*)", line)):
            key = (kernel, f"sm_{architecture[1] if architecture else ''}", function)
            row = counts.setdefault(key, Counter())
            row["all"] += 1
            row["double"] += bool(_DOUBLE.match(match[1]))
            if match[1].startswith("MUFU"):
                row["special"] += 1
                files.setdefault(key, Counter())[file] += 1
    return {
        key: (row["all"], row["double"], row["special"], _listed(files.get(key, Counter())))
        for key, row in counts.items()
    }


def _listed(files: Counter[str]) -> str:
    return ", ".join(f"{file} {count}" for file, count in files.most_common(FILES))


def disassemble(library: Path, nvdisasm: str) -> Table:
    table: Table = {}
    with tempfile.TemporaryDirectory() as folder:
        for i, cubin in enumerate(cubins(library.read_bytes())):
            path = Path(folder) / f"{i}.cubin"
            path.write_bytes(cubin)
            table |= count_instructions(subprocess.check_output([nvdisasm, "-c", "-g", str(path)], text=True))
    return table


def parse_limits(text: str) -> Table:
    first = text.split("\n\n", maxsplit=1)[0]
    rows = [[cell.strip() for cell in line.strip("| \n").split("|")] for line in first.splitlines()]
    return {(row[0], row[1]): tuple(int(cell) for cell in row[2:]) for row in rows[2:]}


def render(head: tuple[str, ...], table: Table) -> str:
    lines = [head, ["---"] * len(head), *([*key, *map(str, value)] for key, value in sorted(table.items()))]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def main(log: str, library: str, nvdisasm: str, limits: str, *options: str) -> int:
    found = parse_log(Path(log).read_text())
    instructions = disassemble(Path(library), nvdisasm)
    for what, table in ((log, found), (library, instructions)):
        if not table:
            print(f"kernel-resources: {what} tells of no kernel", file=sys.stderr)
            return 1
    text = render(HEAD, found) + "\n" + render((*HEAD[:2], *COUNTED), instructions)
    print(text, end="")
    if "--write" in options:
        Path(limits).write_text(text)
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
