"""The only writer of the state: one method per intention of the user. Locks, saving, undo.

Methods may be called from any thread. Views subscribe and are told the new state; they must be quick about it and
must not call back.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from app.frames import Frames
from app.jobs import Job
from app.saving import Saver
from app.state import BASES, OVERLAYS, Base, DragState, JobState, Shown, State, finite_or_none
from tracker import posing
from tracker.errors import TrackerError
from tracker.rigid import Array
from tracker.search import SearchSettings, SearchStep, stages
from tracker.session import Session
from tracker.track import TrackSettings, pose_cost, search_frame

_CHECKPOINT_S = 1.0
"""A long drag is on disk at least this often."""
_SAME_GESTURE_S = 1.0
"""Changes of one slider within this time of each other are one entry of the history."""
_SEARCH_SAVE_S = 0.5
"""A running search is on disk at least this often."""


class Controller:
    """The state of one open session, and everything that may happen to it."""

    def __init__(self, session: Session, saver: Saver, frames: Frames) -> None:
        """Show the first frame.

        Args:
            session: what is open.
            saver: keeps its poses.
            frames: gives images and evidence.
        """
        self.session, self.frames, self._saver = session, frames, saver
        self.models = tuple(p.model for p in session.people)
        self._standing = tuple(
            posing.standing_pose(m, [c.camera for c in session.cameras], session.up) for m in self.models
        )
        self._lock = threading.RLock()
        self._subscribers: list[Callable[[State], None]] = []
        self._job: Job[SearchStep] | None = None
        self._grab: posing.Grab | None = None
        self._grab_page = 0
        self._edit: int | None = None  # the entry of the history that the gesture at hand amends
        self._edit_of: object = None  # what that gesture is
        self._edit_time = 0.0
        self._last_save = 0.0
        self.state = State(frame=0, people=self._load(0))
        self._refresh_saving()
        self.frames.request(0, self._evidence_ready)

    # --- views -------------------------------------------------------------------------------------------------

    def subscribe(self, view: Callable[[State], None]) -> Callable[[], None]:
        """Tell a view every new state from now on; returns what ends it."""
        with self._lock:
            self._subscribers.append(view)

        def unsubscribe() -> None:
            with self._lock:
                if view in self._subscribers:
                    self._subscribers.remove(view)

        return unsubscribe

    def timeline(self, since: int = 0) -> dict[int, dict | None]:
        """Cells of the frames whose stored poses changed after a version of the timeline; all for 0."""
        return self._saver.timeline(since)

    # --- looking -----------------------------------------------------------------------------------------------

    def seek(self, frame: int) -> None:
        """Show a frame; a drag ends, a search stops and is forgotten."""
        frame = min(max(0, int(frame)), self.session.n_frames - 1)
        if frame == self.state.frame:
            return
        self._halt()
        with self._lock:
            self._finish_gesture()
            self._job = None
            self._show(frame)

    def select(self, person: int, point: str | None) -> None:
        """Choose whom and what the panels show."""
        if 0 <= person < len(self.models) and (point is None or point in self.models[person].point_names):
            self._set(person=person, point=point)

    def set_view(self, base: str, overlays: dict[str, bool]) -> None:
        """Choose the layers of all panes."""
        shown = {name for name in OVERLAYS if overlays.get(name, name in self.state.overlays)}
        chosen: Base = next((b for b in BASES if b == base), self.state.base)
        self._set(base=chosen, overlays=frozenset(shown))

    def hold_3d(self, page: int, hold: bool) -> None:
        """Let the 3-D view and its panels rest while a point is dragged: a page asks for it that draws them slowly."""
        with self._lock:
            others = self.state.holding_3d - {page}
            self._set(holding_3d=others | {page} if hold else others)

    # --- posing ------------------------------------------------------------------------------------------------

    def begin_drag(self, page: int, camera: int, person: int, point: str, pointer_px: tuple[float, float]) -> None:
        """Take hold of a point in a view; pointer in undistorted px."""
        if not (0 <= camera < len(self.session.cameras) and 0 <= person < len(self.models)):
            return
        if point not in self.models[person].point_names:
            return
        self._halt()
        with self._lock:
            self._finish_gesture()
            self._job = None
            values = self.state.poses[person]
            view = self.session.cameras[camera].camera
            self._grab = posing.grab(self.models[person], values, view, point, np.array(pointer_px))
            self._grab_page, self._last_save = page, time.monotonic()
            drag = DragState(camera, person, point, pointer_px)
            self._set(person=person, point=point, drag=drag, job=JobState())

    def move_drag(self, page: int, pointer_px: tuple[float, float], seq: int) -> None:
        """Let the held point follow the pointer."""
        with self._lock:
            drag = self.state.drag
            if self._grab is None or drag is None or page != self._grab_page:
                return
            values = posing.drag(self._grab, np.array(pointer_px), self.state.poses[drag.person])
            seqs = (*(s for s in self.state.drag_seqs if s[0] != page), (page, seq))[-16:]
            self._pose(drag.person, values, drag=replace(drag, pointer_px=pointer_px), drag_seqs=seqs)
            if time.monotonic() - self._last_save > _CHECKPOINT_S:
                self._save(f"drag {_spoken(drag.point)}", "manual", self._grab)

    def end_drag(self, page: int) -> None:
        """Let go: the gesture is one entry of the history, on disk when this returns."""
        with self._lock:
            if page == self._grab_page:
                self._finish_gesture()

    def cancel_drag(self, page: int) -> None:
        """Let go and put the body back where it was."""
        with self._lock:
            hand, drag = self._grab, self.state.drag
            if hand is None or drag is None or page != self._grab_page:
                return
            checkpointed = self._edit_of is hand
            self._grab = self._edit_of = None
            if checkpointed:
                self._saver.undo()
                self._refresh_saving()
            self._set(drag=None)
            self._show(self.state.frame)

    def set_dof(self, person: int, dof: int, value: float) -> None:
        """Set one degree of freedom of a revolute joint or of the root, rad or metres."""
        self._halt()
        with self._lock:
            self._finish_gesture()
            self._job = None
            model, values = self.models[person], self.state.poses[person].copy()
            values[model.dof_value[dof]] = value
            self._pose(person, model.clip(values), job=JobState())
            gesture = ("dof", person, dof, self.state.frame)
            if gesture != self._edit_of or time.monotonic() - self._edit_time > _SAME_GESTURE_S:
                self._edit_of = None
            self._save(f"set {_spoken(model.dof_names[dof])}", "manual", gesture)

    # --- searching ---------------------------------------------------------------------------------------------

    def set_search(self, settings: SearchSettings, theta_px: float | None, outliers: str) -> None:
        """Change what the next search is told; one that stands is forgotten."""
        self._halt()
        with self._lock:
            self._job = None
            kind = "paper" if outliers == "paper" else "truncated"
            self._set(settings=settings, theta_px=theta_px, outliers=kind, job=JobState())
            self._set(**self._costs(self.state.poses))

    def search_step(self) -> None:
        """Do one expansion of the search on this frame, beginning one where none stands."""
        with self._lock:
            if self._job is None or not self._job.running:
                self._standing_job().step()

    def search_frame(self) -> None:
        """Search this frame to the end, going on with a search that stands."""
        with self._lock:
            if self._job is None or not self._job.running:
                job = self._standing_job()
                self._set(job=replace(self.state.job, running=True))
                job.run()

    def stop(self) -> None:
        """Stop the search; it stands, with the best pose so far in place and on disk."""
        self._halt()

    def undo(self) -> None:
        """Take back the last entry of the history, after stopping what stands on it."""
        self._through_history(self._saver.undo)

    def redo(self) -> None:
        """Do again what was taken back last."""
        self._through_history(self._saver.redo)

    def close(self) -> None:
        """Stop and save what is at hand; the controller is done."""
        self._halt()
        with self._lock:
            self._finish_gesture()
        self.frames.close()

    # --- within ------------------------------------------------------------------------------------------------

    def _set(self, **changes: object) -> None:
        with self._lock:
            self.state = replace(self.state, **changes)  # type: ignore[arg-type]
            for view in list(self._subscribers):
                view(self.state)

    def _load(self, frame: int) -> tuple[Shown, ...]:
        """What a frame shows: stored poses, else drafts from the nearest frame that has one."""
        shown = []
        for person, standing in enumerate(self._standing):
            stored = self._saver.pose(person, frame)
            if stored is not None:
                shown.append(stored)
            else:
                nearest = self._saver.nearest_pose(person, frame)
                shown.append(Shown(standing if nearest is None else nearest, None))
        return tuple(shown)

    def _show(self, frame: int) -> None:
        self._edit_of = None
        people = self._load(frame)
        poses = tuple(p.values for p in people)
        self._set(frame=frame, people=people, drag=None, job=JobState(), **self._costs(poses, frame))
        if self.state.cost_px is None:
            self.frames.request(frame, self._evidence_ready)

    def _evidence_ready(self, frame: int) -> None:
        with self._lock:
            if frame == self.state.frame:
                self._set(**self._costs(self.state.poses))

    def _costs(self, poses: tuple[Array, ...], frame: int | None = None) -> dict[str, object]:
        """The state's costs of given poses; empty while there is no evidence."""
        frame = self.state.frame if frame is None else frame
        views = self.frames.evidence_at_hand(frame)
        if views is None:
            return {"cost_px": None, "view_costs_px": ()}
        cost = pose_cost(views, self.models, poses, self._track_settings())(poses)
        return {
            "cost_px": finite_or_none(cost.total_px),
            "view_costs_px": tuple(finite_or_none(c) for c in cost.views_px),
        }

    def _pose(self, person: int, values: Array, **changes: object) -> None:
        """Show a new pose of one person."""
        people = list(self.state.people)
        people[person] = Shown(values, "manual")
        poses = tuple(p.values for p in people)
        self._set(people=tuple(people), **self._costs(poses), **changes)

    def _finish_gesture(self) -> None:
        """End the drag at hand, if there is one, and save it."""
        hand, drag = self._grab, self.state.drag
        if hand is None or drag is None:
            return
        if not np.array_equal(hand.values, self.state.poses[drag.person]) or self._edit_of is hand:
            self._save(f"drag {_spoken(drag.point)}", "manual", hand)
        self._grab = self._edit_of = None
        self._set(drag=None)

    def _save(self, label: str, source: str, gesture: object) -> None:
        """Write the poses shown; calls of one gesture make one entry of the history."""
        amend = self._edit if self._edit_of is gesture or self._edit_of == gesture else None
        self._edit = self._saver.save(self.state, label, source, amend)
        self._edit_of, self._edit_time, self._last_save = gesture, time.monotonic(), time.monotonic()
        self._refresh_saving()

    def _refresh_saving(self) -> None:
        undo, redo = self._saver.undo_label(), self._saver.redo_label()
        version = self._saver.timeline_version
        self._set(undo=undo, redo=redo, save_error=self._saver.error, timeline_version=version)

    def _track_settings(self) -> TrackSettings:
        return TrackSettings(self.state.settings, self.state.theta_px, self.state.outliers)

    def _through_history(self, move: Callable[[], int | None]) -> None:
        self._halt()
        with self._lock:
            self._finish_gesture()
            self._job = None
            frame = move()
            self._refresh_saving()
            self._show(self.state.frame if frame is None else frame)

    def _halt(self) -> None:
        """Stop a running search; must not be called holding the lock, which the search's last step takes."""
        job = self._job
        if job is not None:
            job.stop()

    def _standing_job(self) -> Job[SearchStep]:
        """The search on the shown frame: the one that stands, or a new one from the poses shown."""
        self._finish_gesture()
        if self._job is None or self._job.ended:
            frame, poses, settings = self.state.frame, self.state.poses, self._track_settings()
            job: Job[SearchStep] = Job(
                lambda: search_frame(self.frames.evidence(frame), self.models, poses, settings),
                lambda step, seconds: self._search_stepped(job, step, seconds),
                lambda error: self._search_ended(job, error),
                lambda: self._search_paused(job),
            )
            self._job, self._edit_of = job, None
            names = tuple(s.name for s in stages(self.models, settings.search))
            self._set(job=JobState(kind="search", stages=names))
        return self._job

    def _search_stepped(self, job: Job[SearchStep], step: SearchStep, seconds: float) -> None:
        with self._lock:
            if job is not self._job:
                return
            people = tuple(
                p if p.source is not None and np.array_equal(p.values, best) else Shown(best, "searched")
                for p, best in zip(self.state.people, step.best, strict=True)
            )
            shown = replace(
                self.state.job, running=job.running, kind="search", stage=step.stage.name,
                evaluations=step.evaluations, per_second=step.evaluations / max(1e-6, seconds),
                best_px=step.best_px, candidate=step.candidate, message="",
            )  # fmt: skip
            changed = any(a is not b for a, b in zip(people, self.state.people, strict=True))
            costs = {"cost_px": step.best_px, "view_costs_px": tuple(finite_or_none(c) for c in step.best_views_px)}
            self._set(people=people, job=shown, **costs)
            if changed and time.monotonic() - self._last_save > _SEARCH_SAVE_S:
                self._save("search", "searched", job)

    def _search_paused(self, job: Job[SearchStep]) -> None:
        with self._lock:
            if job is self._job:
                self._set(job=replace(self.state.job, running=False))
                self._save_search(job)

    def _search_ended(self, job: Job[SearchStep], error: Exception | None) -> None:
        with self._lock:
            if job is not self._job:
                return
            if error is None:
                message = f"done: {self.state.job.evaluations} poses scored"
            else:
                message = str(error) if isinstance(error, TrackerError) else f"the search failed: {error}"
            ended = replace(self.state.job, running=False, kind=None, stage=None, candidate=None, message=message)
            self._set(job=ended, **self._costs(self.state.poses))
            self._save_search(job)

    def _save_search(self, job: Job[SearchStep]) -> None:
        if any(p.source == "searched" for p in self.state.people):
            self._save("search", "searched", job)


def _spoken(name: str) -> str:
    """`left_shoulder.abduction` as people say it."""
    return name.replace("_", " ").replace(".", " ")
