"""Judge the cameras of a session by the contours of its stored poses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tracker.acquisition.from_contours import learn_static_edges
from tracker.acquisition.size_parameters import SizeParameters
from tracker.calibration.camera_correction import KINDS, N_CORRECTIONS
from tracker.calibration.diagnosis import Diagnosis, diagnose, prior_sigmas
from tracker.calibration.findings import CameraFinding, findings, sentence
from tracker.calibration.residual_pieces import ResidualPieces, residual_pieces
from tracker.calibration.single_frames import FrameScore, find_change, score_frame
from tracker.calibration.viewed_frames import ViewedFrame, spread_poses
from tracker.compute.progress import Report, part_of, unreported
from tracker.errors import Remedy, TrackerError
from tracker.evidence.observer import Observer
from tracker.fitting.hypothesis import SAME_POSE_M
from tracker.geometry.arrays import Array
from tracker.images.static_edges import StaticEdgeModel
from tracker.motion.velocity import velocity
from tracker.session.session import Session
from tracker.store.stored_poses import StoredPose, read_stored_poses
from tracker.tracking.view_regions import regions

N_FRAMES = 20
"""Frames of diverse poses that a check uses: with 3 the camera is found, with 20 its correction is known to 0.02
degrees (docs/calibration.md)."""
_FEWEST = 3
"""Fewest frames that a check uses."""


@dataclass(frozen=True)
class CalibrationCheck:
    """Judgement of the contours of a session on its cameras."""

    frames: tuple[int, ...]
    """Frames that were used, ascending."""
    cameras: tuple[CameraFinding, ...]
    """In the order of the session's."""
    since: Mapping[str, int]
    """Of cameras that have been off since a frame within the recording: that frame."""
    diagnosis: Diagnosis
    residuals: tuple[ResidualPieces, ...]
    """Of each camera as it is, on the frames that were used."""

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the cameras that are off, the worst first."""
        return tuple(c.name for c in sorted(self.cameras, key=lambda c: -c.gain_nats) if c.kinds)

    @property
    def corrections(self) -> Array:
        """That mend the named cameras, (V, N_CORRECTIONS); 0 for the others."""
        return np.array([c.correction for c in self.cameras])

    @property
    def sentences(self) -> list[str]:
        """Sentences for the user, the worst camera first; none where nothing is off."""
        if len(self.cameras) == 2:
            worst = max(self.cameras, key=lambda c: c.misfit_px)
            apart = f"the two cameras contradict each other by {worst.misfit_px:.1f} px; nothing shows which is off"
            return [apart] if self.diagnosis.kept else []
        by_name = {c.name: c for c in self.cameras}
        out = [sentence(by_name[name], self.since.get(name)) for name in self.named]
        return out + [f"camera {c.name} shows nobody on these frames" for c in self.cameras if not c.is_seen]

    def require_applicable(self, scores: Sequence[tuple[FrameScore, FrameScore]]) -> None:
        """Check that frames which the check did not use confirm its corrections.

        Args:
            scores: of `held_out_scores`.

        Raises:
            TrackerError: there are no such frames, most of them fit worse, or a camera moved within the recording.
        """
        for name, k in self.since.items():
            raise TrackerError(
                f"expected a camera that is off on all frames, found that {name} is off since frame {k}; make a "
                f"session of the frames from {k} on, and correct it there"
            )
        if not scores:
            raise TrackerError(
                "expected other frames with poses to confirm the correction, found none; track more frames, or use "
                "fewer for the check"
            )
        better = n_better(scores)
        if 2 * better <= len(scores) or sum(b.cost - a.cost for b, a in scores) <= 0:
            raise TrackerError(
                f"expected frames that the check did not use to fit better with the corrected cameras, found {better} "
                f"of {len(scores)}; the calibration stays as it is"
            )


class PosedRecording:
    """The frames of a session with poses, and what the views show there."""

    def __init__(self, session: Session, observer: Observer) -> None:
        """Read the poses of everybody who has some.

        Raises:
            TrackerError: there is a single camera.
        """
        if len(session.cameras) < 2:
            raise TrackerError(
                f"expected at least 2 cameras to compare, found {len(session.cameras)}; contours of one agree with any "
                "calibration"
            )
        self.session, self._observer = session, observer
        stored = [read_stored_poses(session.annotations_path, p.name, p.model) for p in session.people]
        self._stored = [s for s in stored if s]

    def credible_frames(self, within: Sequence[int] | None = None) -> list[int]:
        """Return the frames on which everybody has a pose that is not lost, and poses in the same body around it."""

        def is_credible(own: Mapping[int, StoredPose], k: int) -> bool:
            around = [own.get(j) for j in range(k - 2, k + 3)]
            same = all(a is not None and a.body.model is own[k].body.model for a in around)
            return same and own[k].record.status != "lost"

        posed = set.intersection(*(set(s) for s in self._stored)) if self._stored else set()
        wanted = posed if within is None else posed & set(within)
        return [k for k in sorted(wanted) if all(is_credible(own, k) for own in self._stored)]

    def diverse(self, frames: Sequence[int], n: int) -> list[int]:
        """Choose frames with poses as different as possible, in order; none of a pose that was chosen before."""
        joints = np.array([np.concatenate([s[k].body.points_world for s in self._stored]) for k in frames])
        return [frames[i] for i in spread_poses(joints, n, SAME_POSE_M, _FEWEST)]

    def seen(self, frames: Sequence[int], report: Report = unreported) -> list[ViewedFrame]:
        """Read what the views show on frames."""
        out = []
        for i, k in enumerate(frames):
            report("reading contours", i / len(frames))
            bodies = tuple(s[k].body for s in self._stored)
            regions_px = regions(self._observer.working_cameras, bodies)
            views = self._observer.evidence(k, regions_px, None, self._static_edges)
            velocities = tuple(self._velocity(own, k) for own in self._stored)
            ahead_s = tuple(ahead / self.session.fps for ahead in self._observer.ahead_frames(k))
            out.append(ViewedFrame(k, views, bodies, velocities, ahead_s))
        return out

    def _velocity(self, own: Mapping[int, StoredPose], frame: int) -> Array:
        """Return the change of a person's pose on a credible frame, (n_dofs,), per second."""
        around = {k: own[k].body.values for k in range(frame - 2, frame + 3)}
        per_frame = velocity(own[frame].body.model, around, frame)
        assert per_frame is not None
        return self.session.fps * per_frame

    @cached_property
    def _static_edges(self) -> list[StaticEdgeModel] | None:
        frames = self.credible_frames()
        few = [frames[i] for i in np.unique(np.linspace(0, len(frames) - 1, N_FRAMES).round().astype(int))]
        return learn_static_edges(self._observer, {k: tuple(s[k].body for s in self._stored) for k in few})


def check_calibration(
    recording: PosedRecording, frames: Sequence[int] | None = None, n: int = N_FRAMES, report: Report = unreported
) -> CalibrationCheck:
    """Judge the cameras of a session.

    Args:
        recording: its poses and footage.
        frames: that may be used; all by default.
        n: largest number of frames that are used.
        report: shows progress. An exception that it raises ends the check.

    Raises:
        TrackerError: fewer than three frames have credible poses.
    """
    usable = recording.credible_frames(frames)
    if len(usable) < _FEWEST:
        raise TrackerError(
            f"expected at least {_FEWEST} frames with poses that are not lost, and with poses on the two frames before "
            f"and after, found {len(usable)}; track the recording first",
            Remedy("place_body"),
        )
    seen = recording.seen(recording.diverse(usable, max(n, _FEWEST)), part_of(report, 0.0, 0.3))
    check = _checked(recording, seen, part_of(report, 0.3, 0.8))
    changes = _Changes(recording, usable, check, seen)
    since = {name: k for name in check.named if (k := changes.first(name)) is not None}
    after = [f for f in seen if f.frame >= max(since.values(), default=0)]
    if since and len(after) >= _FEWEST:  # The frames before would dilute the correction.
        check = _checked(recording, after, part_of(report, 0.8, 1.0))
    return replace(check, since={k: v for k, v in since.items() if k in check.named})


def n_better(scores: Sequence[tuple[FrameScore, FrameScore]]) -> int:
    """Return the number of frames that fit better with the corrected cameras; see `held_out_scores`."""
    return sum(after.cost < before.cost for before, after in scores)


def held_out_scores(
    recording: PosedRecording, check: CalibrationCheck, n: int = N_FRAMES, report: Report = unreported
) -> list[tuple[FrameScore, FrameScore]]:
    """Score frames that the check did not use, with the present cameras and with the corrected ones."""
    since = max(check.since.values(), default=0)
    others = [k for k in recording.credible_frames() if k not in check.frames and k >= since]
    if not others:
        return []
    sigmas, state = prior_sigmas(recording.session.fps), check.diagnosis.state
    nothing, out = np.zeros_like(check.corrections), []
    chosen = recording.diverse(others, n)
    for i, seen in enumerate(recording.seen(chosen, part_of(report, 0.0, 0.5))):
        report("comparing on other frames", 0.5 + 0.5 * i / len(chosen))
        parameters = [SizeParameters(b.model) for b in seen.bodies]
        before, after = (score_frame(seen, parameters, state.sizes, c, sigmas) for c in (nothing, check.corrections))
        out.append((before, after))
    return out


def _checked(recording: PosedRecording, seen: Sequence[ViewedFrame], report: Report) -> CalibrationCheck:
    session = recording.session
    diagnosis = diagnose(seen, [SizeParameters(b.model) for b in seen[0].bodies], session.fps, report)
    cameras = findings(diagnosis, seen, [c.camera.name for c in session.cameras])
    if len(cameras) == 2:
        cameras = [c._replace(kinds=(), correction=np.zeros(N_CORRECTIONS)) for c in cameras]
    residuals = residual_pieces(seen, [SizeParameters(b.model) for b in seen[0].bodies], diagnosis.state)
    return CalibrationCheck(tuple(s.frame for s in seen), tuple(cameras), {}, diagnosis, residuals)


class _Changes:
    """Finds since when cameras are off, by more and more frames around the change."""

    def __init__(
        self, recording: PosedRecording, usable: Sequence[int], check: CalibrationCheck, seen: Sequence[ViewedFrame]
    ) -> None:
        self._recording, self._usable, self._check = recording, usable, check
        self._seen = {f.frame: f for f in seen}
        self._sigmas = prior_sigmas(recording.session.fps)

    def first(self, name: str) -> int | None:
        """Return the frame since when a camera is off; None if on all frames."""
        index = [c.name for c in self._check.cameras].index(name)
        columns = np.concatenate([np.arange(N_CORRECTIONS)[KINDS[k]] for k in self._check.cameras[index].kinds])
        others = self._check.corrections
        others[index] = 0.0
        scores = dict[int, FrameScore]()
        while True:
            for k, seen in self._seen.items():
                if k not in scores:
                    parameters = [SizeParameters(b.model) for b in seen.bodies]
                    state = self._check.diagnosis.state
                    scores[k] = score_frame(seen, parameters, state.sizes, others, self._sigmas)
            ordered = [scores[k] for k in sorted(scores)]
            change = find_change(ordered, index, columns, self._sigmas)
            if change.first == 0:
                return None
            before, after = ordered[change.first - 1].frame, ordered[change.first].frame
            between = [k for k in self._usable if before < k < after]
            if not between:
                return after
            more = sorted({between[i] for i in np.linspace(0, len(between) - 1, 5).round().astype(int)})
            self._seen.update({f.frame: f for f in self._recording.seen(more)})
