"""Loads the native core built for this processor: vlp_bpt._native_avx2 or vlp_bpt._native_baseline, under one name.

The environment variable VLP_BPT_ISA=baseline|avx2 overrides the choice (for tests).
"""

import importlib
import os
from types import ModuleType


def _load() -> ModuleType:
    wanted = os.environ.get("VLP_BPT_ISA", "")
    if wanted not in ("", "baseline", "avx2"):
        raise ImportError(f"VLP_BPT_ISA={wanted!r}: expected 'baseline' or 'avx2'")
    baseline = importlib.import_module("vlp_bpt._native_baseline")
    supported = baseline.cpu_supports_avx2()
    if wanted == "avx2" and not supported:
        raise ImportError("VLP_BPT_ISA=avx2, but this processor lacks AVX2, FMA, BMI2 or F16C")
    if wanted == "baseline" or not supported:
        return baseline
    return importlib.import_module("vlp_bpt._native_avx2")


_module = _load()
__version__ = _module.__version__
globals().update({name: value for name, value in vars(_module).items() if not name.startswith("_")})
