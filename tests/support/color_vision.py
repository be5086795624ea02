"""Colours as people see them: contrast, difference, and simulated colour blindness. All colours are sRGB."""

import re

import numpy as np

MACHADO_2009 = {
    "normal": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}
"""Matrices on linear RGB, severity 1 (Machado, Oliveira, Fernandes 2009, Table 1)."""
_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
_WHITE = _XYZ.sum(axis=1)


def rgb(color):
    """Return `#rgb` or `#rrggbb` as (3,), 0 to 1."""
    digits = color.removeprefix("#")
    assert re.fullmatch(r"[0-9a-fA-F]{3}|[0-9a-fA-F]{6}", digits), color
    digits = "".join(2 * d for d in digits) if len(digits) == 3 else digits
    return np.array([int(digits[k : k + 2], 16) for k in (0, 2, 4)]) / 255


def over(color, share, ground):
    """Return a translucent colour over an opaque ground, both (3,)."""
    return share * color + (1 - share) * ground


def linear(color):
    return np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)


def companded(light):
    light = np.clip(light, 0, 1)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def seen_with(vision, color):
    """Return how a color, (..., 3), looks with a kind of colour vision."""
    return companded(linear(color) @ MACHADO_2009[vision].T)


def luminance(color):
    """Return the relative luminance (WCAG 2.2)."""
    return float(linear(color) @ _XYZ[1])


def contrast(a, b):
    """Return the contrast ratio of two colours (WCAG 2.2), 1 to 21."""
    dark, light = sorted((luminance(a), luminance(b)))
    return (light + 0.05) / (dark + 0.05)


def lab(color):
    """Return CIELAB under D65, (..., 3)."""
    t = linear(color) @ _XYZ.T / _WHITE
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], axis=-1)


def ciede2000(a, b):
    """Return the CIEDE2000 difference of CIELAB colours, (..., 3) each (Sharma, Wu, Dalal 2005)."""
    (L1, a1, b1), (L2, a2, b2) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    mean_c7 = ((np.hypot(a1, b1) + np.hypot(a2, b2)) / 2) ** 7
    g = 0.5 * (1 - np.sqrt(mean_c7 / (mean_c7 + 25.0**7)))
    a1, a2 = (1 + g) * a1, (1 + g) * a2
    C1, C2 = np.hypot(a1, b1), np.hypot(a2, b2)
    h1, h2 = (np.degrees(np.arctan2(y, x)) % 360 for y, x in ((b1, a1), (b2, a2)))
    is_grey = C1 * C2 == 0
    turn = np.where(is_grey, 0.0, (h2 - h1 + 180) % 360 - 180)
    dL, dC, dH = L2 - L1, C2 - C1, 2 * np.sqrt(C1 * C2) * np.sin(np.radians(turn / 2))
    h = np.where(is_grey, h1 + h2, (h1 + turn / 2) % 360)
    L, C = (L1 + L2) / 2, (C1 + C2) / 2
    cos = lambda degrees: np.cos(np.radians(degrees))  # noqa: E731
    t = 1 - 0.17 * cos(h - 30) + 0.24 * cos(2 * h) + 0.32 * cos(3 * h + 6) - 0.20 * cos(4 * h - 63)
    s_l = 1 + 0.015 * (L - 50) ** 2 / np.sqrt(20 + (L - 50) ** 2)
    s_c, s_h = 1 + 0.045 * C, 1 + 0.015 * C * t
    r_c = 2 * np.sqrt(C**7 / (C**7 + 25.0**7))
    r_t = -r_c * np.sin(np.radians(60 * np.exp(-(((h - 275) / 25) ** 2))))
    x, y, z = dL / s_l, dC / s_c, dH / s_h
    return np.sqrt(x**2 + y**2 + z**2 + r_t * y * z)


def difference(a, b, vision="normal"):
    """Return the CIEDE2000 difference of two colours as seen with a kind of colour vision."""
    return float(ciede2000(lab(seen_with(vision, a)), lab(seen_with(vision, b))))
