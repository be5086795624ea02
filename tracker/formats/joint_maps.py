"""Map the markers of a foreign file to the joints of the body.

The project's own names are those of `BodyModel.point_names`: `left_shoulder`, `left_wrist`, `neck`, ...
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import msgspec

from tracker.errors import FormatError, Remedy
from tracker.formats.trc import MarkerTable
from tracker.text_files import DOCUMENT_BYTES, TextKind, read_toml
from tracker.validation import Name, check

LIMB_JOINTS = tuple(
    f"{side}_{j}" for side in ("left", "right") for j in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
)
"""The joints over which errors are averaged."""
JOINTS = (*LIMB_JOINTS, "neck", "head")

_KIND = TextKind("joint map", DOCUMENT_BYTES, FormatError)
_JointMapFile = msgspec.defstruct(
    "_JointMapFile", [(joint, Name | None, None) for joint in JOINTS], forbid_unknown_fields=True
)
"""A joint map file: the name of a marker for each joint that the file has."""


class JointMap(NamedTuple):
    """A naming convention."""

    name: str
    markers: Mapping[str, str]
    """Name of the marker for each joint that the convention knows."""


def _sided(**parts: str) -> dict[str, str]:
    """Expand patterns in which `{long}` is Left or Right, `{short}` L or R, to the markers of both sides."""
    sides = {"left": ("Left", "L"), "right": ("Right", "R")}
    return {
        f"{side}_{joint}": pattern.format(long=long, short=short)
        for joint, pattern in parts.items()
        for side, (long, short) in sides.items()
    }


OWN = JointMap("our own", {j: j for j in JOINTS})
CMU = JointMap(
    "CMU",
    {
        **_sided(
            shoulder="{long}Arm",
            elbow="{long}ForeArm",
            wrist="{long}Hand",
            hip="{long}UpLeg",
            knee="{long}Leg",
            ankle="{long}Foot",
        ),
        "neck": "Neck",
        "head": "Head",
    },
)
BODY_25 = JointMap(
    "BODY_25",
    {
        **_sided(
            shoulder="{short}Shoulder",
            elbow="{short}Elbow",
            wrist="{short}Wrist",
            hip="{short}Hip",
            knee="{short}Knee",
            ankle="{short}Ankle",
        ),
        "neck": "Neck",
        "head": "Head",
    },
)
# COCO's own names of the limbs equal the project's; tools that write COCO joints as TRC use the names of BODY_25.
KNOWN = (OWN, CMU, BODY_25)

_MIN_JOINTS = 4
"""Fewest limb joints under the names of a convention by which a file follows it."""


def guess_joint_map(markers: Sequence[str], source: str) -> JointMap:
    """Guess the naming convention of a file from its markers; `source` names the file in messages.

    Raises:
        FormatError: the markers follow no known convention.
    """
    present = [sum(m.markers[j] in markers for j in LIMB_JOINTS) for m in KNOWN]
    if max(present) < _MIN_JOINTS:
        raise FormatError(
            f"the markers of {source} follow no known convention (our own, COCO, CMU, BODY_25): found "
            f"{', '.join(markers[:8])}{', ...' if len(markers) > 8 else ''}",
            Remedy("give_joint_map", marker=_quoted(markers[0])),
        )
    return KNOWN[present.index(max(present))]


def _quoted(marker: str) -> str:
    """Return a marker's name as a string of TOML."""
    return json.dumps(marker, ensure_ascii=False)


def read_joint_map(path: str | Path) -> JointMap:
    """Read a convention from TOML: one line `left_shoulder = "LSHO"` for each joint that a file has.

    Raises:
        FormatError: the file is missing or malformed, or names an unknown joint.
    """
    found = check(read_toml(Path(path), _KIND), _JointMapFile, f"joint map {path}", FormatError)
    markers = {j: m for j, m in msgspec.to_builtins(found).items() if m is not None}
    if not markers:
        raise FormatError(
            f'joint map {path}: expected lines such as left_shoulder = "LSHO" for {", ".join(JOINTS)}, found none; '
            "add them"
        )
    return JointMap(Path(path).name, markers)


def joints_of(table: MarkerTable, source: str, joint_map: JointMap | None = None) -> MarkerTable:
    """Select the body's joints of a file, under the project's names, in the order of `JOINTS`.

    Args:
        table: the file's markers.
        source: names the file in messages.
        joint_map: its naming convention; guessed by default.

    Raises:
        FormatError: no convention fits, or the map names a marker that the file lacks.
    """
    if joint_map is None:
        markers = guess_joint_map(table.names, source).markers
        markers = {j: m for j, m in markers.items() if m in table.names}
    else:
        markers = joint_map.markers
    for marker in markers.values():
        if marker not in table.names:
            raise FormatError(
                f"{source} has no marker '{marker}', which the joint map {joint_map.name if joint_map else ''} names; "
                f"expected one of {', '.join(table.names)}"
            )
    joints = tuple(j for j in JOINTS if j in markers)
    columns = [table.names.index(markers[j]) for j in joints]
    return replace(table, names=joints, points=table.points[:, columns])
