"""Join the present poses and pins of two copies, given those at the time of the copy.

A pose or pin that one copy changed is taken. A pose that both changed differently is a conflict: a pose goes before a
cleared one, a keyframe before a reviewed pose, that before any other, and of equal ones the later.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

from tracker.session.store.edit_log import COLUMNS, NUMBERS, LoggedEdit, Pair, PinKey, PoseRow

_BODY, _KEYFRAME, _REVIEWED = (COLUMNS.index(name) for name in ("model_revision", "keyframe", "reviewed"))


class Shown(NamedTuple):
    """The present pose of a person in a frame."""

    row: PoseRow
    """With `made_in` as the edit that made the pose."""
    time: str
    """Time of that edit."""
    author: str

    @property
    def rank(self) -> int:
        """2 for a keyframe, 1 for a reviewed pose, 0 for another."""
        assert self.row.pose is not None
        return 2 if self.row.pose[_KEYFRAME] else int(bool(self.row.pose[_REVIEWED]))


Poses = Mapping[Pair, Shown]
"""Poses that are not cleared, by person and frame."""


class Conflict(NamedTuple):
    """Poses of a person and frame that people made or checked in both copies, and that really differ."""

    at: Pair
    winner: Shown
    other: Shown
    apart_m: float


def poses_after(edits: Iterable[LoggedEdit], origins: Mapping[str, LoggedEdit]) -> dict[Pair, Shown]:
    """Return the poses after edits; `origins` are all edits by identity."""
    poses: dict[Pair, Shown] = {}
    for edit in edits:
        for key, row in edit.poses:
            poses.pop(key, None)
            if row.pose is not None:
                made = origins[row.made_in or edit.uid]
                poses[key] = Shown(row._replace(made_in=made.uid), made.time, made.author)
    return poses


def pins_after(edits: Iterable[LoggedEdit]) -> dict[PinKey, tuple[tuple[float, float], str, str]]:
    """Return the pins after edits: position, time and identity of the edit."""
    pins: dict[PinKey, tuple[tuple[float, float], str, str]] = {}
    for edit in edits:
        for key, place in edit.pins:
            pins.pop(key, None)
            if place is not None:
                pins[key] = (place, edit.time, edit.uid)
    return pins


def join_poses(
    base: Poses, a: Poses, b: Poses, apart_m: Callable[[Shown, Shown], float], tolerance_m: float
) -> tuple[dict[Pair, Shown], list[Conflict], dict[Pair, int]]:
    """Join the poses of two copies.

    Args:
        base: poses that both had in common.
        a: poses of one copy.
        b: poses of the other.
        apart_m: returns how far two poses of a person are apart, m.
        tolerance_m: distance up to which two poses are the same.

    Returns:
        The joined poses, the conflicts, and for each pose that both changed the copy that won: 0 or 1.
    """
    joined: dict[Pair, Shown] = {}
    conflicts, won = [], {}
    for key in sorted(base.keys() | a.keys() | b.keys()):
        before, mine, theirs = base.get(key), a.get(key), b.get(key)
        if mine == theirs or theirs == before:
            chosen = mine
        elif mine == before:
            chosen = theirs
        elif mine is None or theirs is None:
            chosen = mine or theirs
        else:
            sides = (mine, theirs)
            side = max((0, 1), key=lambda i: (sides[i].rank, sides[i].time, sides[i].row.made_in, repr(sides[i].row)))
            won[key] = side
            winner, other = sides[side], sides[1 - side]
            if _is_same(winner.row, other.row):
                chosen = _joined_marks(before, winner, other)
            else:
                chosen = winner
                if min(winner.rank, other.rank) and (distance := apart_m(winner, other)) > tolerance_m:
                    chosen = winner._replace(row=_with_alternative(winner.row, other.row))
                    conflicts.append(Conflict(key, winner, other, distance))
        if chosen is not None:
            joined[key] = chosen
    return joined, conflicts, won


def join_pins(
    base: Mapping[PinKey, tuple[tuple[float, float], str, str]],
    sides: tuple[Mapping[PinKey, tuple[tuple[float, float], str, str]], ...],
    won: Mapping[Pair, int],
) -> dict[PinKey, tuple[float, float]]:
    """Join the pins of two copies: of one that both changed, that of the pose that won, else the later one."""
    joined = {}
    for key in sorted(base.keys() | sides[0].keys() | sides[1].keys()):
        places = [side[key][0] if key in side else None for side in (base, *sides)]
        before, mine, theirs = places
        if mine == theirs or theirs == before:
            chosen = mine
        elif mine == before:
            chosen = theirs
        elif key[:2] in won:
            chosen = places[1 + won[key[:2]]]
        elif mine is None or theirs is None:
            chosen = mine or theirs
        else:
            chosen = max(sides[0][key], sides[1][key], key=lambda pin: (pin[1:], pin[0]))[0]
        if chosen is not None:
            joined[key] = chosen
    return joined


def _is_same(one: PoseRow, other: PoseRow) -> bool:
    assert one.pose is not None
    assert other.pose is not None
    return all(one.pose[i] == other.pose[i] for i in (NUMBERS, _BODY))


def _joined_marks(before: Shown | None, winner: Shown, other: Shown) -> Shown:
    """Join marks and assessments of one pose field by field; where both copies changed one, that of the winner."""
    assert winner.row.pose is not None
    assert other.row.pose is not None
    if before is None or not _is_same(before.row, winner.row):
        return winner
    assert before.row.pose is not None
    fields = zip(before.row.pose, winner.row.pose, other.row.pose, strict=True)
    pose = tuple(theirs if mine == was else mine for was, mine, theirs in fields)
    return winner._replace(row=winner.row._replace(pose=pose))


def _with_alternative(row: PoseRow, other: PoseRow) -> PoseRow:
    """Return a pose with another one as its first alternative."""
    assert other.pose is not None
    cost = other.pose[COLUMNS.index("cost_px")]
    alternatives = ((other.pose[_BODY], other.pose[NUMBERS], cost), *row.alternatives)
    return row._replace(alternatives=tuple(dict.fromkeys(alternatives)))
