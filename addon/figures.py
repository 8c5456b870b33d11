"""What the last render did and took, for the statistics panel, the status line and the file's metadata."""

from __future__ import annotations

from typing import Any

# Lines of the last render of each scene and view layer: written by the render thread, read when the panel is drawn.
last: dict[tuple[str, str], list[tuple[str, str]]] = {}


def lines(
    statistics: Any, total_seconds: float, lost: tuple[float, float], warnings: list[str]
) -> list[tuple[str, str]]:
    """(label, value) for the panel, from `vlp_bpt.Statistics` and `Renderer.lost_light`."""
    rows = [
        ("Iterations", f"{statistics.iterations:,}"),
        *([("Noise", f"{statistics.noise:.2g}")] if statistics.noise is not None else []),
        ("Render Time", duration(statistics.seconds)),
        *([("Denoising", duration(statistics.denoise_seconds))] if statistics.denoise_seconds else []),
        ("Total Time", duration(total_seconds)),
        ("Camera Paths", f"{statistics.eye_samples_per_second / 1e6:.2f} M/s"),
        ("Light Paths", f"{statistics.light_paths_per_second / 1e6:.2f} M/s"),
        ("Virtual Lights", f"{statistics.vlps:,}" if statistics.first_connections else "Unused"),
        *([("Light Sent To", guide(statistics))] if guide(statistics) else []),
        ("Memory", memory(statistics.memory_bytes)),
    ]
    share, error = lost
    rows.append(("Lost Light", f"{100 * share:.1f} % ± {100 * error:.1f} %, in longer paths"))
    if statistics.dropped:
        rows.append(("Dropped Samples", f"{statistics.dropped:,}"))
    return rows + [("Warning", warning) for warning in warnings]


def status(statistics: Any, progress: Any) -> str:
    """The line above the picture while it renders, from `vlp_bpt.Statistics` and `Progress`."""
    rate = statistics.eye_samples_per_second + statistics.light_paths_per_second
    parts = [
        f"Iteration {progress.iterations}/{progress.samples}",
        f"{rate / 1e6:.2f} Mpaths/s",
        f"{statistics.vlps:,} VLPs",
        f"Mem {memory(statistics.memory_bytes)}",
    ]
    if progress.noise is not None:
        parts.append(f"Noise {progress.noise:.2g}")
    if progress.remaining is not None:
        minutes, seconds = divmod(round(progress.remaining), 60)
        parts.append(f"{minutes // 60}:{minutes % 60:02d}:{seconds:02d} left")
    return " | ".join(parts)


def guide(statistics: Any) -> str:
    """What light paths are sent to or begun at above all, as "2 windows, 3 lights"; empty where nothing stands out."""
    found = ((statistics.portals, "window"), (statistics.favoured_lights, "light"))
    return ", ".join(f"{count} {name}{'s' if count > 1 else ''}" for count, name in found if count)


def duration(seconds: float) -> str:
    """Hours, minutes, seconds and hundredths, as 00:01:02.34."""
    hundredths = round(seconds * 100)
    minutes, hundredths = divmod(hundredths, 6000)
    return f"{minutes // 60:02d}:{minutes % 60:02d}:{hundredths // 100:02d}.{hundredths % 100:02d}"


def memory(size: float) -> str:
    return f"{size / 2**20:.1f} MB" if size < 2**30 else f"{size / 2**30:.2f} GB"
