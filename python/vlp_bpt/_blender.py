"""What the command line does with .blend files: Blender as the Python module bpy, with the VLP-BPT add-on in it."""

from __future__ import annotations

import importlib
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import vlp_bpt

from .errors import Cancelled, SceneError
from .images import Depth, Image, check_output
from .render import CancelFlag, Progress, Renderer
from .scene import Scene
from .settings import RenderSettings
from .snapshot import Snapshot

Report = Callable[[Renderer, Progress], None]


class BlenderError(SceneError):
    """A .blend file cannot be read or rendered here: names the file or what is missing."""


@dataclass
class BlendRender:
    """What Blender said during a render (warnings) and the renderers that it ran: one a view layer."""

    renderers: list[Renderer]
    warnings: list[str]


def render_blend(
    path: Path, output: Path, depth: Depth | None, frame: int | None, values: dict[str, Any], report: Report
) -> BlendRender:
    """Renders a frame through Blender's own pipeline (layers, compositor, colour management) into `output`.

    `values` are settings that replace the file's. Raises BlenderError, or Cancelled where no iteration was complete.
    """
    bpy = _open(path, frame, values)
    render = bpy.context.scene.render
    render.filepath = str(output.resolve())
    render.use_file_extension = False
    image = render.image_settings
    layers = bpy.context.scene.vlp_bpt.denoise and output.suffix.lower() == ".exr"  # passes are kept in those alone
    if hasattr(image, "media_type"):  # from Blender 5.0 on
        image.media_type = "MULTI_LAYER_IMAGE" if layers else "IMAGE"
    image.file_format = "OPEN_EXR_MULTILAYER" if layers else {".exr": "OPEN_EXR", ".png": "PNG"}[output.suffix.lower()]
    image.color_mode = "RGBA" if render.film_transparent else "RGB"
    bits = {Depth.FLOAT: "32", Depth.HALF: "16", Depth.INT8: "8", Depth.INT16: "16"}
    image.color_depth = bits[check_output(output, depth)]
    result = BlendRender([], [])

    class Watched(Renderer):
        def render(self, progress: Callable[[Progress], None] | None = None, cancel: CancelFlag | None = None) -> Image:
            def both(now: Progress) -> None:
                report(self, now)
                if progress is not None:
                    progress(now)

            if any(renderer.interrupted for renderer in result.renderers):
                raise Cancelled("interrupted in an earlier view layer")
            result.renderers.append(self)
            return super().render(both, cancel)

    output.unlink(missing_ok=True)
    _render(bpy, path, Watched, result.warnings, write_still=True)
    if result.renderers and not any(renderer.iterations for renderer in result.renderers):
        output.unlink(missing_ok=True)  # Blender writes it black
        raise Cancelled(f"'{path}': cancelled before its first iteration was complete")
    if not output.is_file():
        raise BlenderError(f"'{path}': Blender wrote no '{output}'")
    return result


def capture_blend(path: Path, frame: int | None, values: dict[str, Any]) -> tuple[Snapshot, list[str]]:
    """The scene of a frame as the add-on exports it for a final render, and the warnings about it."""
    bpy = _open(path, frame, values)
    found: list[Snapshot] = []
    metadata = {"blend": path.name, "blender": bpy.app.version_string, "frame": bpy.context.scene.frame_current}

    class Capture:
        """Stands in for a renderer: keeps the scene and renders nothing."""

        def __init__(self, scene: Scene, settings: RenderSettings | None = None, **_: Any) -> None:
            self.warnings = scene.validate()
            found.append(Snapshot(scene, settings, metadata))

        def render(self, *_: Any) -> Image:
            raise Cancelled("captured")

    warnings: list[str] = []
    bpy.context.scene.render.use_compositing = False
    _render(bpy, path, Capture, warnings, write_still=False)
    if not found:
        raise BlenderError(f"'{path}': Blender rendered no view layer")
    if len(found) > 1:
        warnings.append(f"'{path}': has {len(found)} view layers, the first one is taken")
    return found[0], warnings


def _open(path: Path, frame: int | None, values: dict[str, Any]) -> Any:
    try:
        with _console():
            bpy = importlib.import_module("bpy")
    except ImportError as error:
        text = "rendering a .blend needs Blender as a Python module (pip install bpy), or run it inside Blender: "
        raise BlenderError(f"'{path}': {text}blender -b {path} -E VLP_BPT -f 1 ({error})") from error
    addon = _find_addon(path)
    with _console():
        if not hasattr(bpy.types.Scene, "vlp_bpt"):
            addon.register()
        try:
            bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False)
        except RuntimeError as error:
            raise BlenderError(f"'{path}': Blender cannot open it: {_one_line(str(error))}") from error
    scene = bpy.context.scene
    scene.render.engine = "VLP_BPT"
    for name in sorted(values, key=lambda name: name != "mode"):  # the mode first: it sets others
        if values[name] is not None:
            value = values[name]
            setattr(scene.vlp_bpt, name, str(value) if isinstance(value, str) else value)
    if frame is not None:
        scene.frame_set(frame)
    return bpy


def _find_addon(path: Path) -> Any:
    """The add-on: of the source tree that this package runs from, or installed as an extension."""
    root = Path(__file__).resolve().parents[2]
    if (root / "addon" / "__init__.py").is_file() and (root / "blender_manifest.toml").is_file():
        if str(root) not in sys.path:
            sys.path.insert(0, str(root))
        return importlib.import_module("addon")
    with suppress(ImportError):
        addon_utils = importlib.import_module("addon_utils")
        for module in addon_utils.modules():
            if module.__name__.endswith(".vlp_bpt"):
                return importlib.import_module(module.__name__)
    raise BlenderError(f"'{path}': the VLP-BPT add-on is not installed in this Blender (nor is this its source tree)")


def _render(bpy: Any, path: Path, renderer: type[Any], warnings: list[str], *, write_still: bool) -> None:
    """Renders with `renderer` in place of the class that the add-on uses; raises what Blender reports as an error."""
    original = vlp_bpt.Renderer
    vlp_bpt.Renderer = renderer  # type: ignore[misc]
    failure = ""
    try:
        with _console() as said:
            try:
                bpy.ops.render.render(write_still=write_still)
            except RuntimeError as error:
                failure = _one_line(str(error))
    finally:
        vlp_bpt.Renderer = original  # type: ignore[misc]
    for line in said:
        if line.startswith("Warning: ") and line not in warnings:
            warnings.append(line.removeprefix("Warning: ").removeprefix("VLP-BPT: "))
    if failure:
        raise BlenderError(f"'{path}': {failure}")


def _one_line(text: str) -> str:
    lines = [line.strip().removeprefix("Error: ").removeprefix("VLP-BPT: ") for line in text.splitlines()]
    return "; ".join(dict.fromkeys(line for line in lines if line))


@contextmanager
def _console() -> Iterator[list[str]]:
    """Keeps Blender's console output off the terminal: the lines are in the list when the context ends."""
    lines: list[str] = []
    sys.stdout.flush()
    kept = os.dup(1)
    with tempfile.TemporaryFile() as file:
        os.dup2(file.fileno(), 1)
        try:
            yield lines
        finally:
            sys.stdout.flush()
            os.dup2(kept, 1)
            os.close(kept)
            file.seek(0)
            lines.extend(line.decode(errors="replace").rstrip() for line in file)
