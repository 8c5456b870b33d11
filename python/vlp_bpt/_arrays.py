"""Arrays as the native core takes them: C-contiguous, of one type and shape, or a message that names the field."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import SceneError

Shape = tuple[int | None, ...]


def _shape_text(shape: Shape) -> str:
    return "(" + ", ".join("n" if n is None else str(n) for n in shape) + ("," if len(shape) == 1 else "") + ")"


def float32(where: str, value: Any, shape: Shape) -> NDArray[np.float32]:
    """`value` as C-contiguous float32 of `shape` (None: any length), without a copy where it is that already.

    Raises SceneError beginning with `where` when it is not numeric or of another shape.
    """
    if type(value) is np.ndarray and value.dtype == np.float32 and value.shape == shape and value.flags.c_contiguous:
        return value  # 100,000 instances come this way
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "fiub":
            raise TypeError
        with np.errstate(over="ignore"):  # too large becomes infinite, which validation names
            array = np.ascontiguousarray(array, dtype=np.float32)
    except (TypeError, ValueError):
        raise SceneError(f"{where}: is not an array of numbers") from None
    return _shaped(where, array, shape)


def int32(where: str, value: Any, shape: Shape) -> NDArray[np.int32]:
    """`value` as C-contiguous int32 of `shape`; raises SceneError as `float32` does, and for numbers beyond int32."""
    try:
        array = np.asarray(value)
        if array.size == 0:
            array = array.astype(np.int32)
        if array.dtype.kind not in "iu":
            raise TypeError
    except (TypeError, ValueError):
        raise SceneError(f"{where}: is not an array of whole numbers") from None
    if array.size and not np.can_cast(array.dtype, np.int32):
        for number in (int(array.min()), int(array.max())):
            if not -(2**31) <= number < 2**31:
                raise SceneError(f"{where}: {number} does not fit 32 bits")
    return _shaped(where, np.ascontiguousarray(array, dtype=np.int32), shape)


def _shaped(where: str, array: NDArray[Any], shape: Shape) -> NDArray[Any]:
    if array.size == 0 and shape[0] is None:
        return array.reshape(tuple(0 if n is None else n for n in shape))
    if array.ndim != len(shape) or any(n is not None and n != m for n, m in zip(shape, array.shape, strict=True)):
        raise SceneError(f"{where}: has shape {_shape_text(array.shape)}, must be {_shape_text(shape)}")
    return array
