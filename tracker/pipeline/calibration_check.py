"""Judge the cameras of a session by the contours of its stored poses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tracker.calibration.check.diagnosis import CameraFinding, Diagnosis, diagnose, findings, glance, sentence
from tracker.calibration.check.fault_search import prior_sigmas
from tracker.calibration.check.judged_frames import JudgedFrame
from tracker.calibration.check.lens_priors import NEWS
from tracker.calibration.check.residual_pieces import ResidualPieces, residual_pieces
from tracker.calibration.check.single_frames import FrameScore, find_change, score_frame
from tracker.compute.progress import Report, part_of, unreported
from tracker.errors import Remedy, TrackerError
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.estimation.fitting.hypothesis import SAME_POSE_M
from tracker.footage.camera_source import LostFrames
from tracker.geometry.arrays import Array
from tracker.geometry.camera_correction import KINDS, N_CORRECTIONS, TIME
from tracker.pipeline.posed_recording import MIN_FRAMES, N_FRAMES, PosedRecording


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
    middle_s: float = 0.0
    """Time to which offsets and drifts of clocks are related, see `PosedRecording.middle_s`."""
    notes: tuple[str, ...] = ()
    """Sentences on what these frames cannot show."""
    residuals: tuple[ResidualPieces, ...] = ()
    """Of each camera as it is, on the frames that were used; empty after a glance."""
    lost: Mapping[str, LostFrames] = field(default_factory=dict)
    """Of cameras whose clock has been off since a frame within the recording: the frames that they lost before it."""

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the cameras that are off, the worst first."""
        return tuple(c.name for c in sorted(self.cameras, key=lambda c: -c.gain_nats) if c.kinds)

    @property
    def corrections(self) -> Array:
        """That mend the named cameras, (V, N_CORRECTIONS); 0 for the others."""
        return np.array([c.correction for c in self.cameras])

    @property
    def contradictions(self) -> list[str]:
        """Sentences on cameras that are off, the worst first; none where nothing is off."""
        if len(self.cameras) == 2:
            worst = max(self.cameras, key=lambda c: c.misfit_px)
            apart = f"the two cameras contradict each other by {worst.misfit_px:.1f} px; nothing shows which is off"
            return [apart] if self.diagnosis.kept else []
        by_name = {c.name: c for c in self.cameras}
        return [sentence(by_name[name], self.since.get(name), self.lost.get(name)) for name in self.named]

    @property
    def sentences(self) -> list[str]:
        """Sentences for the user: on what these frames cannot show, and on cameras that are off."""
        return [*self.notes, *self.contradictions]

    def n_lost(self, name: str) -> int:
        """Return the number of frames that a camera lost within the recording; negative where it doubled some."""
        lost = self.lost.get(name)
        return 0 if lost is None else lost.n

    def corrections_on(self, frame: int) -> Array:
        """Return the corrections of a frame, (V, N_CORRECTIONS); 0 for cameras that have been off since a later one."""
        is_off = [frame >= self.since.get(c.name, 0) for c in self.cameras]
        return self.corrections * np.array(is_off)[:, None]

    def require_applicable(self, scores: Sequence[tuple[FrameScore, FrameScore]]) -> None:
        """Check that frames which the check did not use confirm its corrections.

        Args:
            scores: of `held_out_scores`.

        Raises:
            TrackerError: there are no such frames, together they fit worse, or a camera moved within the recording.
        """
        for name, k in {k: v for k, v in self.since.items() if k not in self.lost}.items():
            raise TrackerError(
                f"expected a camera that is off on all frames, found that {name} moved before frame {k}; make a "
                f"session of the frames from {k} on and correct it there, or leave {name} out"
            )
        if not scores:
            raise TrackerError(
                "expected other frames with poses to confirm the correction, found none; track more frames, or use "
                "fewer for the check"
            )
        fall_nats = sum(before.cost - after.cost for before, after in scores)
        if fall_nats <= 0:
            raise TrackerError(
                "expected frames that the check did not use to fit better with the corrected cameras, found "
                f"{n_better(scores)} of {len(scores)}, and together worse by {-fall_nats:.1f} nats; the calibration "
                "stays as it is"
            )


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
    if len(usable) < MIN_FRAMES:
        raise TrackerError(
            f"expected at least {MIN_FRAMES} frames with poses that are not lost, and with poses on the two frames "
            f"before and after, found {len(usable)}; track the recording first",
            Remedy("place_body"),
        )
    reading, checking, again = (part_of(report, k / 3, (k + 1) / 3) for k in range(3))
    seen = recording.seen(recording.diverse(usable, max(n, MIN_FRAMES)), reading)
    check = _checked(recording, seen, checking)
    changes = _Changes(recording, usable, check, seen)
    since = {name: k for name in check.named if (k := changes.first(name)) is not None}
    after = [f for f in seen if f.frame >= max(since.values(), default=0)]
    if since and len(after) >= MIN_FRAMES:  # The frames before would dilute the correction.
        check = _checked(recording, after, again)
    since = {k: v for k, v in since.items() if k in check.named}
    return _with_lost_frames(replace(check, since=since), recording.fps)


def contradiction(recording: PosedRecording) -> str:
    """Return a sentence on the camera that is off most, as a glance at few frames shows it; else "".

    It has no figure, which is for `check_calibration`. A frame of the glance costs a quarter of tracking it, so that a
    tenth of the frames are taken.

    Args:
        recording: nothing is said unless `N_FRAMES` frames have credible poses.
    """
    usable = recording.credible_frames()
    if len(usable) < N_FRAMES or len(recording.camera_names) < 2:
        return ""
    n = int(np.clip(len(usable) // 10, MIN_FRAMES, N_FRAMES))
    seen = recording.seen(recording.diverse(usable, n))
    glanced = glance(seen, [SizeParameters(b.model) for b in seen[0].bodies], recording.fps)
    judged = _judged(recording, seen, glanced)
    return "; ".join(f"{words.partition(': ')[0]} or the body has other sizes" for words in judged.contradictions)


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
    state, nothing, out = check.diagnosis.state, np.zeros_like(check.corrections), []
    chosen = recording.diverse(others, n)
    for i, seen in enumerate(recording.seen(chosen, part_of(report, 0.0, 0.5))):
        report("comparing on other frames", 0.5 + 0.5 * i / len(chosen))
        parameters = [SizeParameters(b.model) for b in seen.bodies]
        before, after = (score_frame(seen, parameters, state.sizes, c) for c in (nothing, check.corrections))
        out.append((before, after))
    return out


def _checked(recording: PosedRecording, seen: Sequence[JudgedFrame], report: Report) -> CalibrationCheck:
    sizes = [SizeParameters(b.model) for b in seen[0].bodies]
    diagnosis = diagnose(seen, sizes, recording.fps, report)
    return replace(_judged(recording, seen, diagnosis), residuals=residual_pieces(seen, sizes, diagnosis.state))


def _judged(recording: PosedRecording, seen: Sequence[JudgedFrame], diagnosis: Diagnosis) -> CalibrationCheck:
    cameras = findings(diagnosis, seen, recording.camera_names)
    if len(cameras) == 2:
        cameras = [c._replace(kinds=(), correction=np.zeros(N_CORRECTIONS)) for c in cameras]
    notes = [f"camera {c.name} shows nobody on these frames" for c in cameras if not c.is_seen]
    first, *others = [np.concatenate([b.points_world for b in s.bodies]) for s in seen]
    if all(np.linalg.norm(points - first, axis=1).max() < SAME_POSE_M for points in others):
        notes.append("people stand still on these frames: a wrong shape of a body looks like a camera that is off")
    late = prior_sigmas(recording.fps)[TIME]
    if all(c.sigma[TIME] > NEWS * late for c in cameras):
        notes.append("nobody moves enough on these frames to show whether the cameras are simultaneous")
    return CalibrationCheck(
        tuple(s.frame for s in seen), tuple(cameras), {}, diagnosis, recording.middle_s, tuple(notes)
    )


def _with_lost_frames(check: CalibrationCheck, fps: float) -> CalibrationCheck:
    """Take clocks that have changed within the recording for lost frames: they change by whole frames alone."""
    cameras, lost = [], {}
    for camera in check.cameras:
        n = round(camera.correction[TIME] * fps)
        if n and camera.name in check.since and camera.kinds == ("time",):
            lost[camera.name] = LostFrames(check.since[camera.name], n)
            camera = camera._replace(correction=camera.correction.copy())
            camera.correction[TIME] = n / fps
        cameras.append(camera)
    return replace(check, cameras=tuple(cameras), lost=lost)


class _Changes:
    """Finds since when cameras are off, by more and more frames around the change."""

    def __init__(
        self, recording: PosedRecording, usable: Sequence[int], check: CalibrationCheck, seen: Sequence[JudgedFrame]
    ) -> None:
        self._recording, self._usable, self._check = recording, usable, check
        self._seen = {f.frame: f for f in seen}
        self._sigmas = prior_sigmas(recording.fps)

    def first(self, name: str) -> int | None:
        """Return the frame since when a camera is off; None if on all frames, or if too few confirm a change."""
        index = [c.name for c in self._check.cameras].index(name)
        columns = np.concatenate([np.arange(N_CORRECTIONS)[KINDS[k]] for k in self._check.cameras[index].kinds])
        corrections, without = self._check.corrections, self._check.corrections
        without[index] = 0.0
        scores = dict[int, tuple[FrameScore, FrameScore]]()
        while True:
            for k, seen in self._seen.items():
                if k not in scores:
                    parameters = [SizeParameters(b.model) for b in seen.bodies]
                    state = self._check.diagnosis.state
                    before, after = (score_frame(seen, parameters, state.sizes, c) for c in (without, corrections))
                    scores[k] = before, after
            ordered = [scores[k] for k in sorted(scores)]
            change = find_change(ordered, index, columns, corrections[index], self._sigmas)
            if change.first == 0:
                return None
            last, first = ordered[change.first - 1][0].frame, ordered[change.first][0].frame
            between = [k for k in self._usable if last < k < first]
            if not between and not change.is_confirmed:
                is_early = change.first < len(ordered) / 2
                between = [k for k in self._usable if k not in scores and (k < first) == is_early]
            if not between:
                return first if change.is_confirmed else None
            more = sorted({between[i] for i in np.linspace(0, len(between) - 1, 5).round().astype(int)})
            self._seen.update({f.frame: f for f in self._recording.seen(more)})
