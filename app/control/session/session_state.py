"""Hold the session's state and its lock; show, score and save poses for the controller's parts."""

import threading
import time
from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.control.session.frame_poses import FramePoses
from app.remedies import page_text
from app.session.frame_cache import FrameCache
from app.state.people import ShownPose, is_same_pose
from app.state.search import SearchView
from app.state.state import Costs, ShownFrame, State, finite_or_none, takes_changes_of
from app.storage.saver import Saver
from tracker.body.model import BodyModel, PosedBody
from tracker.compute.kernel_cache import STAGES
from tracker.compute.uncompiled_kernels import run_uncompiled
from tracker.errors import SessionError, TrackerError
from tracker.estimation.fitting.gauss_newton import value_mask, with_locked_dofs
from tracker.estimation.fitting.retarget import retarget_pose
from tracker.estimation.posing.grab import Constraints
from tracker.estimation.search.chamfer_cost import frame_cost
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array
from tracker.pipeline.marked_points import user_marked_points
from tracker.session.locked_dofs import active_dofs, load_locks
from tracker.session.session import Session

T = TypeVar("T")


def chosen(is_new: Sequence[bool], new: Sequence[T], old: Sequence[T]) -> tuple[T, ...]:
    """Return the new values where they are new, else the old ones."""
    return tuple(a if first else b for first, a, b in zip(is_new, new, old, strict=True))


class SessionState:
    """The state of one open session. A change takes `lock`; the views are called under it."""

    def __init__(
        self,
        session: Session,
        saver: Saver,
        frames: FrameCache,
        compiled: frozenset[str] = frozenset(STAGES),
        lock: "threading.RLock | None" = None,
    ) -> None:
        """Show the first frame.

        Args:
            session: to open.
            saver: stores its poses.
            frames: gives images and evidence.
            compiled: groups of kernels that can be called without delay.
            lock: of the states of everybody who works on the session; None for the first one.
        """
        self.session, self.saver, self.frames = session, saver, frames
        self.lock = lock or threading.RLock()
        self.frame_poses = FramePoses(session, saver)
        """Loads the poses of a frame."""
        self._subscribers: list[tuple[Callable[[State], None], frozenset[str]]] = []
        self._stored: ShownFrame | None = None  # the shown poses and pins that are on disk
        self.unwritten: list[Callable[[], bool]] = []
        """Functions that return whether a part of the controller holds poses that it has not saved yet."""
        self.edit: int | None = None
        """The entry of the history that the current gesture amends; None before it is saved."""
        self.open_edit_owner: object = None
        """The gesture whose next save amends the last entry of the history; None if a save makes a new entry."""
        self.last_save = 0.0
        """Time of the last save, s of the monotonic clock."""
        unlocked = (frozenset[int](),) * len(session.people)
        self.state = State(locked=unlocked, compiled=compiled, **vars(self.frame_poses.shown(0)))
        self.note_stored()
        self.refresh_saving()
        self.request_evidence()
        self.set(**vars(self.costs(self.state.poses)))  # others may have needed the evidence before

    @property
    def models(self) -> tuple[BodyModel, ...]:
        """The bodies in which people are shown."""
        return self.state.models

    @property
    def present(self) -> tuple[BodyModel, ...]:
        """The bodies of new poses."""
        return tuple(p.model for p in self.session.people)

    def present_poses(self) -> tuple[Array, ...]:
        """Return the shown poses, (n_values,) each, retargeted to the present bodies."""
        bodies = zip(self.state.poses, self.state.models, self.present, strict=True)
        return tuple(retarget_pose(values, was, becomes) for values, was, becomes in bodies)

    def active_dofs(self, person: int) -> NDArray[np.bool_]:
        """Return which degrees of freedom of a person are not locked, (n_dofs,)."""
        return active_dofs(self.present[person], self.state.locked[person])

    def free_sources(self, person: int, source: str, dofs: Collection[str] | None = None) -> tuple[str, ...]:
        """Return a source for each value of a person that an edit concerns, (n_values,); '' for the others.

        Args:
            person: index of the person.
            source: of these values.
            dofs: names of the degrees of freedom that the edit is about, of which locked ones stay; None for all.
        """
        model = self.models[person]
        concerned = self.active_dofs(person) & np.isin(model.dof_names, list(model.dof_names if dofs is None else dofs))
        return tuple(source if one else "" for one in value_mask(model, concerned))

    def drag_constraints(self, person: int) -> Constraints:
        """Return what a drag of a person leaves alone: locks, held points, the vertical."""
        here = [h for h in self.state.held if (h.frame, h.person) == (self.state.frame, person)]
        cameras = self.session.cameras
        held = {
            point: [cameras[h.camera].camera for h in here if h.point == point and h.camera is not None]
            for point in {h.point for h in here}
        }
        x, y, z = (float(c) for c in self.frame_poses.R_world_up[:, 2])
        return Constraints(self.active_dofs(person), held, up_world=(x, y, z))

    def fit_constraints(self, person: int) -> Constraints:
        """Return what a fit of a person leaves alone, and where the user put points, if that can be read."""
        constraints = self.drag_constraints(person)
        with suppress(SessionError):
            record = self.saver.record(person, self.state.frame)
            if record is not None:
                seen = user_marked_points(self.session.cameras, self.models[person], record)
                return replace(constraints, seen=tuple(seen))
        return constraints

    def within_locks(self, poses: Sequence[Array]) -> tuple[Array, ...]:
        """Return poses, (n_values,) each, with locked degrees of freedom as in the shown poses."""
        return tuple(
            with_locked_dofs(model, new, now, self.active_dofs(i)) if self.state.locked[i] else new
            for i, (model, new, now) in enumerate(zip(self.models, poses, self.state.poses, strict=True))
        )

    def set_body_models(self, session: Session) -> None:
        """Continue with a session whose people have other bodies; call `show_frame` afterwards."""
        self.session = session
        self.saver.set_body_models(session)
        self.frame_poses.place(session)

    def set_cameras(self, session: Session) -> None:
        """Continue with a session that has other cameras; call `show_frame` afterwards.

        Raises:
            RecordingError: a background cannot be read.
        """
        self.frames.set_cameras(session.cameras)
        self.session = replace(self.session, cameras=session.cameras)
        self.frame_poses.place(self.session)

    def follow_session(self, session: Session) -> None:
        """Continue with bodies, cameras and floor that the host of the session has changed, and show them."""
        self.session = session
        self.saver.follow_session(session)
        self.frame_poses.place(session)
        floor = replace(self.state.floor, up=session.up, plane=session.floor, picking=None)
        self.follow_joints()
        self.show_frame(floor=floor, draft=None)

    def follow_joints(self) -> None:
        """Select, hold and lock nothing that the present bodies lack."""
        people, state = self.session.people, self.state
        point = state.point if state.point in people[state.person].model.point_names else None
        held = frozenset(h for h in state.held if h.point in people[h.person].model.point_names)
        self.set(point=point, held=held, locked=load_locks(people, self.saver.setting))

    def subscribe(self, view: Callable[[State], None], *fields: str) -> Callable[[], None]:
        """Call a view with each state in which one of these fields is new; returns the function that ends this.

        Args:
            view: is called under the lock.
            fields: names of the fields that it reads; none for all.
        """
        subscription = view, frozenset(fields)
        with self.lock:
            self._subscribers.append(subscription)

        def unsubscribe() -> None:
            with self.lock:
                if subscription in self._subscribers:
                    self._subscribers.remove(subscription)

        return unsubscribe

    @takes_changes_of(State)
    def set(self, **changes: Any) -> None:
        """Change fields of the state and call the views.

        A new frame brings its pins unless they are given, and ends replay, preview and comparison of recorded searches.
        Whether all is saved follows from the other fields: no path that edits can forget it.
        """
        with self.lock:
            frame = changes.get("frame", self.state.frame)
            if frame != self.state.frame and "pins" not in changes:
                changes["pins"] = self.frame_poses.pins(frame)
            if frame != self.state.frame and "velocities" not in changes:
                changes["velocities"] = self.frame_poses.velocities(frame)
            if frame != self.state.frame and "search_view" not in changes:
                changes["search_view"] = SearchView(speed=self.state.search_view.speed)
            before, state = self.state, replace(self.state, **changes)
            self.state = replace(state, saved=self._is_saved(state))
            new = {name for name in [*changes, "saved"] if getattr(before, name) is not getattr(self.state, name)}
            for view, fields in list(self._subscribers):
                if not fields or new & fields:
                    view(self.state)

    @takes_changes_of(State)
    def show_frame(self, **changes: Any) -> None:
        """Show the stored poses of a frame, by default the shown one, with other changes; ends gestures.

        The next save makes a new entry of the history.
        """
        self.open_edit_owner = None
        self._stored = shown = self.frame_poses.shown(changes.get("frame", self.state.frame))
        costs = self.costs(tuple(p.values for p in shown.people), shown.frame, shown.models, shown.velocities)
        loaded: dict[str, Any] = {**vars(shown), **vars(costs), "drag": None, "is_pin_held": False}
        self.set(**loaded | changes)
        self.request_evidence()

    def show_peer_changes(self) -> bool:
        """Show what others have stored of the shown frame, and return whether anything is new.

        The others leave poses alone that change here, so that these stay as they are shown.
        """
        state, stored = self.state, self._stored or self.state
        loaded = self.frame_poses.shown(state.frame)
        new = [not is_same_pose(*pair) for pair in zip(stored.people, loaded.people, strict=True)]
        new_pins = [now != before for now, before in zip(loaded.pins, stored.pins, strict=True)]
        if not any(new + new_pins):
            return False
        people = chosen(new, loaded.people, state.people)
        models = chosen(new, loaded.models, state.models)
        self._stored = replace(loaded, people=chosen(new, loaded.people, stored.people))
        self.set(
            people=people,
            models=models,
            revisions=chosen(new, loaded.revisions, state.revisions),
            present=loaded.present,
            pins=chosen(new_pins, loaded.pins, state.pins),
            **vars(self.costs(tuple(p.values for p in people), state.frame, models)),
        )
        return True

    def require_editable(self, people: Iterable[int] | None = None, frames: Iterable[int] | None = None) -> None:
        """Check that nobody else works on poses: by default those of everybody on the shown frame.

        Raises:
            TurnError: somebody does.
        """
        everybody = range(len(self.session.people))
        self.saver.require_editable(everybody if people is None else people, frames or [self.state.frame])

    def request_evidence(self) -> None:
        """Request the frame's evidence in the background, unless it is cached; the costs follow.

        Kernels that are compiled beside the page come first: here they would hold it up.
        """
        if "evidence" in self.state.compiled and self.frames.cached_evidence(self.state.frame) is None:
            self.frames.request(self.state.frame, self._evidence_ready, self)

    def note_compiled(self, stages: frozenset[str]) -> None:
        """Note the groups of kernels that can be called without delay, and do what has waited for them."""
        with self.lock:
            self.set(compiled=stages)
            self.request_evidence()
            if "cost" in stages:  # a cost that was interpreted stays until then
                self.set(**vars(self.costs(self.state.poses)))

    def costs(
        self,
        poses: tuple[Array, ...],
        frame: int | None = None,
        models: tuple[BodyModel, ...] | None = None,
        velocities: tuple[Array | None, ...] | None = None,
    ) -> Costs:
        """Score poses, (n_values,) each.

        Args:
            poses: of all people.
            frame: on which they are scored; by default the shown one.
            models: bodies of the poses; by default the shown ones.
            velocities: see `State.velocities`; by default those of the shown frame.

        Returns:
            Costs without values while the frame has no evidence.
        """
        views = self.frames.cached_evidence(self.state.frame if frame is None else frame)
        if views is None or "cost" not in self.state.compiled:
            return Costs()
        moving = self.state.velocities if velocities is None else velocities
        return self._scored(views, models or self.models, poses, moving)

    def score_interpreted(self) -> None:
        """Score the shown poses without compiled kernels, unless they are scored or move; takes up to a second."""
        with self.lock:
            scored, models = self.state, self.models
            views = self.frames.cached_evidence(scored.frame)
        if views is None or scored.cost_px is not None or scored.drag is not None:
            return
        with run_uncompiled():
            costs = self._scored(views, models, scored.poses, scored.velocities)
        with self.lock:
            if self.state.people is scored.people and self.state.frame == scored.frame:
                self.set(**vars(costs))

    def _scored(
        self, views: Sequence[ViewEvidence], models: Sequence[BodyModel], poses: Sequence[Array],
        velocities: Sequence[Array | None],
    ) -> Costs:  # fmt: skip
        cost = frame_cost(views, [*map(PosedBody, models, poses, velocities or [None] * len(poses))])
        return Costs(
            cost_px=finite_or_none(cost.total_px), view_costs_px=tuple(finite_or_none(c) for c in cost.view_costs_px)
        )

    def show_pose(self, person: int, values: Array) -> None:
        """Show a person in a pose set by hand, (n_values,), with its cost."""
        people = self.people_with_pose(person, values)
        self.set(people=people, **vars(self.costs(tuple(p.values for p in people))))

    def people_with_pose(self, person: int, values: Array) -> tuple[ShownPose, ...]:
        """Return the shown people, one of them in a pose set by hand, (n_values,)."""
        people = list(self.state.people)
        people[person] = ShownPose(values, "manual")
        return tuple(people)

    def go_to(self, frame: int | None) -> None:
        """Show the frame that the user saw, which a tracker may have left; None for the shown one."""
        if frame is not None and frame != self.state.frame and 0 <= frame < self.session.n_frames:
            self.show_frame(frame=frame)

    def revert(self, gesture: object) -> None:
        """Show the frame as it was before a gesture, and undo what was saved of the gesture."""
        if self.open_edit_owner is gesture:
            self.saver.moves.undo()
        self.show_frame()
        self.refresh_saving()

    def save(
        self,
        label: str,
        source: str,
        gesture: object = None,
        person: int | None = None,
        vouched: Collection[int] | None = None,
    ) -> None:
        """Save the shown poses.

        Args:
            label: of the entry of the history.
            source: of the values that changed.
            gesture: successive saves of one gesture make one entry; None makes an entry for this save.
            person: index of the only person who is edited, whom the label then names; None for several.
            vouched: indices of the people whom the edit is about, as for `Saver.save`; None for all.
        """
        label = self.label_of(label, person)
        goes_on = gesture is not None and (self.open_edit_owner is gesture or self.open_edit_owner == gesture)
        amend = self.edit if goes_on else None
        self.edit = self.saver.save(self.state, label, source, amend, vouched)
        # Points that were seen are stored now, or wait in the saver's queue.
        people = tuple(replace(p, seen=()) if p.seen else p for p in self.saver.with_stored_sources(self.state))
        if any(shown is not before for shown, before in zip(people, self.state.people, strict=True)):
            self.set(people=people)
        self.open_edit_owner, self.last_save = gesture, time.monotonic()
        self.note_stored()
        self.refresh_saving()

    def label_of(self, label: str, person: int | None) -> str:
        """Return the label of an edit of one person, whom it names where there are several."""
        people = self.session.people
        return label if person is None or len(people) == 1 else f"{people[person].name}: {label}"

    def note_stored(self) -> None:
        """Note that the saver has the shown poses and pins; those that it cannot write wait in its queue."""
        self._stored = self.state

    def note_moved(self) -> None:
        """Note that the stored poses of the shown frame may have changed; `show_frame` shows them."""
        self._stored = None

    def refresh_saving(self) -> None:
        """Bring what the state says of the history and the disk up to date."""
        undo, redo, error = self.state.undo, self.state.redo, self.saver.error
        try:
            undo, redo = self.saver.moves.labels()
        except TrackerError as unreadable:  # its drive may be gone: edits wait in the queue
            error = error or page_text(unreadable)
        self.set(undo=undo, redo=redo, save_error=error, timeline_version=self.saver.index.version)

    def is_shown_stored(self, state: State) -> bool:
        """Return whether the saver has the poses and pins that a state shows; drafts need not be stored."""
        if self._stored is None or state.pins != self._stored.pins:
            return False
        pairs = zip(state.people, self._stored.people, strict=True)
        return all(shown is stored or shown.source is None for shown, stored in pairs)

    def _is_saved(self, state: State) -> bool:
        return (
            self.saver.error is None
            and self.is_shown_stored(state)
            and not any(is_unwritten() for is_unwritten in self.unwritten)
        )

    def _evidence_ready(self, frame: int) -> None:
        with self.lock:
            if frame == self.state.frame:
                self.set(**vars(self.costs(self.state.poses)))
