"""Frames with known poses of people, and what the views show there: the evidence from which cameras are judged."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.body.motion.pose_path import PosePath
from tracker.calibration.check.judged_frames import JudgedFrame
from tracker.compute.progress import Report, unreported
from tracker.compute.sampling import farthest_first, spread_indices
from tracker.errors import TrackerError
from tracker.estimation.acquisition.from_contours import learn_static_edges
from tracker.estimation.fitting.hypothesis import SAME_POSE_M
from tracker.estimation.fitting.retarget import retarget_pose
from tracker.estimation.tracking.tracker import TrackedFrame
from tracker.estimation.tracking.view_regions import regions
from tracker.evidence.images.edges import StaticEdgeModel
from tracker.evidence.observer import Observer
from tracker.session.session import Session
from tracker.session.store.stored_poses import read_stored_poses

N_FRAMES = 20
"""Frames of diverse poses that a check uses: with 3 the camera is found, with 20 its correction is known to 0.02
degrees (docs/log/calibration.md)."""
MIN_FRAMES = 3
"""Fewest frames that a check uses."""


@dataclass(frozen=True, eq=False)
class PosedRecording:
    """A recording with poses of its people."""

    observer: Observer
    """Gives the evidence of its cameras."""
    fps: float
    """Frames per second."""
    poses: Sequence[Mapping[int, PosedBody]]
    """Of each person, by frame."""
    lost: Collection[int] = ()
    """Frames on which somebody may be elsewhere."""

    @classmethod
    def of_session(cls, session: Session, observer: Observer) -> "PosedRecording":
        """Read the poses of everybody who has some.

        Raises:
            TrackerError: there is a single camera.
        """
        if len(session.cameras) < 2:
            raise TrackerError(
                f"expected at least 2 cameras to compare, found {len(session.cameras)}; contours of one agree with any "
                "calibration"
            )
        stored = [read_stored_poses(session.annotations_path, p.name, p.model) for p in session.people]
        lost = {k for own in stored for k, pose in own.items() if pose.record.status == "lost"}
        poses = [{k: pose.body for k, pose in own.items()} for own in stored if own]
        return cls(observer, session.fps, poses, lost)

    @classmethod
    def of_run(
        cls, observer: Observer, fps: float, models: Sequence[BodyModel], tracked: Mapping[int, TrackedFrame]
    ) -> "PosedRecording":
        """Take the poses of a finished run. Doubtful ones count, because a camera that is off makes many doubtful."""
        poses = [{k: PosedBody(m, f.poses[i]) for k, f in tracked.items()} for i, m in enumerate(models)]
        return cls(observer, fps, poses, {k for k, f in tracked.items() if "lost" in f.statuses})

    def with_bodies(self, bodies: Mapping[BodyModel, BodyModel]) -> "PosedRecording":
        """Return the recording with other bodies in place of some, their joints in the places of before."""

        def moved(own: PosedBody) -> PosedBody:
            body = bodies.get(own.model)
            return own if body is None else PosedBody(body, retarget_pose(own.values, own.model, body), own.velocity)

        return replace(self, poses=[{k: moved(b) for k, b in own.items()} for own in self.poses])

    @property
    def middle_s(self) -> float:
        """Time of the middle of the frames with poses, seconds since frame 0. Drifts are told about it: about frame 0
        they would look like offsets."""
        frames = [k for own in self.poses for k in own]
        return 0.5 * (min(frames) + max(frames)) / self.fps if frames else 0.0

    @property
    def camera_names(self) -> list[str]:
        """Names of the cameras."""
        return [c.camera.name for c in self.observer.cameras]

    def credible_frames(self, within: Sequence[int] | None = None) -> list[int]:
        """Return the frames on which everybody has a pose that is not lost, and poses in the same body around it."""

        def is_credible(own: Mapping[int, PosedBody], k: int) -> bool:
            around = [own.get(j) for j in range(k - 2, k + 3)]
            return all(a is not None and a.model is own[k].model for a in around)

        posed = set.intersection(*(set(own) for own in self.poses)) if self.poses else set()
        wanted = (posed if within is None else posed & set(within)) - set(self.lost)
        return [k for k in sorted(wanted) if all(is_credible(own, k) for own in self.poses)]

    def diverse(self, frames: Sequence[int], n: int) -> list[int]:
        """Choose frames with poses as different as possible, in order; none of a pose that was chosen before."""
        joints = np.array([np.concatenate([own[k].points_world for own in self.poses]) for k in frames])
        return [frames[i] for i in sorted(farthest_first(joints, n, SAME_POSE_M, MIN_FRAMES))]

    def seen(self, frames: Sequence[int], report: Report = unreported) -> list[JudgedFrame]:
        """Read what the views show on frames."""
        out = []
        for i, k in enumerate(frames):
            report("reading contours", i / len(frames))
            bodies = tuple(own[k] for own in self.poses)
            regions_px = regions(self.observer.working_cameras, bodies)
            views = self.observer.evidence(k, regions_px, None, self._static_edges)
            paths = tuple(self._path(own, k) for own in self.poses)
            ahead_s = tuple(ahead / self.fps for ahead in self.observer.ahead_frames(k))
            out.append(JudgedFrame(k, views, bodies, paths, k / self.fps - self.middle_s, ahead_s))
        return out

    def _path(self, own: Mapping[int, PosedBody], frame: int) -> PosePath:
        """Return the way of a person's pose around a frame, as far as poses in the same body lead."""
        model = own[frame].model
        return PosePath.around(model, {k: b.values for k, b in own.items() if b.model is model}, frame, self.fps)

    @cached_property
    def _static_edges(self) -> list[StaticEdgeModel] | None:
        frames = self.credible_frames()
        few = [frames[i] for i in spread_indices(len(frames), N_FRAMES)]
        return learn_static_edges(self.observer, {k: tuple(own[k] for own in self.poses) for k in few})
