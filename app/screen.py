"""What is on the screen: the state under its lock, and what all who change it share: loading, costs, saving."""

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app.frames import Frames
from app.saving import Saver
from app.state import Shown, State, finite_or_none
from tracker import posing
from tracker.pins import ViewPin
from tracker.rigid import Array
from tracker.session import Session
from tracker.track import pose_cost


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
        self.models = tuple(p.model for p in session.people)
        self.lock = threading.RLock()
        self.stand(posing.up_rotation(session.up, session.floor))
        self._subscribers: list[Callable[[State], None]] = []
        self._edit: int | None = None  # the entry of the history that the gesture at hand amends
        self.edit_of: object = None
        """The gesture whose next save amends the last entry of the history; None makes a new entry."""
        self.last_save = 0.0
        """When poses were last written, s of the monotonic clock."""
        unlocked = (frozenset[int](),) * len(self.models)
        self.state = State(frame=0, people=self._load(0), pins=self._load_pins(0), locked=unlocked)
        self.refresh_saving()
        self.frames.request(0, self._evidence_ready)

    def free(self, person: int) -> NDArray[np.bool_]:
        """The degrees of freedom of a person that may move, (n_dofs,): those that are not locked."""
        return ~np.isin(np.arange(self.models[person].n_dofs), list(self.state.locked[person]))

    def within_locks(self, poses: Sequence[Array]) -> tuple[Array, ...]:
        """Poses, (n_values,) of each person, with what is locked as it is shown."""
        steps = [m.difference(new, now) for m, new, now in zip(self.models, poses, self.state.poses, strict=True)]
        return tuple(
            model.retract(now, np.where(self.free(i), step, 0.0)) if self.state.locked[i] else new
            for i, (model, new, now, step) in enumerate(zip(self.models, poses, self.state.poses, steps, strict=True))
        )

    def stand(self, R_world_up: Array) -> None:
        """Let whom nobody has placed stand upright, by a rotation whose z axis points up, (3, 3)."""
        cameras = [c.camera for c in self.session.cameras]
        self._standing = tuple(posing.standing_pose(m, cameras, R_world_up) for m in self.models)

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
        people = self._load(frame)
        costs = self.costs(tuple(p.values for p in people), frame)
        pins = self._load_pins(frame)
        self.set(frame=frame, people=people, pins=pins, drag=None, holds_pin=False, **costs, **changes)
        self.request_evidence()

    def request_evidence(self) -> None:
        """See to it that the frame's evidence comes, and the costs of the poses shown with it."""
        if self.frames.evidence_at_hand(self.state.frame) is None:
            self.frames.request(self.state.frame, self._evidence_ready)

    def costs(self, poses: tuple[Array, ...], frame: int | None = None) -> dict[str, object]:
        """The state's costs of given poses; empty while there is no evidence."""
        views = self.frames.evidence_at_hand(self.state.frame if frame is None else frame)
        if views is None:
            return {"cost_px": None, "view_costs_px": ()}
        cost = pose_cost(views, self.models, poses, self.state.settings)(poses)
        return {
            "cost_px": finite_or_none(cost.total_px),
            "view_costs_px": tuple(finite_or_none(c) for c in cost.views_px),
        }

    def pose(self, person: int, values: Array, **changes: object) -> None:
        """Show a pose that a hand gave one person."""
        people = list(self.state.people)
        people[person] = Shown(values, "manual")
        self.set(people=tuple(people), **self.costs(tuple(p.values for p in people)), **changes)

    def save(self, label: str, source: str, gesture: object) -> None:
        """Write the poses shown; calls of one gesture make one entry of the history."""
        amend = self._edit if self.edit_of is gesture or self.edit_of == gesture else None
        self._edit = self.saver.save(self.state, label, source, amend)
        self.edit_of, self.last_save = gesture, time.monotonic()
        self.refresh_saving()

    def refresh_saving(self) -> None:
        """Bring what the state says of the history and the disk up to date."""
        undo, redo = self.saver.undo_label(), self.saver.redo_label()
        self.set(undo=undo, redo=redo, save_error=self.saver.error, timeline_version=self.saver.timeline_version)

    def _load(self, frame: int) -> tuple[Shown, ...]:
        """What a frame shows: stored poses, else drafts from the nearest frame that has one."""
        shown = []
        for person, standing in enumerate(self._standing):
            stored = self.saver.pose(person, frame)
            if stored is not None:
                shown.append(stored)
            else:
                nearest = self.saver.nearest_pose(person, frame)
                shown.append(Shown(standing if nearest is None else nearest, None))
        return tuple(shown)

    def _load_pins(self, frame: int) -> tuple[tuple[ViewPin, ...], ...]:
        """The pins of everybody on a frame."""
        return tuple(self.saver.pins(person, frame) for person in range(len(self.models)))

    def _evidence_ready(self, frame: int) -> None:
        with self.lock:
            if frame == self.state.frame:
                self.set(**self.costs(self.state.poses))


def spoken(name: str) -> str:
    """`left_shoulder.abduction` as people say it."""
    return name.replace("_", " ").replace(".", " ")
