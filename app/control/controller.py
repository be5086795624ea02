"""The only writer of the state: one method per intention of the user. Locks, saving, undo.

Methods may be called from any thread. Views subscribe and are told the new state; they must be quick about it and
must not call back.
"""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app.control.posing.alternatives import Choosing
from app.control.posing.body_sizes import Sizing
from app.control.posing.dof_locks import Locks
from app.control.posing.dragging import Hand
from app.control.posing.pinning import Pinning
from app.control.posing.pose_edits import PoseEdits
from app.control.search.cost_landscape import Landscapes
from app.control.search.replay import Replay
from app.control.search.search_runs import Runs
from app.control.search.searching import Searching
from app.control.session.footage_scan import Listing
from app.control.session.history import History
from app.control.session.kernel_warmup import Compiling
from app.control.session.session_state import Screen
from app.control.tracking.inconsistent_frames import Disagreements
from app.control.tracking.ranges import Ranges
from app.control.tracking.tracking import Tracking
from app.control.view.floor import Flooring
from app.control.view.view_3d import Viewing
from app.control.view.visibility import Casting
from app.session.frame_cache import Frames
from app.state.state import State
from app.storage.saver import Saver
from tracker.body.model import BodyModel
from tracker.geometry.arrays import Array
from tracker.session.session import Session
from tracker.store.records import FramePose
from tracker.tracking.chamfer.settings import TrackSettings


class Controller:
    """The state of one open session, and everything that may happen to it."""

    def __init__(self, session: Session, saver: Saver, frames: Frames) -> None:
        """Show the first frame.

        Args:
            session: what is open.
            saver: keeps its poses.
            frames: gives images and evidence.
        """
        self.frames, self._saver = frames, saver
        self._screen = Screen(session, saver, frames)
        runs = Runs()
        self._searching, self._tracking = Searching(self._screen, runs), Tracking(self._screen)
        self._lock = self._screen.lock
        self.hand = Hand(self._screen, self.editing)
        """Poses people by hand."""
        self.pose_edits = PoseEdits(self._screen, self.editing)
        """Changes poses by numbers, steps and strokes."""
        self.locks = Locks(self._screen, self.editing)
        """Holds degrees of freedom still."""
        self.ranges = Ranges(self._screen, self._tracking, self.editing)
        """Works on ranges of frames, and marks them."""
        self._disagreements = Disagreements(self._screen)
        self._listing = Listing(self._screen)
        self._compiling: Compiling | None = None
        self.pinning = Pinning(self._screen, self.editing)
        """Sets pins, and fits people to them."""
        self.replay = Replay(self._screen, runs, self.editing)
        """Looks back at searches."""
        self.sizing = Sizing(self._screen, runs, self.editing)
        """Edits the sizes of bodies."""
        self.history = History(self._screen, self.editing, self.sizing.follow)
        """Moves along the history."""
        self.landscape = Landscapes(self._screen, self.editing)
        """Looks at the cost along one degree of freedom."""
        self.flooring = Flooring(self._screen, self.editing)
        """Sets the floor."""
        self.choosing = Choosing(self._screen, self.editing)
        """Takes other poses that are about as good."""
        self.casting = Casting(self._screen)
        """Whom the views show."""
        self.view_3d = Viewing(self._screen)
        """What the 3-D view shows."""

    # --- views -------------------------------------------------------------------------------------------------

    @property
    def state(self) -> State:
        """What the screen shows now."""
        return self._screen.state

    @property
    def session(self) -> Session:
        """What is open, with the present body of everybody."""
        return self._screen.session

    @property
    def models(self) -> tuple[BodyModel, ...]:
        """The bodies in which everybody is shown now."""
        return self._screen.models

    def session_of(self, state: State) -> Session:
        """The session with everybody in the body that a state shows, as poses are drawn."""
        people = zip(self.session.people, state.models, strict=True)
        return replace(self.session, people=tuple(replace(p, model=m) for p, m in people))

    def free(self) -> list[NDArray[np.bool_]]:
        """Of each person the degrees of freedom that are not locked, (n_dofs,)."""
        return [self._screen.free(person) for person in range(len(self.models))]

    def locked(self) -> AbstractContextManager[object]:
        """The lock under which nothing changes, for who reads more than the state; to be held for a moment only."""
        return self._lock

    def subscribe(self, view: Callable[[State], None]) -> Callable[[], None]:
        """Tell a view every new state from now on; returns what ends it."""
        return self._screen.subscribe(view)

    def timeline(self, since: int = 0, person: int | None = None) -> dict[int, dict | None]:
        """Cells of the frames whose stored poses changed after a version of the timeline; all for 0.

        Args:
            since: the version.
            person: of whom among several; by default what is said of all together.
        """
        with self._lock:
            return self._saver.timeline(since, person)

    def numbers(self, person: int, since: int = 0) -> tuple[list[int], list[FramePose]]:
        """Frames on which a person's stored poses changed after a version of the timeline, and what they hold now.

        For 0 all frames on which the person has a pose.
        """
        with self._lock:
            frames = sorted(self._saver.timeline(since)) if since > 0 else self._saver.frames(person)
        return frames, self._saver.numbers(person, frames)

    def poses(self, person: int, frames: range) -> dict[int, Array]:
        """Stored poses of a person in the present body, by frame, (n_values,) each; frames without one are left out."""
        saver = self._saver
        with self._lock:
            listed = self._saver.frames_within(person, frames)
        rows = self._saver.numbers(person, listed)
        return {
            row.frame: saver.in_present_body(person, row.values, row.model_revision)
            for row in rows
            if saver.fits(person, row.model_revision)
        }

    # --- looking -----------------------------------------------------------------------------------------------

    def seek(self, frame: int) -> None:
        """Show a frame; a drag ends, a search stops and is forgotten. A tracker at work goes on and is not followed."""
        frame = min(max(0, int(frame)), self.session.n_frames - 1)
        if frame == self.state.frame:
            return
        self._searching.halt()
        with self._lock:
            self._let_go()
            self._searching.forget()
            self.replay.forget()
            self._tracking.flush()
            self._screen.show(frame, follow=self.state.follow and not self.state.track.running)

    def select(self, person: int, point: str | None) -> None:
        """Choose whom and what the panels show."""
        if 0 <= person < len(self.models) and (point is None or point in self.models[person].point_names):
            self._screen.set(person=person, point=point)

    def hold_3d(self, page: int, hold: bool) -> None:
        """Let the 3-D view and its panels rest while a point is dragged: a page asks for it that draws them slowly."""
        with self._lock:
            others = self.state.holding_3d - {page}
            self._screen.set(holding_3d=others | {page} if hold else others)

    # --- searching and tracking --------------------------------------------------------------------------------

    def set_settings(self, settings: TrackSettings) -> None:
        """Change what the next search or tracking run is told; a search that stands is forgotten."""
        self._searching.halt()
        with self._lock:
            self._searching.forget()
            self._screen.set(settings=settings)
            self._screen.set(**self._screen.costs(self.state.poses))

    def search_step(self, person: int | None = None) -> None:
        """Do one expansion of the search on this frame, beginning one where none stands.

        Args:
            person: whom to search, the others as they stand; everybody by default.
        """
        self._search(lambda: self._searching.step(person))

    def search_stage(self, person: int | None = None) -> None:
        """Search this frame to the end of the stage at hand; for `person` see `search_step`."""
        self._search(lambda: self._searching.run_stage(person))

    def search_frame(self, person: int | None = None) -> None:
        """Search this frame to the end, going on with a search that stands; for `person` see `search_step`."""
        self._search(lambda: self._searching.run(person))

    def search_again(self, run: int | None = None, person: int | None = None) -> None:
        """Search this frame from where a run of it began, by the settings of now; None for the newest run.

        Raises:
            TrackerError: the run is kept no more.
        """
        self._searching.halt()
        self._search(lambda: self._searching.run_again(run, person))

    def pace_search(self, speed: float | None) -> None:
        """Watch so many expansions a second; None for as many as there can be.

        Raises:
            TrackerError: the speed is no positive number.
        """
        self._searching.pace(speed)

    def track(self, backward: bool, until: int | None) -> None:
        """Track from the shown frame to the end of the recording, or until a frame; one entry of the history.

        Raises:
            TrackerError: nobody has been placed, or there is no frame to track.
        """
        with self.editing():
            self._tracking.start(backward, until)

    def pause_tracking(self) -> None:
        """Let a tracking run stand; all that it found is on disk when this returns."""
        self._tracking.halt()

    def go_on_tracking(self) -> None:
        """Go on with a tracking run that is paused."""
        self._searching.halt()
        with self._lock:
            self._let_go()
            self._searching.forget()
            self._tracking.go_on()

    def follow(self, follow: bool) -> None:
        """Show each frame as it is tracked, or stay where the user looks."""
        self._tracking.follow(follow)

    def stop(self) -> None:
        """Stop what is at work, with the best so far on disk: a search stands and can go on, a tracking run is over."""
        self._searching.halt()
        self.ranges.halt()
        self._stop_tracking()

    # --- history -----------------------------------------------------------------------------------------------

    def undo(self) -> None:
        """Take back the last entry of the history, after stopping what stands on it."""
        self.history.undo()

    def redo(self) -> None:
        """Do again what was taken back last."""
        self.history.redo()

    def compile_kernels(self) -> None:
        """Compile, beside the page, the kernels that are not compiled yet."""
        self._compiling = Compiling(self._screen)

    def close(self) -> None:
        """Stop and save what is at hand; the controller is done."""
        with self.editing():
            self.history.save()
        self.hand.close()
        self._disagreements.close()
        self._listing.close()
        if self._compiling is not None:
            self._compiling.close()
        self.landscape.close()
        self.frames.close()

    # --- within ------------------------------------------------------------------------------------------------

    @contextmanager
    def editing(self) -> Iterator[None]:
        """Hold the lock with nothing at work, no gesture at hand, and no job that would go on from here."""
        while True:
            # Not within the lock: the last step of a job takes it.
            self._searching.halt()
            self._tracking.halt(stay=True)
            self.ranges.halt()
            with self._lock:
                if self._searching.running or self._tracking.running or self.ranges.running:
                    continue  # another thread was faster
                self._let_go()
                self._searching.forget()
                self._tracking.forget()
                yield
                return

    def _let_go(self) -> None:
        """End and save the gesture at hand, of whatever kind."""
        self.hand.finish()
        self.pinning.finish()
        self.replay.leave()

    def _search(self, go: Callable[[], None]) -> None:
        self._stop_tracking()
        with self._lock:
            self._let_go()
            go()

    def _stop_tracking(self) -> None:
        self._tracking.halt(stay=True)
        self._tracking.forget()
