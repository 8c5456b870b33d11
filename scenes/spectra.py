"""The Cornell box's measured spectra and their conversion to linear Rec. 709.

Data: Cornell University Program of Computer Graphics, "Cornell Box Data"
(https://www.graphics.cornell.edu/online/box/data.html). Colour matching functions: the multi-lobe fit of Wyman, Sloan
and Shirley, "Simple Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT 2 (2), 2013, equation 4.
Illuminant D65: CIE, relative spectral power at steps of 10 nm.
"""

from __future__ import annotations

import numpy as np

WAVELENGTHS = np.arange(400.0, 701.0, 4.0)  # nm, of the reflectances

WHITE = (
    "343 445 551 624 665 687 708 723 715 710 745 758 739 767 777 765 751 745 748 729 745 757 753 750 746 747 735 732 "
    "739 734 725 721 733 725 732 743 744 748 728 716 733 726 713 740 754 764 752 736 734 741 740 732 745 755 751 744 "
    "731 733 744 731 712 708 729 730 727 707 703 729 750 760 751 739 724 730 740 737"
)
GREEN = (
    "92 96 98 97 98 95 95 97 95 94 97 98 96 101 103 104 107 109 112 115 125 140 160 187 229 285 343 390 435 464 472 "
    "476 481 462 447 441 426 406 373 347 337 314 285 277 266 250 230 207 186 171 160 148 141 136 130 126 123 121 122 "
    "119 114 115 117 117 118 120 122 128 132 139 144 146 150 152 157 159"
)
RED = (
    "40 46 48 53 49 50 53 55 57 56 59 57 61 61 60 62 62 62 61 62 60 59 57 58 58 58 56 55 56 59 57 55 59 59 58 59 61 61 "
    "63 63 67 68 72 80 90 99 124 154 192 255 287 349 402 443 487 513 558 584 620 606 609 651 612 610 650 638 627 620 "
    "630 628 642 639 657 639 635 642"
)
LIGHT = ((400.0, 500.0, 600.0, 700.0), (0.0, 8.0, 15.6, 18.4))  # nm, emission in the data's own unit

D65 = (
    "82.75 91.49 93.43 86.68 104.86 117.01 117.81 114.86 115.92 108.81 109.35 107.80 104.79 107.69 104.41 104.05 "
    "100.00 96.33 95.79 88.69 90.01 89.60 87.70 83.29 83.70 80.03 80.21 82.28 78.28 69.72 71.61"
)
XYZ_TO_RGB = np.array(
    [[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]]
)


def _lobe(w: np.ndarray, mean: float, left: float, right: float) -> np.ndarray:
    return np.asarray(np.exp(-0.5 * ((w - mean) / np.where(w < mean, left, right)) ** 2))


def color_matching(w: np.ndarray) -> np.ndarray:
    """CIE 1931 x, y, z at wavelengths w (n,) in nm: (3, n)."""
    x = 1.056 * _lobe(w, 599.8, 37.9, 31.0) + 0.362 * _lobe(w, 442.0, 16.0, 26.7) - 0.065 * _lobe(w, 501.1, 20.4, 26.2)
    y = 0.821 * _lobe(w, 568.8, 46.9, 40.5) + 0.286 * _lobe(w, 530.9, 16.3, 31.1)
    z = 1.217 * _lobe(w, 437.0, 11.8, 36.0) + 0.681 * _lobe(w, 459.0, 26.0, 13.8)
    return np.stack([x, y, z])


def reflectance_rgb(thousandths: str) -> tuple[float, float, float]:
    """Linear Rec. 709 of a measured reflectance under D65, scaled so that a reflectance of one is (1, 1, 1)."""
    w = np.arange(400.0, 701.0)
    matching = color_matching(w) * np.interp(w, np.arange(400.0, 701.0, 10.0), [float(v) for v in D65.split()])
    reflectance = np.interp(w, WAVELENGTHS, [float(v) / 1000 for v in thousandths.split()])
    rgb = XYZ_TO_RGB @ (matching @ reflectance) / (XYZ_TO_RGB @ matching.sum(axis=1))
    return float(rgb[0]), float(rgb[1]), float(rgb[2])


def light_rgb() -> tuple[float, float, float]:
    """Linear Rec. 709 of the light's emission, scaled so that a constant spectrum of one has luminance one."""
    w = np.arange(400.0, 701.0)
    matching = color_matching(w)
    rgb = XYZ_TO_RGB @ (matching @ np.interp(w, *LIGHT)) / matching[1].sum()
    return float(rgb[0]), float(rgb[1]), float(rgb[2])


if __name__ == "__main__":
    for label, value in (
        ("white", reflectance_rgb(WHITE)),
        ("green", reflectance_rgb(GREEN)),
        ("red", reflectance_rgb(RED)),
        ("light", light_rgb()),
    ):
        print(label, *(f"{v:.4f}" for v in value))
