"""The format of rescue files: a checksum, the edits in order, and the body models of their poses."""

import hashlib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, TypeAlias

import msgspec
import numpy as np
from msgspec import Meta

from tracker.body.model import BodyModel
from tracker.errors import SessionError, TrackerError
from tracker.files import read_regular, write_text_atomic
from tracker.formats.model_toml import parse_model
from tracker.session.store.records import (
    SOURCES,
    STATUSES,
    Alternative,
    AssessmentChange,
    Change,
    MarkChange,
    PinChange,
    PoseChange,
    PoseRecord,
)
from tracker.validation import MAX_FRAMES, UNPRINTABLE, Name

_VERSION = 1
_MAX_BYTES = 1_000_000_000
"""Size above which a file is refused before it is read: a million poses. Edits that wait are in memory."""
_KINDS: dict[str, type[Change]] = {
    "pose": PoseChange, "mark": MarkChange, "assessment": AssessmentChange, "pin": PinChange,
}  # fmt: skip
_NAMES = {kind: name for name, kind in _KINDS.items()}

_Line: TypeAlias = Annotated[str, Meta(pattern=rf"^[^{UNPRINTABLE}]{{0,2000}}\Z")]
_Row: TypeAlias = Annotated[int, Meta(ge=1, le=2**63 - 1)]


class UnsavedEdit(NamedTuple):
    """An edit, or an addition to one, that is not on disk."""

    label: str
    changes: Sequence[Change]
    amend: int | None
    """The edit on disk to add to; None makes a new one."""
    by_program: bool
    author: str | None = None
    """Name of the person who made it; None for the author of the file."""


class _Change(msgspec.Struct):
    kind: Literal["pose", "mark", "assessment", "pin"]
    of: msgspec.Raw


class _Edit(msgspec.Struct):
    label: _Line
    changes: list[_Change]
    amend: _Row | None
    by_program: bool
    author: _Line | None = None  # files of former versions have none


class Model(msgspec.Struct):
    """The body model of a revision."""

    person: Name
    toml: str


class _Content(msgspec.Struct):
    version: int
    session: str
    store: str
    author: _Line
    time: _Line
    why: str
    models: dict[int, Model]
    edits: list[_Edit]


class Rescue(NamedTuple):
    """The content of a rescue file."""

    session: str
    """Path of the session's folder."""
    store: str
    """Id of the store."""
    author: str
    """Of the edits that name none."""
    time: str
    why: str
    """Reason for which the edits could not be written."""
    models: dict[int, Model]
    """The body models of the poses, by revision."""
    edits: list[UnsavedEdit]


def write_rescue(path: Path, rescue: Rescue) -> None:
    """Write a rescue file that only this user may read; it appears complete or not at all.

    Raises:
        OSError: it cannot be written.
    """
    edits = [_Edit(e.label, [_encoded(c) for c in e.changes], *e[2:]) for e in rescue.edits]
    text = msgspec.json.encode(_Content(_VERSION, *rescue[:-1], edits))
    write_text_atomic(path, f"{hashlib.sha256(text).hexdigest()}\n{text.decode()}\n", 0o600)


def read_rescue(path: Path) -> Rescue:
    """Read a rescue file, and check all that it would write into a store.

    Raises:
        SessionError: it cannot be read, is not as it was written, is of a newer program, or holds impossible values.
    """
    try:
        checksum, _, text = read_regular(path, _MAX_BYTES).partition(b"\n")
    except OSError as error:
        raise SessionError(f"rescue file {path} cannot be read: {error.strerror}; check your rights") from error
    if hashlib.sha256(text.removesuffix(b"\n")).hexdigest().encode() != checksum:
        raise SessionError(f"rescue file {path} is not as it was written: its checksum differs; delete or move it")
    try:
        _check_version(path, text)
        content = msgspec.json.decode(text, type=_Content)
        models = {r: parse_model(m.toml, f"of '{m.person}', revision {r}") for r, m in content.models.items()}
        edits = [
            UnsavedEdit(
                e.label, [_decoded(c, content.models, models) for c in e.changes], e.amend, e.by_program, e.author
            )
            for e in content.edits
        ]
    # One cause of many: text that is no JSON, other types, numbers that no array holds.
    except (msgspec.MsgspecError, ValueError, TypeError, ArithmeticError, RecursionError, TrackerError) as error:
        if isinstance(error, SessionError):
            raise
        raise SessionError(f"rescue file {path} holds what no program writes: {error}; delete or move it") from error
    return Rescue(content.session, content.store, content.author, content.time, content.why, content.models, edits)


def _check_version(path: Path, text: bytes) -> None:
    version = msgspec.json.decode(text, type=dict[str, Any]).get("version")
    if version != _VERSION:
        raise SessionError(f"rescue file {path} has version {version!r:.20}, expected {_VERSION}; upgrade quadrille")


def _encoded(change: Change) -> _Change:
    # Numbers of numpy are encoded exactly, as those of Python.
    kind: Any = _NAMES[type(change)]
    return _Change(kind, msgspec.Raw(msgspec.json.encode(change, enc_hook=lambda values: values.tolist())))


def _decoded(change: _Change, named: dict[int, Model], models: dict[int, BodyModel]) -> Change:
    """Decode a change and check its values.

    Raises:
        ValueError: a value is impossible.
    """
    found: Change = msgspec.json.decode(change.of, type=_KINDS[change.kind], dec_hook=_array)
    where = f"{found.person!r:.60} in frame {found.frame}"
    msgspec.convert(found.person, Name)
    _require(0 <= found.frame < MAX_FRAMES, f"expected a frame from 0 to {MAX_FRAMES - 1}, found {found.frame}")
    if isinstance(found, PinChange):
        msgspec.convert([found.point, found.camera], list[Name])
        _require(_are_finite(found.position_px or ()), f"a pin of {where} is no point")
    elif isinstance(found, PoseChange):
        poses: list[PoseRecord | Alternative] = [*found.alternatives, *([] if found.pose is None else [found.pose])]
        for pose in poses:
            revision = pose.model_revision
            is_known = revision in named and named[revision].person == found.person
            _require(is_known, f"the pose of {where} has a body that the file lacks")
            fits = len(pose.values) == len(models[revision].value_names) and np.isfinite(pose.values).all()
            _require(bool(fits), f"the pose of {where} does not fit its body")
            _require(_are_finite([pose.cost_px]), f"the pose of {where} has an impossible cost")
        if found.pose is not None:
            _require(_is_possible(found.pose), f"the pose of {where} has impossible sources, marks or costs")
    elif isinstance(found, AssessmentChange):
        is_possible = _are_finite(found.values) and _is_possible_assessment(found)
        _require(is_possible, f"the assessment of {where} is impossible")
    return found


def _is_possible(pose: PoseRecord) -> bool:
    return (
        len(pose.sources) == len(pose.values)
        and set(pose.sources) <= set(SOURCES)
        and _are_finite((*pose.view_costs_px, *pose.part_costs_px))
        and _is_possible_assessment(pose)
    )


def _is_possible_assessment(pose: PoseRecord | AssessmentChange) -> bool:
    return (
        pose.status in STATUSES
        and _are_finite(pose.limbs_lost)
        and all(0 <= p <= 1 for p in pose.limbs_lost)
        and (pose.errors is None or (pose.errors.shape[1:] == (3, 3) and bool(np.isfinite(pose.errors).all())))
    )


def _are_finite(numbers: Iterable[float | None]) -> bool:
    return all(n is None or np.isfinite(n) for n in numbers)


def _require(is_so: bool, otherwise: str) -> None:
    if not is_so:
        raise ValueError(otherwise)


def _array(_: type, values: Any) -> Any:
    is_nested = isinstance(values, list) and len(values) > 0 and isinstance(values[0], list)
    return np.array(msgspec.convert(values, list[list[list[float]]] if is_nested else list[float]), dtype=np.float64)
