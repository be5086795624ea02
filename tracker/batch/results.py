"""The morning after a batch: a row for each recording, the one that needs a person most first."""

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tracker.api.pose_series import PoseSeries
from tracker.api.results import read_poses
from tracker.batch.manifest import Manifest, RecordingTask, Result, State
from tracker.batch.stretches import SeamRow
from tracker.errors import SessionError, TrackerError
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.session.session import load_session
from tracker.store.annotation_store import AnnotationStore


@dataclass(frozen=True)
class RecordingRow:
    """A recording of a batch."""

    name: str
    session: str
    """Path of its session folder."""
    state: State
    expected_error_mm: float | None = None
    """Mean over people, frames and limb joints of the stored root mean square error; None where none is stored."""
    n_poses: int = 0
    """Number of stored poses."""
    n_doubted: int = 0
    """Number of them that are doubtful or lost, and that nobody has verified."""
    n_verified: int = 0
    """Number of them that a person set, verified or reviewed."""
    worst_frame: int | None = None
    """The frame to look at first: the doubted one with the largest expected error."""
    worst_person: str = ""
    seconds: float = 0.0
    cpu_seconds: float = 0.0
    contradiction: str = ""
    """A sentence on a camera that seems off; empty without one."""
    n_stretches: int = 1
    """Number of stretches in which it was tracked."""
    seams: tuple[SeamRow, ...] = ()
    """Where these were joined, the largest seam first."""
    result: Result | None = None
    """How the task ended; None while it has not."""

    @property
    def share_doubted(self) -> float:
        """Share of the poses that are doubted, 0 to 1."""
        return self.n_doubted / max(1, self.n_poses)


@dataclass(frozen=True)
class Totals:
    """Sums over a batch."""

    counts: dict[State, int]
    """Number of tasks by state."""
    hours: float
    """Of all workers together, by the clock."""
    cpu_hours: float
    n_poses: int
    n_verified: int

    @property
    def share_verified(self) -> float:
        """Share of the poses that a person has verified, 0 to 1."""
        return self.n_verified / max(1, self.n_poses)


def summarize(manifest: Manifest) -> list[RecordingRow]:
    """Return a row for each recording: failures first, then by expected error, by doubts, and by name."""
    rows = [_row(manifest, task) for task in manifest.tasks]
    return sorted(rows, key=lambda r: (r.state != "failed", -(r.expected_error_mm or 0.0), -r.share_doubted, r.name))


def totals(manifest: Manifest, rows: Sequence[RecordingRow]) -> Totals:
    """Return the sums of a batch."""
    return Totals(
        dict(manifest.counts()),
        sum(r.seconds for r in rows) / 3600,
        sum(r.cpu_seconds for r in rows) / 3600,
        sum(r.n_poses for r in rows),
        sum(r.n_verified for r in rows),
    )


def _row(manifest: Manifest, task: RecordingTask) -> RecordingRow:
    result, recording = manifest.result(task), task.recording
    row = RecordingRow(recording.name, recording.session, manifest.state(task), result=result)
    if result is None or result.state == "failed":
        return row
    people = _people(Path(recording.session), recording.settings.people)
    errors_mm = [_errors_mm(p) for p in people]
    known = np.concatenate([e[np.isfinite(e)] for e in errors_mm]) if people else np.zeros(0)
    doubted = [np.isin(p.statuses, ("doubtful", "lost")) & ~p.keyframes for p in people]
    worst_frame, worst_person = _worst(people, errors_mm, doubted)
    return RecordingRow(
        recording.name,
        recording.session,
        "done",
        float(known.mean()) if len(known) else None,
        sum(map(len, people)),
        int(sum(d.sum() for d in doubted)),
        sum(_n_verified(Path(recording.session), p.person) for p in people),
        worst_frame,
        worst_person,
        result.seconds,
        result.cpu_seconds,
        result.contradiction,
        result.n_stretches,
        tuple(sorted(result.seams, key=lambda seam: -seam.apart_mm)),
        result,
    )


def _people(folder: Path, names: Sequence[str] | None) -> list[PoseSeries]:
    """Return the poses of the people who have some; none where the session is gone."""
    found = list[PoseSeries]()
    try:
        session = load_session(folder)
        for person in names or [p.name for p in session.people]:
            try:
                found.append(read_poses(session, person))
            except SessionError:  # no pose
                continue
    except TrackerError:
        return []
    return found


def _errors_mm(poses: PoseSeries) -> np.ndarray:
    """Return the expected error of each frame, (F,), mm: the mean over limb joints; NaN where not known."""
    joints = [poses.errors_m(name) for name in poses.names if name in LIMB_JOINTS]
    return 1000 * np.mean(joints, axis=0) if joints else np.full(len(poses), np.nan)


def _worst(
    people: Sequence[PoseSeries], errors_mm: Sequence[np.ndarray], doubted: Sequence[np.ndarray]
) -> tuple[int | None, str]:
    """Return the frame and the person to look at first: doubted ones before others, then the largest error.

    Keyframes are left out unless there is nothing else: a person has seen them.
    """
    found = [
        (not seen, bool(d), float(np.nan_to_num(e)), -int(frame), poses.person)
        for poses, errors, doubts in zip(people, errors_mm, doubted, strict=True)
        for frame, e, d, seen in zip(poses.frames, errors, doubts, poses.keyframes, strict=True)
    ]
    if not found:
        return None, ""
    *_, frame, person = max(found)
    return -frame, person


def _n_verified(folder: Path, person: str) -> int:
    session = load_session(folder)
    with closing(AnnotationStore(session.annotations_path, read_only=True)) as store:
        return sum(row.keyframe or row.reviewed for row in store.frames(person))
