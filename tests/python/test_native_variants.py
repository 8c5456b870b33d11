"""The native core loads in every instruction set that this processor runs."""

import os
import subprocess
import sys

import pytest

from vlp_bpt import _native


@pytest.mark.parametrize("isa", ["baseline", "avx2"])
def test_variant_loads(isa: str) -> None:
    if isa == "avx2" and not _native.cpu_supports_avx2():
        pytest.skip("this processor has no AVX2")
    code = "from vlp_bpt import _native; print(_native.isa)"
    env = os.environ | {"VLP_BPT_ISA": isa}
    result = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True)
    assert result.stdout.strip() == isa


def test_unknown_variant_is_named() -> None:
    env = os.environ | {"VLP_BPT_ISA": "sse9"}
    result = subprocess.run(
        [sys.executable, "-c", "import vlp_bpt"], env=env, capture_output=True, text=True, check=False
    )
    assert result.returncode != 0
    assert "VLP_BPT_ISA='sse9'" in result.stderr
