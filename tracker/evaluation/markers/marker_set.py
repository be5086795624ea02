"""Marker sets: under which names a file has the landmarks of the body. Sets of the field lie in `sets`.

Own ones are TOML files:

hips = "harrington"        # or "bell"
[landmarks]
left_asis = ["LASI"]       # the first name that the file has
"""

from pathlib import Path
from typing import Annotated, Literal, TypeAlias

import msgspec
from msgspec import Meta

from tracker.errors import FormatError
from tracker.formats.text_files import DOCUMENT_BYTES, TextKind, read_toml
from tracker.validation import Name, check

HipRegression: TypeAlias = Literal["harrington", "bell"]
OF_A_SIDE = (
    "asis", "psis", "lateral_epicondyle", "medial_epicondyle", "lateral_malleolus", "medial_malleolus", "acromion",
    "lateral_elbow", "medial_elbow", "radial_wrist", "ulnar_wrist",
)  # fmt: skip
"""Landmarks of each side; epicondyles are of the femur."""
LANDMARKS = ("sacrum", *(f"{side}_{name}" for side in ("left", "right") for name in OF_A_SIDE))
_SETS = Path(__file__).with_name("sets")
_KIND = TextKind("marker set", DOCUMENT_BYTES, FormatError)
_Landmarks = msgspec.defstruct(
    "_Landmarks", [(name, tuple[Name, ...], ()) for name in LANDMARKS], forbid_unknown_fields=True
)


class MarkerSet(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """The names of landmarks in a file, and how hips are found."""

    landmarks: Annotated[_Landmarks, Meta(description="the landmarks of the set")]
    hips: HipRegression = "harrington"

    def names(self, landmark: str) -> tuple[str, ...]:
        """Return the names under which a file may have a landmark, the likeliest first."""
        markers: tuple[str, ...] = getattr(self.landmarks, landmark)
        return markers


def known_sets() -> tuple[str, ...]:
    """Return the names of the sets of the field."""
    return tuple(sorted(path.stem for path in _SETS.glob("*.toml")))


def read_marker_set(name: str) -> MarkerSet:
    """Return a set by its name, or that of a TOML file.

    Raises:
        FormatError: there is none, or the file is malformed.
    """
    path = _SETS / f"{name}.toml" if name in known_sets() else Path(name)
    if not path.is_file():
        raise FormatError(
            f"expected a marker set among {', '.join(known_sets())}, or a TOML file, found '{name}'; name one of them"
        )
    marker_set: MarkerSet = check(read_toml(path, _KIND), MarkerSet, f"marker set {path}", FormatError)
    return marker_set
