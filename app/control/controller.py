"""The only writer of the state. Each kind of change is one part of the controller.

Methods of all parts may be called from any thread. Views subscribe to new states; their callbacks must return quickly
and must not call the controller.
"""

import threading
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app.control.navigation import Navigation
from app.control.posing.alternatives import Alternatives
from app.control.posing.body_acquisition import BodyAcquisition
from app.control.posing.body_sizes import BodySizeEditing
from app.control.posing.dof_locks import DofLocks
from app.control.posing.dragging import Dragging, HeldPoints
from app.control.posing.pinning import Pinning
from app.control.posing.pose_edits import PoseEdits
from app.control.search.cost_landscape import CostLandscapes
from app.control.search.cost_map import CostMaps
from app.control.search.search_runs import Replay, SearchRuns
from app.control.search.searching import SearchRunner
from app.control.session.activities import Activities
from app.control.session.annotating import Annotating
from app.control.session.comparing import Comparing
from app.control.session.footage_scan import FootageScan
from app.control.session.history import History
from app.control.session.kernel_warmup import KernelWarmup
from app.control.session.other_copy import OtherCopies
from app.control.session.peer_changes import FollowingHost, PeerChanges
from app.control.session.proposing import Proposing
from app.control.session.save_retry import SaveRetry
from app.control.session.session_state import SessionState
from app.control.session.stored_poses import StoredPoses
from app.control.tracking.calibrating import Calibrating
from app.control.tracking.clocks import Clocks
from app.control.tracking.comparing_runs import ComparingRuns
from app.control.tracking.finding import FindingPeople
from app.control.tracking.inconsistent_frames import InconsistentFrames
from app.control.tracking.observing import Observing
from app.control.tracking.pose_checks import PoseChecks
from app.control.tracking.ranges import Ranges
from app.control.tracking.reasons import Reasons
from app.control.tracking.tracking import Tracking
from app.control.view.floor import FloorEditing
from app.control.view.view_3d import View3dSettings
from app.control.view.visibility import PeopleVisibility
from app.runtime.kernel_compiler import KernelCompiler
from app.session.frame_cache import FrameCache
from app.state.state import State
from app.storage.saver import Saver
from tracker.body.model import BodyModel
from tracker.compute.kernel_cache import STAGES
from tracker.session.session import Session


class Controller:
    """The parts that change the state of one open session, and read access to that state."""

    def __init__(
        self,
        session: Session,
        saver: Saver,
        frames: FrameCache,
        compiler: KernelCompiler | None = None,
        host: "Controller | None" = None,
    ) -> None:
        """Show the first frame.

        Args:
            session: to open.
            saver: stores its poses.
            frames: gives images and evidence.
            compiler: compiles missing kernels, which are not called before; None to compile each at its first call.
            host: of the session, for one more person who works on it: with a state of their own, while the parts that
                belong to the session are the host's.
        """
        self.frames, self._is_host = frames, host is None
        """Images and evidence of the footage."""
        compiled = frozenset(STAGES) if compiler is None else compiler.stages
        if host is not None:
            compiled = host.state.compiled
        lock = None if host is None else host.lock
        self.session_state = session_state = SessionState(session, saver, frames, compiled, lock)
        """State of the session, and its stores: all parts share it."""
        runs, turns = SearchRuns(), saver.shared.turns
        turns.add(saver.moves, lambda: saver.author or "the host", lambda: session_state.state)
        self.activities = activities = Activities(session_state.lock, session_state.show_frame, turns, saver.moves)
        """Stops what is at work."""
        self.search = SearchRunner(session_state, runs, activities)
        """Searches the shown frame."""
        self.tracking = Tracking(session_state, activities)
        """Tracks from the shown frame."""
        self.finding: FindingPeople = (
            host.finding if host else FindingPeople(session_state, activities, self.tracking, runs)
        )
        """Finds people whom nobody has placed, and tracks them."""
        self.ranges = Ranges(session_state, self.tracking, activities)
        """Interpolates, clears, marks and tracks ranges of frames."""
        self.comparing_runs = ComparingRuns(session_state)
        """Compares the poses of a range with those that they replaced."""
        self.held_points = HeldPoints(session_state, activities)
        """Holds points in place during drags."""
        self.dragging = Dragging(session_state, activities, self.held_points)
        """Drags points and parts."""
        self.pinning = Pinning(session_state, activities)
        """Sets pins, and fits people to them."""
        self.replay = Replay(session_state, runs, activities)
        """Replays and compares recorded searches."""
        self.comparing = Comparing(session_state)
        """Shows the poses before the last fit or search."""
        activities.add_gesture(self.comparing.leave)
        self.navigation = Navigation(session_state, activities, self.search, self.tracking)
        """Chooses the shown frame and the selection."""
        self.stored_poses = StoredPoses(session_state)
        """Reads the stored poses."""
        self.pose_edits = PoseEdits(session_state, activities)
        """Changes poses by values, steps and whole operations."""
        self.dof_locks = DofLocks(session_state, activities)
        """Locks degrees of freedom."""
        self._pose_checks = PoseChecks(session_state)
        self.alternatives = Alternatives(session_state, activities, self._pose_checks.check)
        """Replaces poses by their alternatives."""
        self.other_copies = OtherCopies(session_state, activities, self._pose_checks.check)
        """Compares with another copy of the session."""
        self.body_sizes = BodySizeEditing(session_state, runs, activities)
        """Edits the sizes of bodies."""
        self.body_acquisition: BodyAcquisition = host.body_acquisition if host else BodyAcquisition(session_state)
        """Acquires the sizes of bodies from the footage."""
        self.calibrating: Calibrating = (
            host.calibrating if host else Calibrating(session_state, activities, self.tracking)
        )
        """Checks and corrects the cameras."""
        self.clocks: Clocks = host.clocks if host else Clocks(session_state, activities, self.calibrating)
        """Changes and estimates the clocks of the cameras."""
        self.observing: Observing = host.observing if host else Observing(session_state, activities, self.finding)
        """Shows, judges and imports observations of other programs."""
        self.annotating: Annotating = Annotating(session_state, activities, None if host is None else host.annotating)
        """Plans tasks, decides on them, and comments."""
        self.proposing = Proposing(session_state)
        """Proposes the next best click."""
        restored = () if host else (self.body_sizes.follow, self.calibrating.follow)
        follow = (*restored, self.held_points.follow, self.tracking.follow_history)
        self.history = History(session_state, activities, follow)
        """Moves along the history."""
        self.cost_landscape = CostLandscapes(session_state)
        """Samples the cost along one degree of freedom."""
        self.cost_map = CostMaps(session_state)
        """Samples the cost over two degrees of freedom."""
        self.reasons = Reasons(session_state)
        """Explains the shown pose by what each view shows of each part."""
        self.floor: FloorEditing = host.floor if host else FloorEditing(session_state, activities)
        """Sets the floor."""
        self.visibility = PeopleVisibility(session_state)
        """Shows, hides and dims people."""
        self.view_3d = View3dSettings(session_state)
        """Chooses what the 3-D view shows."""
        self.inconsistent_frames: InconsistentFrames = (
            host.inconsistent_frames if host else InconsistentFrames(session_state)
        )
        """Finds frames and keyframes that disagree with those around them."""
        self.tracking.after_run = self.comparing_runs.compare_run
        self._taking_over = PeerChanges(session_state, self.search.forget_paused)
        self._following: FollowingHost | None = None
        if host is not None:
            self._following = FollowingHost(session_state, host.session_state, activities.finish_gestures)
            return
        self._footage_scan = FootageScan(session_state)
        self._save_retry = SaveRetry(session_state)
        self._compiling = None if compiler is None else KernelWarmup(session_state, compiler)

    def beside(self, author: str, writes: bool) -> "Controller":
        """Return a controller for one more person who works on the session; it is closed before this one.

        Args:
            author: their name, by which they undo their own edits.
            writes: whether they may change what is stored.
        """
        own = self.session_state
        with own.lock:
            if writes:
                own.saver.shared.note_several()
            return Controller(own.session, own.saver.beside(author), self.frames, None, self)

    @property
    def author(self) -> str:
        """Name of the one who works with this controller."""
        return self.session_state.saver.author

    @property
    def state(self) -> State:
        """The present state."""
        return self.session_state.state

    @property
    def session(self) -> Session:
        """The open session, with the present body of each person."""
        return self.session_state.session

    @property
    def models(self) -> tuple[BodyModel, ...]:
        """The bodies in which people are shown now."""
        return self.session_state.models

    @property
    def lock(self) -> threading.RLock:
        """The lock under which the state and the stored poses change. Hold it only briefly."""
        return self.session_state.lock

    def session_of(self, state: State) -> Session:
        """Return the session with each person in the body that a state shows, for drawing."""
        people = zip(self.session.people, state.models, strict=True)
        return replace(self.session, people=tuple(replace(p, model=m) for p, m in people))

    def active_dofs(self) -> list[NDArray[np.bool_]]:
        """Return for each person which degrees of freedom are not locked, (n_dofs,)."""
        return [self.session_state.active_dofs(person) for person in range(len(self.models))]

    def subscribe(self, view: Callable[[State], None], *fields: str) -> Callable[[], None]:
        """See `SessionState.subscribe`."""
        return self.session_state.subscribe(view, *fields)

    def close(self) -> None:
        """Stop all work and save; the controller must not be used afterwards. The host's is closed last."""
        if self._is_host:
            self.body_acquisition.stop()
            self.finding.stop()
            self.calibrating.close()
            self.clocks.stop()
            self.observing.stop()
            self._save_retry.close()
        with self.activities.editing():
            self.history.save()
        self._taking_over.close()
        if self._following is not None:
            self._following.close()
        self.session_state.saver.shared.turns.remove(self.session_state.saver.moves)
        for part in (
            self.dragging, self.annotating, self.proposing, self.comparing_runs, self.other_copies,
            self.cost_landscape, self.cost_map, self.reasons, self._pose_checks,
        ):  # fmt: skip
            part.close()
        self.frames.forget(self.session_state)
        if self._is_host:
            self._close_session()

    def _close_session(self) -> None:
        """Close what belongs to the session."""
        self.inconsistent_frames.close()
        self._footage_scan.close()
        if self._compiling is not None:
            self._compiling.close()
        self.frames.close()
