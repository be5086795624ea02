"""Audit stored poses, tracked here or imported: track once more without each camera in turn, and assess each pose.

A run of the tracker audits its own poses (`track_session`). This is for poses that are stored already.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tracker.body.model import PosedBody
from tracker.compute.progress import Report, unreported
from tracker.errors import Remedy, TrackerError
from tracker.evidence.observer import Observer
from tracker.fitting.consensus import agreement, consensus
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import floor_plane
from tracker.pipeline.assessed_poses import assessed_by_tracks, assessed_keyframe, with_alternatives, with_repair
from tracker.pipeline.methods import make_tracker
from tracker.pipeline.run_repair import RepairedPose, RunRepair
from tracker.pipeline.track_session import outward
from tracker.session.locked_dofs import active_dofs, load_locks
from tracker.session.session import Session
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import AssessmentChange, PoseChange, PoseRecord
from tracker.tracking.estimation.settings import EstimationSettings
from tracker.tracking.person_memory import HISTORY_FRAMES
from tracker.tracking.subjects import Subjects
from tracker.tracking.tracker import TrackerSettings, TrackingRun
from tracker.tracking.view_tracks import FrameTracks, left_out, tracks_without_views

_PLACED = ("manual", "pinned", "fitted")
"""Sources of poses that tracks go out from, where a stretch has some."""


@dataclass(frozen=True)
class AuditPlan:
    """Which stored poses are audited, and how."""

    frames: Sequence[int]
    """That may be audited, ascending."""
    people: tuple[int, ...]
    """Indices of the people."""
    settings: TrackerSettings
    """Of the tracker."""
    takes_consensus: bool = False
    """Whether the consensus of the tracks takes the place of the poses, and limbs are searched; else they stay."""


def audit_poses(
    session: Session, store: AnnotationStore, observer: Observer, plan: AuditPlan, report: Report = unreported
) -> list[PoseChange | AssessmentChange]:
    """Assess the stored poses of people; return their rows with errors, statuses and reasons. Nothing is stored.

    Keyframes are assessed, but are not changed. Frames on which somebody has no pose are left out.

    Args:
        session: the session.
        store: its annotations.
        observer: of its recording.
        plan: what to audit.
        report: shows progress. An exception that it raises ends the audit.

    Raises:
        TrackerError: there are fewer than three views, or no two frames in a row on which all have a pose.
    """
    if not left_out(len(observer.cameras)):
        raise TrackerError(
            f"expected three cameras or more to audit poses, found {len(observer.cameras)}: without one of two, "
            "nothing shows depth"
        )
    records = [store.poses(session.people[i].name, range(plan.frames[0], plan.frames[-1] + 1)) for i in plan.people]
    sizes = [len(session.people[i].model.value_names) for i in plan.people]
    posed = [
        k for k in plan.frames
        if all(k in own and len(own[k].values) == n for own, n in zip(records, sizes, strict=True))
    ]  # fmt: skip
    stretches = [found for found in _stretches(posed) if len(found) > 1]
    if not stretches:
        raise TrackerError(
            "expected two frames in a row on which all these people have a pose, found none; track or import poses "
            "first",
            Remedy("place_body"),
        )
    tracks, done, total = dict[int, Mapping[int, FrameTracks]](), 0, sum(map(len, stretches))
    for stretch in stretches:
        for frame, found in _tracks(session, store, observer, plan, records, stretch):
            done += frame not in tracks
            tracks.setdefault(frame, found)
            report("checking each camera", done / total)
    poses = {i: _agreed(session, plan, i, own, tracks) for i, own in zip(plan.people, records, strict=True)}
    repaired = _repaired(session, store, observer, plan, poses, tracks, report)
    rows = [
        _row(session, store, person, frame, own[frame], tracks[frame][person], repaired.get(person, {}).get(frame))
        for person, own in poses.items()
        for frame in sorted(tracks)
    ]
    return [row for row in rows if row is not None]


def _agreed(
    session: Session, plan: AuditPlan, person: int, records: Mapping[int, PoseRecord],
    tracks: Mapping[int, Mapping[int, FrameTracks]],
) -> dict[int, PoseRecord]:  # fmt: skip
    """Return the poses of a person that are assessed, by frame: as they are stored, or the consensus of the tracks."""
    model, out = session.people[person].model, {}
    for frame, of_people in tracks.items():
        record, own = records[frame], of_people[person]
        if plan.takes_consensus and not record.keyframe:
            trust = np.vstack([np.ones(own.trust.shape[1]), own.trust])
            record = replace(record, values=consensus(model, record.values, own.poses, trust).pose)
        out[frame] = record
    return out


def _repaired(
    session: Session, store: AnnotationStore, observer: Observer, plan: AuditPlan,
    records: Mapping[int, Mapping[int, PoseRecord]], tracks: Mapping[int, Mapping[int, FrameTracks]], report: Report,
) -> Mapping[int, Mapping[int, RepairedPose]]:  # fmt: skip
    """Compare the poses with the colours of the whole run; repair them where the consensus takes their place."""
    models, frames, settings = [p.model for p in session.people], sorted(tracks), plan.settings
    if len(frames) <= HISTORY_FRAMES or not isinstance(settings, EstimationSettings):
        return {}  # A few frames show nothing that is usual.
    others = _others(session, store, plan.people, frames)
    stay = {
        k: {**others.get(k, {}), **{i: own[k].values for i, own in records.items() if own[k].keyframe}} for k in frames
    }
    subjects = Subjects.of(models, plan.people, None, stay)
    in_order = [records[i] for i in plan.people]
    bodies = {
        k: tuple(map(PosedBody, models, _poses(session, plan.people, in_order, k, others.get(k, {})))) for k in frames
    }
    by_person = {i: {k: tracks[k][i] for k in frames} for i in plan.people}

    known = {
        (k, i): [a.values for a in store.alternatives(session.people[i].name, k) if len(a.values) == len(own[k].values)]
        for i, own in records.items()
        for k in frames
    }
    repair = RunRepair(observer, subjects, settings, bodies, by_person, known, plan.takes_consensus)
    found: Mapping[int, Mapping[int, RepairedPose]] = {}
    for step in repair.steps():
        report("comparing with the colours of the run", step.done / step.total)
        found = step.found or found
    return found


def _row(
    session: Session, store: AnnotationStore, person: int, frame: int, record: PoseRecord, tracks: FrameTracks,
    repaired: RepairedPose | None,
) -> PoseChange | AssessmentChange | None:  # fmt: skip
    """Return the row of a pose with its assessment, and its alternatives as they are; of a keyframe the assessment
    alone, or None where nothing is known about it."""
    name, model = session.people[person].name, session.people[person].model
    if record.keyframe:
        return assessed_keyframe(model, name, frame, record, tracks, repaired)
    trust, change = tracks.trust, PoseChange(name, frame, record, tuple(store.alternatives(name, frame)))
    if repaired is not None:
        record, trust = with_repair(model, replace(record, values=repaired.pose), repaired), trust * repaired.trust
        change = with_alternatives(change, repaired)
    found = agreement(model, record.values, tracks.poses, trust)
    is_ambiguous = len(change.alternatives) > 0
    return replace(change, pose=assessed_by_tracks(model, record, found, tracks, is_ambiguous, None, repaired))


def _tracks(
    session: Session, store: AnnotationStore, observer: Observer, plan: AuditPlan,
    records: Sequence[Mapping[int, PoseRecord]], stretch: Sequence[int],
) -> Iterator[tuple[int, Mapping[int, FrameTracks]]]:  # fmt: skip
    """Track a stretch without each view, out from its first placed frame; without one, from its first frame."""
    people, models = plan.people, [p.model for p in session.people]
    locks = load_locks(session.people, store.setting)
    active = [active_dofs(m, locked) for m, locked in zip(models, locks, strict=True)]
    start = next((k for k in stretch if all(_is_placed(own[k]) for own in records)), stretch[0])
    others = _others(session, store, people, stretch)
    subjects = Subjects.of(models, people, active, others)
    poses = {k: _poses(session, people, records, k, others.get(k, {})) for k in stretch}
    for frames in outward(stretch, start):
        run = TrackingRun(
            observer, subjects, [[p, p] for p in poses[frames[0]]], frames, session.fps,
            floor_plane(session.up, session.floor),
        )  # fmt: skip
        yield from tracks_without_views(make_tracker(plan.settings), run, poses)


def _others(
    session: Session, store: AnnotationStore, people: Sequence[int], frames: Sequence[int]
) -> dict[int, dict[int, Array]]:
    """Return the stored poses of people who are not audited, who stay there, by frame and index of the person."""
    out: dict[int, dict[int, Array]] = {}
    for i, person in enumerate(session.people):
        found = {} if i in people else store.poses(person.name, range(frames[0], frames[-1] + 1))
        for frame, record in found.items():
            if len(record.values) == len(person.model.value_names):
                out.setdefault(frame, {})[i] = record.values
    return out


def _poses(
    session: Session, people: Sequence[int], records: Sequence[Mapping[int, PoseRecord]], frame: int,
    others: Mapping[int, Array],
) -> list[Array]:  # fmt: skip
    """Return the poses of all people on a frame; the neutral one of people who have none."""
    own = {**others, **{i: of_person[frame].values for i, of_person in zip(people, records, strict=True)}}
    return [own.get(i, p.model.neutral()) for i, p in enumerate(session.people)]


def _is_placed(record: PoseRecord) -> bool:
    return record.keyframe or any(source in _PLACED for source in record.sources)


def _stretches(frames: Sequence[int]) -> list[list[int]]:
    """Return frames in groups that follow one another at their usual distance."""
    step = int(np.median(np.diff(frames))) if len(frames) > 1 else 1
    out: list[list[int]] = []
    for k in frames:
        if out and k - out[-1][-1] == step:
            out[-1].append(k)
        else:
            out.append([k])
    return out
