"""Load what a session stores of a frame, and place people who are not stored."""

from collections.abc import Sequence

from app.state.people import ShownPose
from app.state.state import ShownFrame
from app.storage.saver import Saver
from tracker.body.model import BodyModel
from tracker.body.motion.pose_steps import velocity
from tracker.estimation.posing.default_pose import default_pose
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import floor_plane, up_rotation
from tracker.geometry.triangulation import PointObservation
from tracker.session.session import Session

Pins = tuple[tuple[PointObservation, ...], ...]
"""The pins of each person on a frame."""
_APART_M = 0.9
"""Distance between people who are not placed yet, metres: each can be seen and dragged by itself."""


class FramePoses:
    """The poses of people on a frame, as they are shown when the frame is opened."""

    def __init__(self, session: Session, saver: Saver) -> None:
        """Load from a saver; people without a pose stand upright on the session's floor."""
        self._saver = saver
        self.place(session)

    def place(self, session: Session) -> None:
        """Place people without a pose upright on the session's floor, side by side."""
        self._session = session
        self.R_world_up: Array = up_rotation(session.up, session.floor)
        """Rotation whose z axis points up, (3, 3)."""
        cameras, floor = [c.camera for c in session.cameras], floor_plane(session.up, session.floor)
        middle = (len(session.people) - 1) / 2
        self._default_poses = tuple(
            default_pose(person.model, cameras, self.R_world_up, _APART_M * (i - middle), floor)
            for i, person in enumerate(session.people)
        )

    def shown(self, frame: int) -> ShownFrame:
        """Return what is stored of a frame; a person without a pose is shown in that of the nearest frame."""
        people: list[ShownPose] = []
        for person, default in enumerate(self._default_poses):
            stored = self._saver.pose(person, frame)
            if stored is not None:
                people.append(stored)
            else:
                nearest = self._saver.nearest_pose(person, frame)
                people.append(ShownPose(default if nearest is None else nearest, None))
        present = tuple(self._saver.revisions.current(person) for person in range(len(people)))
        models, revisions = self.bodies(people)
        return ShownFrame(
            frame=frame, people=tuple(people), models=models, revisions=revisions, present=present,
            velocities=self.velocities(frame), pins=self.pins(frame),
        )  # fmt: skip

    def bodies(self, shown: Sequence[ShownPose]) -> tuple[tuple[BodyModel, ...], tuple[int, ...]]:
        """Return the bodies of poses and their model revisions; poses that are not stored have the present body."""
        stored = self._saver.revisions
        revisions = tuple(stored.current(i) if p.revision is None else p.revision for i, p in enumerate(shown))
        return tuple(stored.body(r) for r in revisions), revisions

    def velocities(self, frame: int) -> tuple[Array | None, ...]:
        """Return the velocity of each person by the stored poses around a frame; empty where no camera needs them."""
        if not any(c.clock.offset_frames(frame) for c in self._session.cameras):
            return ()
        out: list[Array | None] = []
        for person in range(len(self._session.people)):
            around = {k: self._saver.pose(person, k) for k in range(frame - 2, frame + 3)}
            own = around[frame]
            same = {k: p.values for k, p in around.items() if p and own and p.revision == own.revision}
            known = None if own is None else own.revision
            out.append(None if known is None else velocity(self._saver.revisions.body(known), same, frame))
        return tuple(out)

    def pins(self, frame: int) -> Pins:
        """Return the pins of all people on a frame."""
        return tuple(self._saver.pins(person, frame) for person in range(len(self._session.people)))
