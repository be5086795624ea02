"""The union of the edits and moves of two logs: their order, their changes, and which edits are done."""

from collections import Counter
from collections.abc import Callable, Hashable, Sequence
from typing import Any, NamedTuple, TypeVar

from tracker.session.store.edit_log import EditLog, LoggedEdit, Move

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
