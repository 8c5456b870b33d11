"""How the command line shows a render that goes on: a bar on a terminal, a plain line now and then elsewhere."""

from __future__ import annotations

import shutil
import sys
import time
from typing import TextIO

from .render import Progress, Renderer, Statistics

_PLAIN_SECONDS = 10.0  # between lines where there is no terminal


class ProgressDisplay:
    """Shows `Progress` on `stream` (standard error). Use as a context: it leaves the terminal's line clean."""

    def __init__(self, stream: TextIO | None = None, *, quiet: bool = False) -> None:
        self._stream = stream if stream is not None else sys.stderr
        self._quiet = quiet
        self._bar = self._stream.isatty()
        self._shown = time.monotonic()
        self._dirty = False

    def __enter__(self) -> ProgressDisplay:
        return self

    def __exit__(self, *_: object) -> None:
        self.clear()

    def clear(self) -> None:
        """Wipes the bar, for a message to be printed in its place."""
        if self._dirty:
            self._stream.write("\r\x1b[K")
            self._stream.flush()
            self._dirty = False

    def show(self, renderer: Renderer, progress: Progress) -> None:
        """Shows where `renderer` stands."""
        if self._quiet:
            return
        text = progress_text(renderer.statistics, progress)
        if self._bar:
            columns = shutil.get_terminal_size().columns
            room = max(min(columns - len(text) - 10, 40), 0)
            filled = round(room * progress.fraction)
            bar = f"[{'#' * filled}{'.' * (room - filled)}] " if room >= 5 else ""
            self._stream.write(f"\r\x1b[K{bar}{text[: columns - 1 - len(bar)]}")
            self._stream.flush()
            self._dirty = True
        elif time.monotonic() - self._shown >= _PLAIN_SECONDS:
            self._shown = time.monotonic()
            print(text, file=self._stream, flush=True)


def progress_text(statistics: Statistics, progress: Progress) -> str:
    """One line: share, iterations, rate, noise, time left."""
    parts = [f"{progress.fraction:4.0%}", f"{progress.iterations}/{progress.samples} iterations"]
    if statistics.eye_samples:
        parts.append(f"{statistics.eye_samples_per_second / 1e6:.2f} Msamples/s")
    if progress.noise is not None:
        parts.append(f"noise {progress.noise:.2g}")
    if progress.remaining is not None and progress.fraction < 1:
        parts.append(f"{duration(progress.remaining)} left")
    return ", ".join(parts)


def lost_light_text(share: float, error: float) -> str:
    """What a user should know about light that the path lengths lose; nothing where it is too little to be seen."""
    if share < 0.005 or share < 3 * error:
        return ""
    return f", {100 * share:.1f} % of the light missing (it takes longer paths than the settings allow)"


def summary_text(statistics: Statistics) -> str:
    """The closing line of a render: iterations, seconds, samples per second and what else it took, noise where told."""
    parts = [
        f"{statistics.iterations} iterations",
        f"{statistics.seconds:.2f} s",
        f"{statistics.eye_samples_per_second / 1e6:.3f} Msamples/s",
        f"{statistics.light_paths_per_second / 1e6:.3f} M light paths/s",
        f"{statistics.vlps} virtual light points" if statistics.first_connections else "no virtual light points",
        f"{statistics.memory_bytes / 2**20:.0f} MiB",
    ]
    if statistics.noise is not None:
        parts.append(f"noise {statistics.noise:.2g}")
    if statistics.denoise_seconds:
        parts.append(f"denoised in {statistics.denoise_seconds:.2f} s")
    if statistics.dropped:
        parts.append(f"{statistics.dropped} samples that were not finite left out")
    return ", ".join(parts)


def duration(seconds: float) -> str:
    """Minutes and seconds, with hours where there are any."""
    minutes, rest = divmod(round(min(seconds, 359999.0)), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
