"""The union of the edits and moves of two logs: their order, their changes, and which edits are done.

Join the present poses and pins of two copies, given those at the time of the copy.

A pose or pin that one copy changed is taken. A pose that both changed differently is a conflict: a pose goes before a
cleared one, a keyframe before a reviewed pose, that before any other, and of equal ones the later.
"""

from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

from tracker.session.store.edit_log import COLUMNS, NUMBERS, EditLog, LoggedEdit, Move, Pair, PinKey, PoseRow

T = TypeVar("T", bound=Hashable)


class EditUnion(NamedTuple):
    """The edits of two logs, and what is common to them."""

    edits: list[LoggedEdit]
    """All edits in order of time and identity; each log's own order is respected."""
    done: frozenset[str]
    """Identities of the edits that are done in the union."""
    moves: list[Move]
    common: list[LoggedEdit]
    """The edits that both logs have and that were done when they were copied, with the changes that both have."""


def interleave(one: Sequence[T], other: Sequence[T], key: Callable[[T], Any]) -> list[T]:
    """Join two sequences of distinct items; those of both appear once.

    The order of each sequence is respected. Where both allow it, the item with the smaller key comes first.
    """
    in_one, in_other, seen = set(one), set(other), set[T]()
    out = list[T]()
    i = j = 0
    while True:
        i = next((k for k in range(i, len(one)) if one[k] not in seen), len(one))
        j = next((k for k in range(j, len(other)) if other[k] not in seen), len(other))
        first, second = one[i : i + 1], other[j : j + 1]
        heads = [*first, *second]
        if not heads:
            return out
        # An item of both waits until it is the next one of both.
        waiting = {*first} & in_other | {*second} & in_one
        ready = [h for h in heads if h not in waiting or heads == [h, h]]
        out.append(min(ready or heads, key=key))
        seen.add(out[-1])


def unite(a: EditLog, b: EditLog) -> EditUnion:
    """Return the union of two logs; `unite(b, a)` is the same.

    An edit of both is done if it is in both, and undone if it is in both; else the log counts that changed it since the
    copy. An edit of one log alone is done if it is done there.
    """
    by_uid = [{edit.uid: edit for edit in log.edits} for log in (a, b)]
    shared = by_uid[0].keys() & by_uid[1].keys()
    times = {edit.uid: edit.time for log in (a, b) for edit in log.edits}
    order = interleave([e.uid for e in a.edits], [e.uid for e in b.edits], lambda uid: (times[uid], uid))
    numbered = [_numbered(log.moves) for log in (a, b)]
    common_moves = {*numbered[0]} & {*numbered[1]}
    before = {uid: True for uid in shared}
    for move, _ in numbered[0]:
        if (move, _) in common_moves and move.uid in before:
            before[move.uid] = move.kind == "redo"
    moves = [m for m, _ in interleave(numbered[0], numbered[1], lambda m: (m[0].time, m[0].uid, m[0].kind, m[1]))]
    done = set[str]()
    for uid in order:
        states = [uid in log.done for log, own in zip((a, b), by_uid, strict=True) if uid in own]
        is_done = states[0] if len({*states}) == 1 else not before[uid]
        done |= {uid} if is_done else set()
    edits, common = [], []
    for uid in order:
        if uid in shared:
            whole, both = _joined(by_uid[0][uid], by_uid[1][uid])
            edits.append(whole)
            common += [both] if before[uid] else []
        else:
            edits.append(by_uid[0].get(uid) or by_uid[1][uid])
    return EditUnion(edits, frozenset(done), [*moves, *_corrections(moves, done, shared, times)], common)


def _numbered(moves: Sequence[Move]) -> list[tuple[Move, int]]:
    """Tell equal moves apart by their number: an edit can be undone twice in a millisecond."""
    seen = Counter[Move]()
    out = []
    for move in moves:
        seen[move] += 1
        out.append((move, seen[move]))
    return out


def _corrections(moves: Sequence[Move], done: set[str], shared: set[str], times: dict[str, str]) -> list[Move]:
    """Return moves after which the last move of each shared edit says whether it is done."""
    last = {uid: "redo" for uid in shared} | {move.uid: move.kind for move in moves if move.uid in shared}
    wrong = sorted(uid for uid, kind in last.items() if (kind == "redo") != (uid in done))
    time = max([*times.values(), *(move.time for move in moves)], default="")
    return [Move("redo" if uid in done else "undo", uid, time) for uid in wrong]


def _joined(one: LoggedEdit, other: LoggedEdit) -> tuple[LoggedEdit, LoggedEdit]:
    """Return an edit with the changes of two copies, and with those that both have.

    They differ where the edit went on in a copy, as a long run does, or where changes are hidden in a blind copy.
    """
    if one == other:
        return one, one
    first, second = sorted((one, other), key=lambda e: (-len(e.poses) - len(e.pins), repr((e.poses, e.pins))))
    all_poses, both_poses = _changes(first.poses, second.poses)
    all_pins, both_pins = _changes(first.pins, second.pins)
    return (first._replace(poses=all_poses, pins=all_pins), first._replace(poses=both_poses, pins=both_pins))


def _changes(first: Sequence[T], second: Sequence[T]) -> tuple[tuple[T, ...], tuple[T, ...]]:
    left, both = Counter(second), list[T]()
    for change in first:
        if left[change]:
            left[change] -= 1
            both.append(change)
    spare = list(left.elements())
    return (*first, *spare), tuple(both)


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
