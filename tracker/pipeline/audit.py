"""Audit stored poses, tracked here or imported: compare them with all others that they may be, over all their frames.

A run of the tracker assesses its own poses (`track_session`). This is for poses that are stored already.
"""

from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tracker.compute.progress import mapped
from tracker.errors import Remedy, TrackerError
from tracker.estimation.by_frame.settings import EstimationSettings
from tracker.estimation.fitting.retarget import retarget_pose
from tracker.estimation.runs.frame_hypotheses import Proposal
from tracker.estimation.runs.path_assessment import RunPose
from tracker.estimation.runs.run_estimate import Progress, RunFrames, estimate_run, poses_beside
from tracker.estimation.tracking.tracker import Subjects
from tracker.evidence.observer import Observer
from tracker.formats.model_toml import format_model
from tracker.geometry.arrays import Array
from tracker.pipeline.tracked_changes import (
    assessed_by_run,
    assessed_keyframe,
    estimated_row,
    pose_change,
    settings_record,
)
from tracker.session.locked_dofs import active_dofs, load_locks
from tracker.session.session import Session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import AssessmentChange, PoseChange, PoseRecord
from tracker.session.store.stored_poses import read_stored_poses


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


class _Known(NamedTuple):
    """A stored pose."""

    record: PoseRecord
    pose: Array
    """In the present body, (n_values,)."""


class PoseAudit:
    """The audit of the poses that some people have on some frames."""

    def __init__(self, session: Session, store: AnnotationStore, observer: Observer, plan: AuditPlan) -> None:
        """Read the poses. Frames on which somebody has none are left out.

        Args:
            session: the session.
            store: its annotations.
            observer: of its recording.
            plan: what to audit.

        Raises:
            TrackerError: there are fewer than two views, or no two frames in a row on which all have a pose.
        """
        if len(observer.cameras) < 2:
            raise TrackerError(
                "expected two cameras or more to compare poses, found one, which shows no depth; take another camera"
            )
        self._session, self._store, self._observer, self._plan = session, store, observer, plan
        frames = range(plan.frames[0], plan.frames[-1] + 1)
        self._known = [self._read(i, frames) for i in range(len(session.people))]
        posed = [k for k in plan.frames if all(k in self._known[i] for i in plan.people)]
        self._stretches = [found for found in _stretches(posed) if len(found) > 1]
        if not self._stretches:
            raise TrackerError(
                "expected two frames in a row on which all these people have a pose, found none; track or import "
                "poses first",
                Remedy("place_body"),
            )

    @property
    def records(self) -> dict[tuple[int, int], PoseRecord]:
        """The stored poses that are audited, by index of the person and frame."""
        frames = [k for stretch in self._stretches for k in stretch]
        return {(i, k): self._known[i][k].record for i in self._plan.people for k in frames}

    def steps(self) -> Generator[float, None, list[PoseChange | AssessmentChange]]:
        """Do the work, and yield the share that is done, 0 to 1; a caller that stops asking leaves it undone.

        Returns:
            Rows of the poses with errors, statuses and reasons. Nothing is stored. Keyframes are only assessed.
        """
        rows, n_before, total = list[PoseChange | AssessmentChange](), 0, sum(map(len, self._stretches))
        for stretch in self._stretches:

            def share(step: Progress, first: int = n_before, n: int = len(stretch)) -> float:
                return (first + n * step.done / step.total) / total

            rows += self._rows((yield from mapped(estimate_run(self._run_of(stretch)), share)))
            n_before += len(stretch)
        return rows

    def _read(self, person: int, frames: range) -> dict[int, _Known]:
        """Return the stored poses of a person by frame, without those of a body with other values."""
        session, who = self._session, self._session.people[person]
        stored = read_stored_poses(session.annotations_path, who.name, who.model, frames)
        return {
            k: _Known(own.record, retarget_pose(own.body.values, own.body.model, who.model))
            for k, own in stored.items()
            if own.body.model.value_names == who.model.value_names
        }

    def _rows(self, found: Mapping[int, Mapping[int, RunPose]]) -> Iterator[PoseChange | AssessmentChange]:
        """Yield the rows of estimated poses by person and frame."""
        settings = settings_record(self._plan.settings)
        for i, of_person in found.items():
            name, model = self._session.people[i].name, self._session.people[i].model
            revision = self._store.add_model_revision(name, format_model(model))
            for k, pose in of_person.items():
                record = self._known[i][k].record
                if record.keyframe:
                    yield assessed_keyframe(model, name, k, record.values, pose)
                    continue
                row = assessed_by_run(model, record, pose)
                if self._plan.replaces:
                    before = None if "interpolated" in record.sources else replace(record, reviewed=False)
                    row = estimated_row(model, before, pose, revision, settings)
                yield pose_change(name, k, row, pose, revision)

    def _run_of(self, stretch: Sequence[int]) -> RunFrames:
        """Return what is known of the frames of a stretch."""
        plan, session = self._plan, self._session
        models, n_people = [p.model for p in session.people], range(len(session.people))
        # Other people stay where they are stored, and so do keyframes before estimates.
        held = {
            k: {
                i: own[k].pose for i, own in enumerate(self._known)
                if k in own and (i not in plan.people or (plan.replaces and own[k].record.keyframe))
            }
            for k in stretch
        }  # fmt: skip
        poses = {
            k: [self._known[i][k].pose if k in self._known[i] else models[i].neutral() for i in n_people]
            for k in stretch
        }
        proposals = {(k, i): self._proposals(i, k) for i in plan.people for k in stretch}
        locks = load_locks(session.people, self._store.setting)
        active = [active_dofs(m, locked) for m, locked in zip(models, locks, strict=True)]
        subjects = Subjects.of(models, plan.people, active, {k: own for k, own in held.items() if own})
        around = self._around(stretch) if plan.replaces else {}
        return RunFrames(
            self._observer, subjects, plan.settings, session.fps, poses, proposals, around, not plan.replaces
        )

    def _proposals(self, person: int, frame: int) -> list[Proposal]:
        others = self._store.alternatives(self._session.people[person].name, frame)
        n_values = len(self._known[person][frame].pose)
        return [Proposal(a.values, "alternative") for a in others if len(a.values) == n_values]

    def _around(self, stretch: Sequence[int]) -> dict[int, list[Array]]:
        """Return the poses of all people on the two frames before a stretch and after it, as far as all have one."""
        step, people = stretch[1] - stretch[0], range(len(self._session.people))

        def poses_on(k: int) -> list[Array | None]:
            stored = [self._read(i, range(k, k + 1)) for i in people]
            return [own[k].pose if own else None for own in stored]

        return poses_beside(stretch[0], -step, poses_on) | poses_beside(stretch[-1], step, poses_on)


def _stretches(frames: Sequence[int]) -> list[list[int]]:
    """Return frames in groups that follow one another at their usual distance or nearer."""
    step = int(np.median(np.diff(frames))) if len(frames) > 1 else 1
    out: list[list[int]] = []
    for k in frames:
        if out and k - out[-1][-1] <= step:
            out[-1].append(k)
        else:
            out.append([k])
    return out
