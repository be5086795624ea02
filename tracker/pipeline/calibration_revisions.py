"""Change the calibration of a session: corrections are entries of the history (`store.calibration_log`)."""

import itertools
import math
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from tracker.calibration.check.fault_search import Fault
from tracker.errors import SessionError
from tracker.files import refuse_links, write_text_atomic
from tracker.footage.camera_source import CameraSource, Clock, LostFrames
from tracker.formats.anipose import format_calibration
from tracker.formats.model_toml import has_preset_proportions
from tracker.geometry.arrays import TINY, Array
from tracker.geometry.camera_correction import DRIFT, TIME, corrected
from tracker.pipeline.body_acquisition import SIZES_EDITS, sizes_changed
from tracker.pipeline.calibration_check import CalibrationCheck
from tracker.pipeline.stored_run import forget_unfinished
from tracker.session.session import CALIBRATION_FILE, Session, load_session, save_camera_files
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.calibration_log import (
    CALIBRATION_EDITS,
    CALIBRATIONS,
    calibration_edits,
    present_revision,
    revisions_of_poses,
)
from tracker.session.store.edit_tree import now
from tracker.session.synchronize import FoundStart


def apply_check(session: Session, store: AnnotationStore, check: CalibrationCheck) -> Session:
    """Correct the cameras that a check names, as one entry of the history.

    Args:
        session: the session, which this process has locked.
        store: its annotations.
        check: what it says.

    Returns:
        The session with the corrected cameras. Poses stay as they are.

    Raises:
        SessionError: no camera is named, or the folder cannot be written.
    """
    if not check.named:
        raise SessionError("expected a camera that is off, found none; the calibration stays as it is")
    corrected_session = with_corrections(session, check.corrections, check.middle_s, check.lost)
    return change_calibration(session, store, corrected_session, f"calibration of {', '.join(check.named)} corrected")


def with_corrections(
    session: Session, corrections: Array, middle_s: float = 0.0, lost: Mapping[str, LostFrames] = MappingProxyType({})
) -> Session:
    """Return a session with corrected cameras. Nothing is stored.

    Args:
        session: with the present cameras.
        corrections: (V, N_CORRECTIONS).
        middle_s: time that the offsets of the corrections are of, seconds; those of clocks are at frame 0.
        lost: of cameras whose clock lost frames and is right otherwise, by name.
    """
    cameras = []
    for source, c in zip(session.cameras, corrections, strict=True):
        clock, own = source.clock, lost.get(source.camera.name)
        if own is not None:
            clock = clock.with_lost(own)
        else:
            late_s = float(c[TIME] - c[DRIFT] * middle_s)
            ahead_frames = clock.ahead_frames + late_s * session.fps
            clock = replace(clock, ahead_frames=ahead_frames, rate=clock.rate + float(c[DRIFT]))
        cameras.append(replace(source, camera=corrected(source.camera, c), clock=clock))
    return replace(session, cameras=tuple(cameras))


def starts_by_motion(session: Session, check: CalibrationCheck) -> list[FoundStart]:
    """Return the starts and drifts of cameras by the motion of the people, as a check has found them.

    A camera that is not named by its clock has the start that its contours alone would give it, and is not clear.
    """
    late, steps = np.zeros_like(check.corrections), check.diagnosis.steps
    is_clear = [{"time", "drift"} & set(c.kinds) and not {c.name} & {*check.since, *check.lost} for c in check.cameras]
    for i, (found, clear) in enumerate(zip(check.cameras, is_clear, strict=True)):
        alone = steps.get(Fault(i, "time"))
        likely = found.correction if clear or alone is None else alone.correction
        late[i, [TIME, DRIFT]] = likely[[TIME, DRIFT]]
    return [
        FoundStart(
            c.camera.name, c.start_frames if found.is_seen else None, float(1000 * found.sigma[TIME]), None,
            bool(clear), c.clock.rate,
        )
        for c, found, clear in zip(
            with_corrections(session, late, check.middle_s).cameras, check.cameras, is_clear, strict=True
        )
    ]  # fmt: skip


def change_calibration(
    session: Session, store: AnnotationStore, changed: Session, label: str, amends: int | None = None
) -> Session:
    """Give a session other cameras, as one entry of the history that undo reverts.

    Args:
        session: the session, which this process has locked.
        store: its annotations.
        changed: the same session with other cameras.
        label: of the entry.
        amends: the last entry of the history, if this change goes on with it and nothing was made under it.
    """
    known, edits = _revisions(session, store), store.setting(CALIBRATION_EDITS, {})
    former = None if amends is None else edits.pop(str(amends))
    if former is not None and former[1] == len(known) and former[1] not in itertools.chain(*edits.values(), former[:1]):
        known.pop()  # A gesture of many steps leaves its last calibration alone.
    before = _number(known, _content(session)) if former is None else former[0]
    after = _number(known, _content(changed))
    store.set_setting(CALIBRATIONS, known)
    if former is not None:
        store.set_setting(CALIBRATION_EDITS, {**edits, str(amends): [before, after]})
    else:
        forget_unfinished(store)  # An interrupted run would go on under another calibration.
        store.commit(label, [], settings=lambda edit: {CALIBRATION_EDITS: {**edits, str(edit): [before, after]}})
    return _write(session, _content(changed))


def follow_history(session: Session, store: AnnotationStore) -> Session:
    """Give a session the calibration that belongs to its history, after undo, redo, or a change that was cut off.

    A calibration that is no revision stays: somebody has replaced the file.
    """
    revision = present_revision(store)
    known, present = _revisions(session, store), _content(session)
    if revision is None or _same(present, known[revision - 1]):
        return session
    # A change that was cut off has the cameras of one revision and the clocks of another.
    for parts in (("toml",), ("clocks", "lost", "offsets")):
        if not any(_same({**c, **{part: present[part] for part in parts}}, c) for c in known):
            return session
    return _write(session, known[revision - 1])


def outdated_frames(session: Session, store: AnnotationStore) -> dict[str, list[int]]:
    """Return the frames on which people have poses of an earlier calibration, by name; nobody without such frames."""
    present, out = present_revision(store), {}
    for person in session.people:
        outdated = [k for k, r in revisions_of_poses(store, person.name).items() if r != present]
        if outdated:
            out[person.name] = outdated
    return out


def outdated_sizes(session: Session, store: AnnotationStore) -> list[str]:
    """Return the names of people who have sizes of their own from before the last change of the calibration.

    They were fitted to contours as the former cameras saw them.
    """
    done = set(store.done_edits())
    corrected_by = max((edit for edit in calibration_edits(store) if edit in done), default=0)
    sizes_edits, last = store.setting(SIZES_EDITS, {}), dict[str, int]()
    for edit in sorted(done.intersection(map(int, sizes_edits))):
        last.update({name: edit for name, _, _ in sizes_changed(sizes_edits, edit)})
    acquired = [p.name for p in session.people if not has_preset_proportions(p.model)]
    return [name for name in acquired if last.get(name, corrected_by) < corrected_by]


def same_calibration(one: Session, other: Session) -> bool:
    """Return whether two sessions have the same calibration but for rounding."""
    return _same(_content(one), _content(other))


def _revisions(session: Session, store: AnnotationStore) -> list[dict[str, Any]]:
    """Return the stored revisions. Former programs stored no offsets, because nothing changed them."""
    offsets = _content(session)["offsets"]
    return [{"offsets": offsets, "lost": {}, **revision} for revision in store.setting(CALIBRATIONS, [])]


def _number(known: list[dict[str, Any]], content: Mapping[str, Any]) -> int:
    """Return the number of a calibration among the known ones, which it joins if it is new."""
    for number, revision in enumerate(known, 1):
        if _same(revision, content):
            return number
    known.append({**content, "time": now()})
    return len(known)


def _same(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Return whether two revisions are equal but for rounding: writing keeps 12 digits."""
    parts = all(_alike(one[part], other[part]) for part in ("clocks", "lost", "offsets"))
    return parts and _alike(tomllib.loads(one["toml"]), tomllib.loads(other["toml"]))


def _alike(a: object, b: object) -> bool:
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_alike(v, b[k]) for k, v in a.items())
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(_alike, a, b))
    if isinstance(a, float) and isinstance(b, float):
        return math.isclose(a, b, rel_tol=TINY, abs_tol=TINY)
    return a == b


def _content(session: Session) -> dict[str, Any]:
    """Return the calibration of a session as a revision holds it: the cameras, and by name their clocks, offsets and
    lost frames."""
    clocks = {c.camera.name: [float(c.clock.ahead_frames), float(c.clock.rate)] for c in session.cameras}
    lost = {c.camera.name: [list(own) for own in c.clock.lost] for c in session.cameras if c.clock.lost}
    offsets = {c.camera.name: c.offset for c in session.cameras}
    toml = format_calibration([c.camera for c in session.cameras])
    return {"toml": toml, "clocks": clocks, "lost": lost, "offsets": offsets}


def _write(session: Session, content: Mapping[str, Any]) -> Session:
    """Write a calibration, and return the session as it then is."""
    refuse_links(session.folder, CALIBRATION_FILE)
    try:
        write_text_atomic(session.folder / CALIBRATION_FILE, content["toml"])
    except OSError as error:
        raise SessionError(
            f"cannot write {session.folder / CALIBRATION_FILE}: {error}; see that you may write to the folder"
        ) from error
    loaded, is_same = load_session(session.folder), content["toml"] == _content(session)["toml"]

    def source(before: CameraSource, own: CameraSource) -> CameraSource:
        name = own.camera.name
        if name not in content["clocks"]:
            return own
        ahead_frames, rate = content["clocks"][name]
        clock = Clock(ahead_frames, rate, tuple(LostFrames(*lost) for lost in content["lost"].get(name, ())))
        camera = before.camera if is_same else own.camera  # the same object, so that nothing is computed again from it
        return replace(own, camera=camera, offset=content["offsets"].get(name, own.offset), clock=clock)

    return save_camera_files(loaded, [*map(source, session.cameras, loaded.cameras)])
