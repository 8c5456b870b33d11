"""Types of the native core (see _native.py)."""

__version__: str
isa: str

def cpu_supports_avx2() -> bool: ...
def cuda_device_count() -> int: ...
