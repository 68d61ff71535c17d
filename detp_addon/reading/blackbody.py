"""The colour of a glowing body, as shader nodes give it."""

from __future__ import annotations

import numpy as np

#: XYZ to linear Rec. 709 (IEC 61966-2-1)
_TO_REC709 = np.array(
    [[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]]
)

#: second radiation constant hc/k, in nm K
_SECOND_CONSTANT = 1.438777e7


def blackbody(kelvin: np.ndarray) -> np.ndarray:
    """Linear Rec. 709 colour (m, 3) of luminance 1 at temperatures (m, 1) in kelvin, none negative.

    Planck's law seen through the CIE 1931 observer as fitted by Wyman, Sloan and Shirley, "Simple Analytic
    Approximations to the CIE XYZ Color Matching Functions", JCGT 2013. Like the node, it stays at the ends of
    800..12000 K.
    """
    wavelength = np.arange(380.0, 781.0, 5.0)
    temperature = np.clip(kelvin, 800.0, 12000.0)
    spectrum = wavelength**-5.0 / np.expm1(_SECOND_CONSTANT / (wavelength * temperature))
    xyz = spectrum @ _observer(wavelength)
    return np.maximum((xyz / xyz[:, 1:2]) @ _TO_REC709.T, 0.0)


def _observer(wavelength: np.ndarray) -> np.ndarray:
    """CIE 1931 colour matching functions (W, 3) at wavelengths (W,) in nm."""

    def lobe(peak, centre, below, above):
        return peak * np.exp(-0.5 * ((wavelength - centre) * np.where(wavelength < centre, below, above)) ** 2)

    x = lobe(0.362, 442.0, 0.0624, 0.0374) + lobe(1.056, 599.8, 0.0264, 0.0323) - lobe(0.065, 501.1, 0.0490, 0.0382)
    y = lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322)
    z = lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725)
    return np.stack([x, y, z], axis=1)
