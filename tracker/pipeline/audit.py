"""Audit stored poses, tracked here or imported: compare them with all others that they may be, over all their frames.

A run of the tracker assesses its own poses (`track_session`). This is for poses that are stored already.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tracker.compute.progress import Report, mapped, part_of, result_of, unreported
from tracker.errors import Remedy, TrackerError
from tracker.evidence.observer import Observer
from tracker.geometry.arrays import Array
from tracker.pipeline.assessed_poses import assessed_by_run
from tracker.pipeline.estimated_rows import assessed_keyframe, estimated_row
from tracker.pipeline.tracked_changes import settings_record
from tracker.session.locked_dofs import active_dofs, load_locks
from tracker.session.session import Session
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import Alternative, AssessmentChange, PoseChange, PoseRecord
from tracker.tracking.estimation.settings import EstimationSettings
from tracker.tracking.runs.frame_hypotheses import Proposal
from tracker.tracking.runs.run_estimate import RunFrames, estimate_run
from tracker.tracking.subjects import Subjects


@dataclass(frozen=True)
class AuditPlan:
    """Which stored poses are audited, and how."""

    frames: Sequence[int]
    """That may be audited, ascending."""
    people: tuple[int, ...]
    """Indices of the people."""
    settings: EstimationSettings
    """Of the tracker."""
    replaces: bool = False
    """Whether the estimate takes the place of the poses; else they stay."""


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
        TrackerError: there are fewer than two views, or no two frames in a row on which all have a pose.
    """
    if len(observer.cameras) < 2:
        raise TrackerError("expected two cameras or more to audit poses, found one: nothing shows depth")
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
    rows, n_before, total = list[PoseChange | AssessmentChange](), 0, sum(map(len, stretches))
    for stretch in stretches:
        n_after = n_before + len(stretch)
        rows += _of_stretch(
            session, store, observer, plan, records, stretch, part_of(report, n_before / total, n_after / total)
        )
        n_before = n_after
    return rows


def _of_stretch(
    session: Session, store: AnnotationStore, observer: Observer, plan: AuditPlan,
    records: Sequence[Mapping[int, PoseRecord]], stretch: Sequence[int], report: Report,
) -> Iterator[PoseChange | AssessmentChange]:  # fmt: skip
    """Yield the rows of frames that follow one another."""
    steps = estimate_run(_run_of(session, store, observer, plan, records, stretch))
    found = result_of(mapped(steps, lambda step: report("comparing poses", step.done / step.total)))
    settings = settings_record(plan.settings)
    for i, own in zip(plan.people, records, strict=True):
        name, model = session.people[i].name, session.people[i].model
        for k, pose in found[i].items():
            if own[k].keyframe:
                yield assessed_keyframe(model, name, k, own[k].values, pose)
                continue
            row = estimated_row(model, own[k], pose, own[k].model_revision, settings)
            if not plan.replaces:
                row = assessed_by_run(model, own[k], pose)
            yield PoseChange(name, k, row, tuple(Alternative(h.pose, row.model_revision) for h in pose.others))


def _run_of(
    session: Session, store: AnnotationStore, observer: Observer, plan: AuditPlan,
    records: Sequence[Mapping[int, PoseRecord]], stretch: Sequence[int],
) -> RunFrames:  # fmt: skip
    """Return what is known of the frames of a stretch."""
    models, held = [p.model for p in session.people], _others(session, store, plan.people, stretch)
    poses = {k: _poses(session, plan.people, records, k, held.get(k, {})) for k in stretch}
    proposals = dict[tuple[int, int], list[Proposal]]()
    for i, own in zip(plan.people, records, strict=True):
        for k in stretch:
            others = store.alternatives(session.people[i].name, k)
            fitting = [a.values for a in others if len(a.values) == len(own[k].values)]
            proposals[k, i] = [Proposal(pose, "alternative") for pose in fitting]
            if plan.replaces and own[k].keyframe:
                held.setdefault(k, {})[i] = own[k].values
    locks = load_locks(session.people, store.setting)
    active = [active_dofs(m, locked) for m, locked in zip(models, locks, strict=True)]
    subjects = Subjects.of(models, plan.people, active, held)
    around = _around(session, store, stretch) if plan.replaces else {}
    return RunFrames(observer, subjects, plan.settings, session.fps, poses, proposals, around, not plan.replaces)


def _around(session: Session, store: AnnotationStore, stretch: Sequence[int]) -> dict[int, list[Array]]:
    """Return the stored poses of all people on the two frames before a stretch and after it, as far as all have one."""
    step, out = stretch[1] - stretch[0], dict[int, list[Array]]()
    for first, way in ((stretch[0], -step), (stretch[-1], step)):
        for k in (first + way, first + 2 * way):
            found = [store.pose(p.name, k) for p in session.people]
            poses = [r.values for r in found if r is not None]
            if [len(v) for v in poses] != [len(p.model.value_names) for p in session.people]:
                break
            out[k] = poses
    return out


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
