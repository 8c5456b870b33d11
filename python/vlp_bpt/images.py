"""Image files through OpenImageIO."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass
class Image:
    """A picture: pixels (height, width, 4) float32, linear Rec. 709, premultiplied alpha, row 0 at the bottom;
    metadata: what is known about it, as JSON values."""

    pixels: NDArray[np.float32]
    metadata: dict[str, Any] = field(default_factory=dict)
