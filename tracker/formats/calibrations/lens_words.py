"""Words and numbers by which calibrations name the model of a lens: the two that are read, and all others."""

import re
from collections.abc import Mapping
from typing import Any

from tracker.validation import quoted

FISHEYE = "fisheye"
PINHOLE = "pinhole"

_FLAGS = {"fisheye", "isfisheye", "fisheyemodel", "usefisheye", "fisheyelens", "isfisheyelens"}
"""Keys, without case and separators, whose value is a yes or no."""
_MODELS = {
    "cameramodel", "distortionmodel", "lensmodel", "model", "distortiontype", "lenstype", "cameratype",
    "projectionmodel", "projectiontype", "distmodel", "disttype", "lens", "modeltype", "intrinsicmodel",
    "lensdistortionmodel", "cameramodeltype",
}  # fmt: skip
"""Keys whose value is the name of a model."""
_YES = {"1", "true", "yes", "y", "on"}
_NO = {"0", "false", "no", "n", "off", "none", "null", ""}
_PINHOLE_WORDS = {
    "pinhole", "radtan", "radialtangential", "radialtan", "plumbbob", "brown", "brownconrady", "opencv", "standard",
    "perspective", "linear", "rational", "rationalpolynomial", "fullopencv", "pinholeradtan", "thinprism", "tilted",
    "pinholebrownconrady",
}  # fmt: skip
"""OpenCV's model with up to 8 coefficients; those of thin prisms and tilts, which follow, must be 0."""
_FISHEYE_WORDS = {
    "fisheye", "equidistant", "equi", "kb", "kb4", "kb8", "kannala", "kannalabrandt", "kannalabrandt4",
    "kannalabrandt8", "opencvfisheye", "pinholeequidistant", "pinholeequi", "fisheyeopencv", "equidist",
}  # fmt: skip
"""OpenCV's equidistant model. The 8 of kb8 counts fx, fy, cx and cy too."""
_NUMBERS = {"0": PINHOLE, "1": FISHEYE}
"""MC-Calib's distortion_type: 0 is Brown's model, 1 Kannala's."""
_SUSPICIOUS = re.compile(
    r"fisheye|lens|distor|model|omni|^xi$|convention|coordinates?ys|handed|axes|^s[1-4]$|^tau[xy]?$|thinprism|tilt"
    r"|radial|tangential|coef|^scal(e|ing)|scal(e|ing)(factor)?$|binning"
)
"""Parts of keys of a lens, a model or a convention, without case and separators."""
_SCALE = re.compile("scal(e|ing)|binning")
"""Keys, without case and separators, of which 0 and 1 change nothing."""
_HARMLESS = re.compile(r"error|(?<!te)rms|serial|modelname|modelnumber|count|flags|date|^distorted|undistort")
_OTHER_LENS = re.compile(r"fisheye|equidist|kannala|omnidir")
"""Words of lenses other than the usual one, in text without case and separators."""
_FREE_TEXT = re.compile(r"name|label|^id$|serial|path|file|video|image|folder")
"""Keys without case and separators whose text is chosen freely."""


class UnknownLensError(ValueError):
    """A key or value of a lens that is not understood: `expected ..., found ...; advice`."""


def spelled(key: str) -> str:
    """Return a key without case and separators."""
    return "".join(c for c in key.lower() if c.isalnum())


def is_fisheye_word(word: str) -> bool:
    """Return whether a word names OpenCV's equidistant model."""
    return spelled(word) in _FISHEYE_WORDS


def names_lens(key: str, value: Any) -> bool:
    """Return whether a key names the model of a lens, or its value does under any other key."""
    plain = spelled(key)
    is_word = isinstance(value, str) and spelled(value) in _FISHEYE_WORDS and not _FREE_TEXT.search(plain)
    return plain in _FLAGS or plain in _MODELS or is_word


def is_understood(key: str, value: Any) -> bool:
    """Return whether a key with its value names one of the models that are read."""
    try:
        return names_lens(key, value) and _model(key, value) is not None
    except UnknownLensError:
        return False


def is_unknown(key: str, value: Any) -> bool:
    """Return whether a key, or text under it, may change the meaning of the others unheard."""
    plain = spelled(key)
    if _SCALE.search(plain) and isinstance(value, int | float) and value in (0, 1):
        return False
    if isinstance(value, str) and _OTHER_LENS.search(spelled(value)) and not _FREE_TEXT.search(plain):
        return True
    return bool(_SUSPICIOUS.search(plain)) and not _HARMLESS.search(plain)


def is_fisheye(words: Mapping[str, Any]) -> bool:
    """Return whether a lens is a fisheye of OpenCV's equidistant model, and not its usual one.

    Args:
        words: keys of a lens with their values.

    Raises:
        UnknownLensError: a value is not understood, or two contradict each other.
    """
    said = {key: model for key, value in words.items() if (model := _model(key, value)) is not None}
    # The usual camera with an equidistant lens is a fisheye: Kalibr says both.
    if FISHEYE not in said.values():
        return False
    if denied := [key for key in said if spelled(key) in _FLAGS and said[key] == PINHOLE]:
        other = next(key for key in said if said[key] == FISHEYE)
        found = " and ".join(f"{key} = {quoted(words[key])}" for key in (denied[0], other))
        raise UnknownLensError(f"expected one model of the lens, found {found}; correct the wrong one")
    return True


def _model(key: str, value: Any) -> str | None:
    """Return the model that a key names; None for none."""
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    plain, word = spelled(key), spelled(quoted(value))
    if plain in _FLAGS:
        if word in _YES or word in _FISHEYE_WORDS:
            return FISHEYE
        if word in _NO or word in _PINHOLE_WORDS:
            return PINHOLE
    elif word in ("none", "null", "", "no", "nodistortion"):
        return None
    elif plain.endswith("type") and word in _NUMBERS:
        return _NUMBERS[word]
    elif word in _FISHEYE_WORDS or (word == "true" and "fisheye" in plain):
        return FISHEYE
    elif word in _PINHOLE_WORDS:
        return PINHOLE
    raise UnknownLensError(
        f"expected OpenCV's model of a lens (pinhole, with radial and tangential distortion) or its fisheye "
        f"(equidistant), found {key} = {quoted(value)}; undistort the footage and calibrate with one of these "
        "models, or remove the key if it names no lens"
    )
