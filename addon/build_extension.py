"""Makes the zip that Blender installs: add-on, manifest and the wheel of the core. Not itself in the zip."""

import argparse
import re
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
EPOCH = (1980, 1, 1, 0, 0, 0)  # the same inputs give the same zip
PLATFORMS = {
    "manylinux.*_x86_64": "linux-x64",
    "manylinux.*_aarch64": "linux-arm64",
    "win_amd64": "windows-x64",
    "win_arm64": "windows-arm64",
    "macosx.*_arm64": "macos-arm64",
    "macosx.*_x86_64": "macos-x64",
}


def platform_of(wheel: Path) -> str:
    """Blender's name of the platform that a wheel is for."""
    tag = wheel.stem.split("-")[-1].split(".")[0]
    for pattern, platform in PLATFORMS.items():
        if re.fullmatch(pattern, tag):
            return platform
    raise SystemExit(f"{wheel.name}: Blender has no platform for the tag {tag!r}")


def filled_in_manifest(wheel: Path) -> tuple[str, str, str]:
    """The manifest's text with platform and wheel, the version and the platform; every version must be the same."""
    text = (ROOT / "blender_manifest.toml").read_text()
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    versions = {"blender_manifest.toml": tomllib.loads(text)["version"], wheel.name: wheel.stem.split("-")[1]}
    for source, other in versions.items():
        if other != version:
            raise SystemExit(f"{source} is of version {other}, pyproject.toml of {version}")
    platform = platform_of(wheel)
    text = text.replace("platforms = []", f'platforms = ["{platform}"]')
    text = text.replace("wheels = []", f'wheels = ["./wheels/{wheel.name}"]')
    filled = tomllib.loads(text)
    assert len(filled["platforms"]) == len(filled["wheels"]) == 1
    return text, version, platform


def addon_files() -> list[Path]:
    """The add-on's files, relative to its folder."""
    folder = ROOT / "addon"
    files = [path.relative_to(folder) for path in folder.rglob("*") if path.is_file()]
    return sorted(
        path
        for path in files
        if path != Path("build_extension.py")
        and path.suffix not in {".pyc", ".md"}
        and not any(part.startswith(".") or part == "__pycache__" for part in path.parts)
    )


def build(wheel: Path, output: Path) -> Path:
    """Writes the zip and returns its path."""
    manifest, version, platform = filled_in_manifest(wheel)
    target = output / f"vlp_bpt-{version}-{platform}.zip"
    contents: dict[str, bytes] = {
        "blender_manifest.toml": manifest.encode(),
        "LICENSE": (ROOT / "LICENSE").read_bytes(),
    }
    contents |= {str(path.as_posix()): (ROOT / "addon" / path).read_bytes() for path in addon_files()}
    contents[f"wheels/{wheel.name}"] = wheel.read_bytes()
    if "__init__.py" not in contents:
        raise SystemExit("addon/__init__.py is missing: there is no add-on to pack")
    output.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in sorted(contents.items()):
            info = zipfile.ZipInfo(name, EPOCH)
            info.external_attr = 0o644 << 16
            packed = zipfile.ZIP_STORED if name.endswith(".whl") else zipfile.ZIP_DEFLATED
            archive.writestr(info, data, packed)
    return target


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("wheel", type=Path, help="the core for Python 3.11 and every later one (`make wheel`)")
    parser.add_argument("--output", type=Path, default=ROOT / "dist", help="folder to write the zip to")
    arguments = parser.parse_args()
    target = build(arguments.wheel, arguments.output)
    print(f"{target} ({target.stat().st_size / 1e6:.1f} MB)")


if __name__ == "__main__":
    main()
