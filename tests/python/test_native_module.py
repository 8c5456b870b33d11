"""The compiled core loads in every instruction set that this processor runs, and _native.pyi names what it holds."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

from vlp_bpt import _native


def run(code: str, isa: str) -> "subprocess.CompletedProcess[str]":
    env = os.environ | {"VLP_BPT_ISA": isa}
    return subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("isa", ["baseline", "avx2"])
def test_variant_loads(isa: str) -> None:
    if isa == "avx2" and not _native.cpu_supports_avx2():
        pytest.skip("this processor has no AVX2")
    result = run("from vlp_bpt import _native; print(_native.isa)", isa)
    assert (result.returncode, result.stdout.strip()) == (0, isa), result.stderr


def test_unknown_variant_is_named() -> None:
    result = run("import vlp_bpt._native", "sse9")
    assert result.returncode != 0
    assert "VLP_BPT_ISA='sse9'" in result.stderr


def stub_names(body: list[ast.stmt]) -> dict[str, list[ast.stmt]]:
    """Public names that the statements of a stub define, with the bodies of classes."""
    names: dict[str, list[ast.stmt]] = {}
    for node in body:
        if isinstance(node, ast.ClassDef):
            names[node.name] = node.body
        elif isinstance(node, ast.FunctionDef):
            names[node.name] = []
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names[node.target.id] = []
        elif isinstance(node, ast.Assign):
            names.update({target.id: [] for target in node.targets if isinstance(target, ast.Name)})
    return {name: inner for name, inner in names.items() if not name.startswith("_")}


def test_stub_names_what_the_module_holds() -> None:
    stub = ast.parse(Path(_native.__file__).with_suffix(".pyi").read_text())
    module = sys.modules[f"vlp_bpt._native_{_native.isa}"]
    names = stub_names(stub.body)
    assert set(names) == {name for name in vars(module) if not name.startswith("_")}
    for name, body in names.items():
        if isinstance(held := getattr(module, name), type) and not issubclass(held, BaseException):
            assert set(stub_names(body)) == {member for member in vars(held) if not member.startswith("_")}, name
