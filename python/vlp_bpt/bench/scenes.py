"""The scenes that the benchmarks render: files, the repository's own, and those that scripts make."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from vlp_bpt._blender import capture_blend
from vlp_bpt.errors import Error
from vlp_bpt.scene import Film, Scene
from vlp_bpt.snapshot import load_snapshot

ROOT = Path(__file__).resolve().parents[3]
MADE = ("million", "sunlit_room")  # not kept: scenes/NAME.py writes them
FOLDER = Path("out")


def find_scene(name: str) -> Path:
    """A file by its path, or by its name in `scenes/` here or in the source tree; those of `MADE` are made first."""
    for path in (Path(name), Path("scenes") / f"{name}.blend", ROOT / "scenes" / f"{name}.blend"):
        if path.is_file():
            return path
    if name in MADE:
        return made(ROOT / "scenes" / f"{name}.py", FOLDER / f"{name}.blend", [])
    raise Error(f"scene '{name}': there is neither such a file nor scenes/{name}.blend")


def load_scene(path: Path, size: int) -> Scene:
    """The scene of a .blend (needs bpy) or snapshot file, `size` pixels wide and as high as its shape asks."""
    if path.suffix == ".npz":
        scene = load_snapshot(path).scene
    else:
        snapshot, warnings = capture_blend(path, None, {})
        scene = snapshot.scene
        for warning in warnings:
            print(f"{path.stem}: {warning}")
    height = max(1, round(size * scene.film.height / scene.film.width))
    scene.film = Film(size, height)
    return scene


def mesh_variant(path: Path, levels: int) -> Path:
    """The Sierpinski scene with meshes for spheres, written by the script that lies beside it, once."""
    script = path.with_suffix(".py")
    return made(script, FOLDER / f"sierpinski_mesh_{levels}.blend", ["--levels", str(levels)], option="--mesh")


def made(script: Path, output: Path, arguments: list[str], option: str = "--output") -> Path:
    """What a scene script writes, once; raises Error with the script's last words where it fails."""
    if output.exists():
        return output
    if not script.is_file():
        raise Error(f"scene '{output.stem}': {script} makes it, which is not here")
    output.parent.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, str(script), option, str(output), *arguments]
    result = subprocess.run(command, check=False, capture_output=True, text=True)
    if result.returncode or not output.exists():
        words = (result.stderr or result.stdout).strip().splitlines() or ["it said nothing"]
        raise Error(f"scene '{output.stem}': {script} failed: {words[-1]}")
    return output
