"""Settings of a store that name edits and bodies by number: without numbers, joined, and with others."""

import json
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

from tracker.errors import DamagedStoreError
from tracker.pipeline.body_acquisition import SIZES_EDITS, sizes_changed
from tracker.pipeline.stored_run import UNFINISHED
from tracker.session.store.calibration_log import CALIBRATION_EDITS, CALIBRATIONS, CALIBRATIONS_OF_EDITS
from tracker.session.store.edit_log import Body, EditLog, Written
from tracker.session.store.own_undo import TAKEN_BACK

_NUMBERED = (SIZES_EDITS, CALIBRATIONS, CALIBRATION_EDITS, CALIBRATIONS_OF_EDITS, TAKEN_BACK, UNFINISHED)
"""These settings; an unfinished run is dropped: it would go on in another store."""


class Numbered(NamedTuple):
    """Content of these settings, by identity of the edit."""

    sizes: Mapping[str, Sequence[tuple[str, Body, Body]]]
    """Name of each person whose sizes an edit changed, with the bodies before and after it."""
    calibrations: Mapping[str, dict[str, Any]]
    """The calibrations by their content as text, in the order of their revisions."""
    changes: Mapping[str, tuple[str, str]]
    """The calibrations before and after each edit that changed them."""
    posed: Mapping[str, str]
    """The calibration that the poses of each edit were made with; empty if the calibration has never been changed."""
    taken_back: Mapping[str, str] = MappingProxyType({})
    """For each edit that took back an earlier one, the earlier one."""


def plain_settings(log: EditLog) -> dict[str, Any]:
    """Return the settings that hold no numbers."""
    return {key: value for key, value in log.settings.items() if key not in _NUMBERED}


def numbered_settings(log: EditLog) -> Numbered:
    """Return the settings with numbers."""
    bodies = {r.id: (r.person, r.toml) for r in log.revisions}
    sizes_edits = log.settings.get(SIZES_EDITS, {})
    sizes = {
        log.numbers[int(edit)]: [
            (name, bodies[b], bodies[a])
            for name, b, a in sizes_changed(sizes_edits, int(edit))
            if b in bodies and a in bodies
        ]
        for edit in sizes_edits
        if int(edit) in log.numbers
    }
    known = log.settings.get(CALIBRATIONS, [])
    parts = [{"toml": c["toml"]} | {part: c.get(part, {}) for part in ("clocks", "lost", "offsets")} for c in known]
    texts = [json.dumps(own, sort_keys=True) for own in parts]
    named = [n for pair in log.settings.get(CALIBRATION_EDITS, {}).values() for n in pair]
    if max([*named, *log.settings.get(CALIBRATIONS_OF_EDITS, {}).values()], default=0) > len(texts):
        raise DamagedStoreError(f"the history names a calibration beyond the {len(texts)} that are stored; correct it")
    changes = {
        log.numbers[int(edit)]: (texts[before - 1], texts[after - 1])
        for edit, (before, after) in sorted(
            log.settings.get(CALIBRATION_EDITS, {}).items(), key=lambda item: int(item[0])
        )
        if int(edit) in log.numbers
    }
    stated = log.settings.get(CALIBRATIONS_OF_EDITS, {})
    posed: dict[str, str] = {}
    present = next(iter(changes.values()))[0] if changes else ""
    for number, uid in log.numbers.items() if changes else ():
        present = changes[uid][1] if uid in changes and uid in log.done else present
        posed[uid] = texts[stated[str(number)] - 1] if str(number) in stated else present
    taken_back = {
        log.numbers[int(taker)]: log.numbers[taken]
        for taker, taken in log.settings.get(TAKEN_BACK, {}).items()
        if int(taker) in log.numbers and taken in log.numbers
    }
    return Numbered(sizes, dict(zip(texts, known, strict=True)), changes, posed, taken_back)


def join_numbered(a: Numbered, b: Numbered) -> Numbered:
    """Join the settings of two copies; `join_numbered(b, a)` is the same."""
    pairs = sorted((*a.calibrations.items(), *b.calibrations.items()), key=lambda pair: (pair[1]["time"], pair[0]))
    calibrations = dict(
        reversed({text: known for text, known in reversed(pairs)}.items())
    )  # the earliest of equal ones
    changes, taken_back = {**a.changes, **b.changes}, {**a.taken_back, **b.taken_back}
    return Numbered({**a.sizes, **b.sizes}, calibrations, changes, {**a.posed, **b.posed}, taken_back)


def renumbered(found: Numbered, order: Sequence[str], done: frozenset[str], written: Written) -> dict[str, Any]:
    """Return the settings for a store that was written from a log.

    Args:
        found: the settings without numbers.
        order: identities of its edits in order.
        done: identities of those that are done.
        written: its numbers.
    """
    edits, bodies = written
    out: dict[str, Any] = {}
    if found.sizes:
        rows = {uid: [[name, bodies[b], bodies[a]] for name, b, a in changed] for uid, changed in found.sizes.items()}
        out[SIZES_EDITS] = {str(edits[uid]): changed for uid, changed in rows.items()}
    if found.taken_back:
        taken_back = found.taken_back.items()
        out[TAKEN_BACK] = {str(edits[taker]): edits[of] for taker, of in taken_back if taker in edits and of in edits}
    if not found.changes:
        return out
    numbers = {text: n for n, text in enumerate(found.calibrations, 1)}
    out[CALIBRATIONS] = list(found.calibrations.values())
    changes, stated = {}, {}
    first = present = next(found.changes[uid][0] for uid in order if uid in found.changes)
    for uid in order:
        if uid in found.changes:
            after = found.changes[uid][1]
            changes[str(edits[uid])] = [numbers[present], numbers[after]]
            present = after if uid in done else present
        made_with = found.posed.get(uid, first)  # A copy whose calibration was never changed has the first one.
        if made_with != present:
            stated[str(edits[uid])] = numbers[made_with]
    out[CALIBRATION_EDITS] = changes
    return out | ({CALIBRATIONS_OF_EDITS: stated} if stated else {})


def sizes_after(found: Numbered, order: Sequence[str], done: frozenset[str]) -> dict[str, Body]:
    """Return the body that each person has after the last done edit that changed it, by name; after none, the first."""
    bodies: dict[str, Body] = {}
    for uid in order:
        for name, before, after in found.sizes.get(uid, ()):
            bodies.setdefault(name, before)
            bodies[name] = after if uid in done else bodies[name]
    return bodies
