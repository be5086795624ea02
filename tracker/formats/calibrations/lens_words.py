"""Words of calibrations of all programs, and the model of a lens by them: the two that are read, and all others.

`words.toml` has a row of words for each meaning.
"""

import re
from collections.abc import Mapping
from fnmatch import translate
from typing import Any

from tracker.formats.anipose import KIND
from tracker.formats.text_files import packaged_texts, parse_toml
from tracker.validation import quoted

_TABLE = parse_toml(packaged_texts("formats", "calibrations")["words"], "words.toml", KIND)
MEANINGS: dict[str, str] = {word: meaning for meaning, words in _TABLE["meanings"].items() for word in words.split()}
"""Meaning of a value of a camera by each word for it."""
LISTS = tuple(_TABLE["rows"]["lists"].split())
"""Keys under which the cameras of a file may lie, the surest first."""
_ROWS = {name: re.compile("|".join(map(translate, words.split()))) for name, words in _TABLE["rows"].items()}


def spelled(key: str) -> str:
    """Return a key without case and separators."""
    return "".join(c for c in key.lower() if c.isalnum())


def is_of(row: str, word: str) -> bool:
    """Return whether a word, of any case and with any separators, is in a row of the table."""
    return _ROWS[row].match(spelled(word)) is not None


def is_known(key: str) -> bool:
    """Return whether a key is the word for a value of a camera."""
    return spelled(key) in MEANINGS or is_of("numbers", key)


FISHEYE = "fisheye"
PINHOLE = "pinhole"


class UnknownLensError(ValueError):
    """A key or value of a lens that is not understood: `expected ..., found ...; advice`."""


def names_lens(key: str, value: Any) -> bool:
    """Return whether a key names the model of a lens, or its value does under any other key."""
    is_word = isinstance(value, str) and is_of("fisheye", value) and not is_of("free_text", key)
    return is_of("lens_flags", key) or is_of("lens_models", key) or is_word


def is_understood(key: str, value: Any) -> bool:
    """Return whether a key with its value names one of the models that are read."""
    try:
        return names_lens(key, value) and _model(key, value) is not None
    except UnknownLensError:
        return False


def is_unknown(key: str, value: Any) -> bool:
    """Return whether a key, or text under it, may change the meaning of the others unheard."""
    if is_of("scales", key) and isinstance(value, int | float) and value in (0, 1):
        return False
    if isinstance(value, str) and is_of("other_lens", value) and not is_of("free_text", key):
        return True
    return is_of("suspicious", key) and not is_of("harmless", key)


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
    if denied := [key for key in said if is_of("lens_flags", key) and said[key] == PINHOLE]:
        other = next(key for key in said if said[key] == FISHEYE)
        found = " and ".join(f"{key} = {quoted(words[key])}" for key in (denied[0], other))
        raise UnknownLensError(f"expected one model of the lens, found {found}; correct the wrong one")
    return True


def _model(key: str, value: Any) -> str | None:
    """Return the model that a key names; None for none."""
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    plain, word = spelled(key), spelled(quoted(value))
    if is_of("lens_flags", key):
        if is_of("yes", word) or is_of("fisheye", word):
            return FISHEYE
        if not word or is_of("no", word) or is_of("pinhole", word):
            return PINHOLE
    elif word in ("none", "null", "", "no", "nodistortion"):
        return None
    elif plain.endswith("type") and word in ("0", "1"):  # MC-Calib's: Brown's model, and Kannala's
        return (PINHOLE, FISHEYE)[int(word)]
    elif is_of("fisheye", word) or (word == "true" and "fisheye" in plain):
        return FISHEYE
    elif is_of("pinhole", word):
        return PINHOLE
    raise UnknownLensError(
        f"expected OpenCV's model of a lens (pinhole, with radial and tangential distortion) or its fisheye "
        f"(equidistant), found {key} = {quoted(value)}; undistort the footage and calibrate with one of these "
        "models, or remove the key if it names no lens"
    )
