"""What is on the screen: the state under its lock, and what all who change it share: loading, costs, saving."""

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.session.frame_cache import Frames
from app.state.state import Shown, State, finite_or_none
from app.storage.saver import Saver
from tracker.body.model import BodyModel
from tracker.fitting.gauss_newton import with_locked_dofs
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import up_rotation
from tracker.geometry.triangulation import PointObservation
from tracker.posing.default_pose import default_pose
from tracker.posing.retarget import retarget_pose
from tracker.session.locked_dofs import active_dofs
from tracker.session.session import Session
from tracker.tracking.chamfer.settings import pose_cost

_APART_M = 0.9
"""How far from each other people stand whom nobody has placed, metres: each can be seen and taken by itself."""


class Screen:
    """The state of one open session. Whoever changes it holds `lock`; the views are told within it."""

    def __init__(self, session: Session, saver: Saver, frames: Frames) -> None:
        """Show the first frame.

        Args:
            session: what is open.
            saver: keeps its poses.
            frames: gives images and evidence.
        """
        self.session, self.saver, self.frames = session, saver, frames
        self.lock = threading.RLock()
        self.stand(up_rotation(session.up, session.floor))
        self._subscribers: list[Callable[[State], None]] = []
        self._edit: int | None = None  # the entry of the history that the gesture at hand amends
        self.edit_of: object = None
        """The gesture whose next save amends the last entry of the history; None makes a new entry."""
        self.last_save = 0.0
        """When poses were last written, s of the monotonic clock."""
        unlocked = (frozenset[int](),) * len(session.people)
        shown = self._load(0)
        self.state = State(frame=0, pins=self._load_pins(0), locked=unlocked, **shown._asdict())
        self.refresh_saving()
        self.frames.request(0, self._evidence_ready)

    @property
    def models(self) -> tuple[BodyModel, ...]:
        """The bodies in which everybody is shown."""
        return self.state.models

    @property
    def present(self) -> tuple[BodyModel, ...]:
        """The bodies that new poses are made with."""
        return tuple(p.model for p in self.session.people)

    def present_poses(self) -> tuple[Array, ...]:
        """The poses shown, taken over into the present bodies where they were made with others, (n_values,) each."""
        bodies = zip(self.state.poses, self.state.models, self.present, strict=True)
        return tuple(retarget_pose(values, was, becomes) for values, was, becomes in bodies)

    def free(self, person: int) -> NDArray[np.bool_]:
        """The degrees of freedom of a person that may move, (n_dofs,): those that are not locked."""
        return active_dofs(self.present[person], self.state.locked[person])

    def within_locks(self, poses: Sequence[Array]) -> tuple[Array, ...]:
        """Poses, (n_values,) of each person, with what is locked as it is shown."""
        return tuple(
            with_locked_dofs(model, new, now, self.free(i)) if self.state.locked[i] else new
            for i, (model, new, now) in enumerate(zip(self.models, poses, self.state.poses, strict=True))
        )

    def stand(self, R_world_up: Array) -> None:
        """Let whom nobody has placed stand upright, by a rotation whose z axis points up, (3, 3)."""
        cameras = [c.camera for c in self.session.cameras]
        self._R_world_up = R_world_up
        middle = (len(self.present) - 1) / 2
        self._standing = tuple(
            default_pose(model, cameras, R_world_up, _APART_M * (i - middle)) for i, model in enumerate(self.present)
        )

    def embody(self, session: Session) -> None:
        """Go on with a session whose people have other bodies; to be followed by `show`."""
        self.session = session
        self.saver.embody(session)
        self.stand(self._R_world_up)

    def subscribe(self, view: Callable[[State], None]) -> Callable[[], None]:
        """Tell a view every new state from now on; returns what ends it."""
        with self.lock:
            self._subscribers.append(view)

        def unsubscribe() -> None:
            with self.lock:
                if view in self._subscribers:
                    self._subscribers.remove(view)

        return unsubscribe

    def set(self, **changes: object) -> None:
        """Make a new state and tell the views."""
        with self.lock:
            if changes.get("frame", self.state.frame) != self.state.frame and "pins" not in changes:
                changes["pins"] = self._load_pins(changes["frame"])  # type: ignore[arg-type]
            self.state = replace(self.state, **changes)  # type: ignore[arg-type]
            for view in list(self._subscribers):
                view(self.state)

    def show(self, frame: int, **changes: object) -> None:
        """Show the stored poses of a frame; what amends the last entry of the history is over."""
        self.edit_of = None
        shown = self._load(frame)
        costs = self.costs(tuple(p.values for p in shown.people), frame, shown.models)
        pins = self._load_pins(frame)
        self.set(frame=frame, pins=pins, drag=None, holds_pin=False, **shown._asdict(), **costs, **changes)
        self.request_evidence()

    def request_evidence(self) -> None:
        """See to it that the frame's evidence comes, and the costs of the poses shown with it."""
        if self.frames.evidence_at_hand(self.state.frame) is None:
            self.frames.request(self.state.frame, self._evidence_ready)

    def costs(
        self, poses: tuple[Array, ...], frame: int | None = None, models: tuple[BodyModel, ...] | None = None
    ) -> dict[str, object]:
        """The state's costs of given poses, by default of the bodies shown; empty while there is no evidence."""
        views = self.frames.evidence_at_hand(self.state.frame if frame is None else frame)
        if views is None:
            return {"cost_px": None, "view_costs_px": ()}
        cost = pose_cost(views, models or self.models, poses, self.state.settings)(poses)
        return {
            "cost_px": finite_or_none(cost.total_px),
            "view_costs_px": tuple(finite_or_none(c) for c in cost.views_px),
        }

    def pose(self, person: int, values: Array, **changes: object) -> None:
        """Show a pose that somebody gave one person, with its cost."""
        people = self.posed(person, values)
        self.set(people=people, **self.costs(tuple(p.values for p in people)), **changes)

    def posed(self, person: int, values: Array) -> tuple[Shown, ...]:
        """Everybody as they are shown, one of them in a pose that somebody gave, (n_values,)."""
        people = list(self.state.people)
        people[person] = Shown(values, "manual")
        return tuple(people)

    def go_to(self, frame: int | None) -> None:
        """Show the frame that the user saw, which a tracker may have left meanwhile; None for the one shown."""
        if frame is not None and frame != self.state.frame and 0 <= frame < self.session.n_frames:
            self.show(frame)

    def take_back(self, gesture: object) -> None:
        """Show the frame as it was before a gesture, which may have been written in part."""
        if self.edit_of is gesture:
            self.saver.undo()
            self.refresh_saving()
        self.show(self.state.frame)

    def save(self, label: str, source: str, gesture: object = None) -> None:
        """Write the poses shown; calls of one gesture make one entry of the history, without one each makes its own."""
        goes_on = gesture is not None and (self.edit_of is gesture or self.edit_of == gesture)
        amend = self._edit if goes_on else None
        self._edit = self.saver.save(self.state, label, source, amend)
        self.edit_of, self.last_save = gesture, time.monotonic()
        self.refresh_saving()

    def refresh_saving(self) -> None:
        """Bring what the state says of the history and the disk up to date."""
        undo, redo = self.saver.undo_label(), self.saver.redo_label()
        self.set(undo=undo, redo=redo, save_error=self.saver.error, timeline_version=self.saver.timeline_version)

    def _load(self, frame: int) -> "_Loaded":
        """What a frame shows: stored poses, else drafts from the nearest frame that has one."""
        shown: list[Shown] = []
        for person, standing in enumerate(self._standing):
            stored = self.saver.pose(person, frame)
            if stored is not None:
                shown.append(stored)
            else:
                nearest = self.saver.nearest_pose(person, frame)
                shown.append(Shown(standing if nearest is None else nearest, None))
        present = tuple(self.saver.revision(person) for person in range(len(shown)))
        return _Loaded(tuple(shown), *self.bodies(shown), present)

    def bodies(self, shown: Sequence[Shown]) -> tuple[tuple[BodyModel, ...], tuple[int, ...]]:
        """The bodies of poses, and what the store calls them: the present ones of those that are not stored."""
        saver = self.saver
        revisions = tuple(saver.revision(i) if p.revision is None else p.revision for i, p in enumerate(shown))
        return tuple(saver.body(r) for r in revisions), revisions

    def _load_pins(self, frame: int) -> tuple[tuple[PointObservation, ...], ...]:
        """The pins of everybody on a frame."""
        return tuple(self.saver.pins(person, frame) for person in range(len(self.session.people)))

    def _evidence_ready(self, frame: int) -> None:
        with self.lock:
            if frame == self.state.frame:
                self.set(**self.costs(self.state.poses))


class _Loaded(NamedTuple):
    """What the state shows of a frame."""

    people: tuple[Shown, ...]
    models: tuple[BodyModel, ...]
    revisions: tuple[int, ...]
    present: tuple[int, ...]
