"""What a render takes on its devices, told before it begins."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from .render import load_native, native_errors
from .scene import Mesh, Scene
from .settings import Device, RenderSettings

Memory = dict[str, dict[str, int]]  # bytes, by device ("CPU": the machine's own memory) and by what they are for

_MIB = 2**20


def plan_memory(scene: Scene, native_scene: Any, settings: RenderSettings) -> Memory:
    """What a render with `settings` will take, of a native scene that was built from `scene`.

    A GPU's room for the stacks of its threads is counted where there is one to ask.
    """
    resolved = settings.resolved(scene.film.width, scene.film.height)
    with native_errors():
        planned = load_native().plan_memory(native_scene, resolved.to_dict() | {"iteration_begin": 0})
    return {device: {part: int(size) for part, size in parts.items()} for device, parts in planned.items()}


def total_text(memory: Memory) -> str:
    """What each device takes, in one line."""
    return ", ".join(f"{device} {sum(parts.values()) / _MIB:.1f} MiB" for device, parts in sorted(memory.items()))


def memory_lines(scene: Scene, native_scene: Any, settings: RenderSettings) -> Iterator[str]:
    """What a render takes by parts, on the CPU and with a GPU."""
    triangles = sum(len(g.triangles) for g in scene.geometries if isinstance(g, Mesh))
    for device in (Device.CPU, Device.CUDA):
        memory = plan_memory(scene, native_scene, replace(settings, device=device))
        yield f"memory to render with device={device} (MiB): {total_text(memory)}"
        for name, parts in sorted(memory.items()):
            listed = ", ".join(f"{part.replace('_', ' ')} {size / _MIB:.2f}" for part, size in parts.items())
            yield f"  {name}: {listed}"
            if triangles and device == name:
                geometry, bvh = (parts.get(part, 0) / triangles for part in ("geometry", "bvh"))
                yield f"  {name}: {geometry:.1f} + {bvh:.1f} bytes of geometry and tree for each triangle"
