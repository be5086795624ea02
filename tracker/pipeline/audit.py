"""Audit stored poses, tracked here or imported: track once more without each camera in turn, and assess each pose.

A run of the tracker audits its own poses (`track_session`). This is for poses that are stored already.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tracker.compute.progress import Report, unreported
from tracker.errors import Remedy, TrackerError
from tracker.evidence.observer import Observer
from tracker.fitting.consensus import agreement, consensus
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import floor_plane
from tracker.pipeline.assessed_poses import assessed_by_tracks
from tracker.pipeline.methods import make_tracker
from tracker.pipeline.track_session import outward
from tracker.session.locked_dofs import active_dofs, load_locks
from tracker.session.session import Session
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import PoseChange, PoseRecord
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
    """Whether the consensus of the tracks takes the place of the poses; else they stay as they are."""


def audit_poses(
    session: Session, store: AnnotationStore, observer: Observer, plan: AuditPlan, report: Report = unreported
) -> list[PoseChange]:
    """Assess the stored poses of people; return their rows with errors, statuses and reasons. Nothing is stored.

    Keyframes are compared with, but are not changed. Frames on which somebody has no pose are left out.

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
    return [
        row
        for person, own in zip(plan.people, records, strict=True)
        for frame in sorted(tracks)
        if (row := _row(session, store, plan, person, frame, own[frame], tracks[frame][person])) is not None
    ]


def _row(
    session: Session, store: AnnotationStore, plan: AuditPlan, person: int, frame: int, record: PoseRecord,
    tracks: FrameTracks,
) -> PoseChange | None:  # fmt: skip
    """Return the row of a pose with its assessment, and its alternatives as they are; None for a keyframe."""
    if record.keyframe:
        return None
    model, n_limbs = session.people[person].model, tracks.trust.shape[1]
    if plan.takes_consensus:
        found = consensus(model, record.values, tracks.poses, np.vstack([np.ones(n_limbs), tracks.trust]))
        record = replace(record, values=found.pose)
    else:
        found = agreement(model, record.values, tracks.poses, tracks.trust)
    name = session.people[person].name
    alternatives = tuple(store.alternatives(name, frame))
    assessed = assessed_by_tracks(model, record, found, tracks, len(alternatives) > 0)
    return PoseChange(name, frame, assessed, alternatives)


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
