"""`vlp-bpt bench`: what it measures, and which file does so."""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Sequence

from vlp_bpt.errors import Error

COMMANDS = {
    "modes": "speed and error over time of the modes, beside Cycles (what `vlp-bpt bench` alone does)",
    "paper": "the experiment of Celestino et al. 2014: its Figure 3, SSIM over time, path lengths at equal time",
    "peers": "beside Cycles, Mitsuba and LuxCore, each in its own process, at equal time",
    "denoised": "time to an SSIM with Open Image Denoise, beside Cycles",
    "start": "from Blender's scene to the first iteration: time and memory beside Cycles",
    "growth": "time and memory as triangles, lights, pixels and threads grow",
}
FAILED, INTERRUPTED = 1, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a benchmark and returns the exit code: 0, 1 (it failed), 2 (it was asked wrongly), 130 (interrupted)."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    name = words.pop(0) if words and words[0] in COMMANDS else "modes"
    module = importlib.import_module(f".{name}", __name__)
    others = "\n".join(f"  vlp-bpt bench {command:9}{text}" for command, text in COMMANDS.items())
    parser = argparse.ArgumentParser(
        prog=f"vlp-bpt bench {name}",
        description=module.__doc__,
        epilog=f"the benchmarks, each with --help:\n{others}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    module.add_arguments(parser)
    options = parser.parse_args(words)
    try:
        module.run(options)
    except Error as error:
        print(f"vlp-bpt: {error}", file=sys.stderr)
        return FAILED
    except KeyboardInterrupt:
        print("vlp-bpt: interrupted", file=sys.stderr)
        return INTERRUPTED
    return 0
