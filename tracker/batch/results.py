"""The morning after a batch: a row for each recording, the one that needs a person most first."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.api.results import PoseSeries, read_poses
from tracker.batch.manifest import Manifest, State
from tracker.batch.plan import Settings
from tracker.batch.stretches import SeamRow
from tracker.batch.task_files import RecordingTask, Result
from tracker.errors import SessionError, TrackerError
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.geometry.arrays import Array, IntArray
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore


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
    """The frames at which these were joined, the largest seam first."""
    result: Result | None = None
    """How the task ended; None while it has not."""
    is_earlier: bool = False
    """Whether it was done with other settings than those of the plan."""

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
    people = _people(Path(recording.session), recording.settings)
    known = np.concatenate([p.errors_mm[np.isfinite(p.errors_mm)] for p in people]) if people else np.zeros(0)
    worst_frame, worst_person = _to_look_at(people)
    return RecordingRow(
        recording.name,
        recording.session,
        "done",
        float(known.mean()) if len(known) else None,
        sum(len(p.frames) for p in people),
        int(sum(p.doubted.sum() for p in people)),
        sum(_n_verified(Path(recording.session), p.person) for p in people),
        worst_frame,
        worst_person,
        result.seconds,
        result.cpu_seconds,
        result.contradiction,
        result.n_stretches,
        tuple(sorted(result.seams, key=lambda seam: -seam.apart_mm)),
        result,
        result.settings not in (None, recording.settings),
    )


class _Assessed(NamedTuple):
    """Status and expected errors of the poses of a person."""

    person: str
    frames: IntArray
    """Frames with a pose, (F,)."""
    errors_mm: Array
    """Expected error of each, (F,), mm: the mean over limb joints; NaN where not known."""
    doubted: NDArray[np.bool_]
    """Whether it is doubtful or lost, and no keyframe, (F,)."""
    keyframes: NDArray[np.bool_]
    """Whether a person set or verified it, (F,)."""


def _people(folder: Path, settings: Settings) -> list[_Assessed]:
    """Return what is known about the people who have poses; nothing where the session is gone.

    Long recordings are read in blocks, so that the memory that it takes does not grow with them.
    """
    people = list[_Assessed]()
    try:
        session = load_session(folder)
        step = settings.stretch_frames or session.n_frames
        blocks = [range(a, min(a + step, session.n_frames)) for a in range(0, session.n_frames, step)]
        for person in settings.people or [p.name for p in session.people]:
            parts = list[_Assessed]()
            for block in blocks:
                with suppress(SessionError):  # no pose
                    parts.append(_assessed(read_poses(session, person, block)))
            if parts:
                people.append(_Assessed(parts[0].person, *map(np.concatenate, list(zip(*parts, strict=True))[1:])))
    except TrackerError:
        return []
    return people


def _assessed(poses: PoseSeries) -> _Assessed:
    joints = [poses.errors_m(name) for name in poses.names if name in LIMB_JOINTS]
    errors_mm = 1000 * np.mean(joints, axis=0) if joints else np.full(len(poses), np.nan)
    doubted = np.isin(poses.statuses, ("doubtful", "lost")) & ~poses.keyframes
    return _Assessed(poses.person, poses.frames, errors_mm, doubted, poses.keyframes)


def _to_look_at(people: Sequence[_Assessed]) -> tuple[int | None, str]:
    """Return the frame and the person to look at first: doubted ones before others, then the largest error.

    Keyframes are left out unless there is nothing else: a person has seen them.
    """
    ranked = [
        (not seen, bool(doubted), float(np.nan_to_num(error)), -int(frame), person)
        for person, *columns in people
        for frame, error, doubted, seen in zip(*columns, strict=True)
    ]
    if not ranked:
        return None, ""
    *_, frame, person = max(ranked)
    return -frame, person


def _n_verified(folder: Path, person: str) -> int:
    session = load_session(folder)
    with AnnotationStore(session.annotations_path, read_only=True) as store:
        return sum(row.keyframe or row.reviewed for row in store.frames(person))
