"""Drive a recording to tracked poses from whatever is there: find, acquire, track out from the start, smooth, assess.

Command line, page and batch call `run_chain` with a plan, an open session that stores the results, and a sink that
shows them. Each stage is stored when it is done. The same plan goes on where it was stopped.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from typing import Protocol

from tracker.errors import Remedy, TrackerError
from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording
from tracker.initialization.first_pose import FirstPoses
from tracker.pipeline.find_people import FindSettings, FoundPeople, find_people, sentences, store_found
from tracker.pipeline.stored_run import TrackPlan, stored_run
from tracker.pipeline.track_session import Step, TrackSession
from tracker.session.lock import SessionLock
from tracker.session.relink import require_files
from tracker.session.session import Session
from tracker.store.annotation_store import AnnotationStore

_FOLLOWED = ("tracked", "interpolated")
"""Sources of poses that follow from those of other frames, so that no run starts from them."""


class Sink(Protocol):
    """Receives progress and results of a chain. Raise from any method to stop it; what was stored stays."""

    def report(self, stage: str, share: float, text: str = "", /) -> None:
        """Receive the progress of finding and acquiring; see `tracker.compute.progress.Report`."""

    def show(self, frame: int, found: FirstPoses | None) -> None:
        """Receive a frame that is tried: at first with None, then with the poses if some were found on it."""

    def take(self, run: TrackSession, step: Step) -> None:
        """Receive a step of the run that tracks, after its results are stored."""


class OpenSession(Protocol):
    """A session whose poses a chain reads and stores."""

    @property
    def session(self) -> Session:
        """The session with the present bodies."""

    @property
    def observer(self) -> Observer:
        """Gives the evidence of all cameras."""

    def sources(self, person: int) -> Mapping[int, str]:
        """Return the source of the pose of a person on each frame that has one."""

    def store_found(self, found: FoundPeople) -> None:
        """Store people who were found."""

    def track(self, plan: TrackPlan, sink: Sink) -> TrackPlan:
        """Track and store the poses; return the plan."""


def run_chain(plan: TrackPlan, find: FindSettings, opened: OpenSession, sink: Sink) -> TrackPlan:
    """Find the people who have no pose, and track out from there in both directions everybody who has a pose there.

    Args:
        plan: what to track, without a start; frames ascending.
        find: how people are found.
        opened: the session.
        sink: receives progress and results.

    Returns:
        The plan with the frame that the run went out from.

    Raises:
        TrackerError: no frame shows the people well enough, or people are placed on different frames alone.
    """
    session = opened.session
    missing = unplaced(opened, plan.people)
    if missing:
        found = find_people(session, opened.observer, missing, plan.frames, find, sink.report, sink.show)
        opened.store_found(found)
        for sentence in sentences(opened.session, found):
            sink.report("found", 1.0, sentence)
        start = found.frame
    else:
        start = start_frame([opened.sources(i) for i in plan.people], plan.frames)
    sink.report("tracking", 1.0, f"tracking from frame {start} to {plan.frames[0]}, and to {plan.frames[-1]}")
    people = tuple(i for i in plan.people if start in opened.sources(i))
    return opened.track(replace(plan, people=people, start=start), sink)


def unplaced(opened: OpenSession, people: Sequence[int]) -> tuple[int, ...]:
    """Return the people who have no pose on any frame."""
    return tuple(i for i in people if not opened.sources(i))


def start_frame(people: Sequence[Mapping[int, str]], frames: Sequence[int]) -> int:
    """Return the first frame on which everybody has a pose that a person set, or that was found; else a tracked one.

    Args:
        people: for each person the source of the pose on each frame.
        frames: that may be used, ascending.

    Raises:
        TrackerError: there is none.
    """
    placed = [k for k in frames if all(k in own for own in people)]
    if not placed:
        raise TrackerError("expected a frame on which all people have a pose, found none", Remedy("common_start"))
    return min(placed, key=lambda k: (sum(own[k] in _FOLLOWED for own in people), k))


class StoredSession:
    """A session on disk that no page has open."""

    def __init__(self, session: Session, store: AnnotationStore, observer: Observer) -> None:
        """Use a locked session and its open store; see `open_stored_session`."""
        self.session, self.observer, self._store = session, observer, store
        self.plan: TrackPlan | None = None
        """The last plan that was tracked."""
        self.run: TrackSession | None = None
        """The results of that."""

    @property
    def backup_error(self) -> str | None:
        """Why the store could not be backed up; None if it could."""
        return self._store.backup_error

    def sources(self, person: int) -> Mapping[int, str]:
        """See `OpenSession.sources`."""
        return {row.frame: row.source for row in self._store.frames(self.session.people[person].name)}

    def store_found(self, found: FoundPeople, label: str = "find people") -> None:
        """See `OpenSession.store_found`; the label is that of the entry of the history."""
        self.session = store_found(self.session, self._store, found, label)

    def track(self, plan: TrackPlan, sink: Sink) -> TrackPlan:
        """See `OpenSession.track`."""
        used = {c.camera.name for c in plan.sources(self.session)}
        cameras = [i for i, c in enumerate(self.observer.cameras) if c.camera.name in used]
        with stored_run(self.session, self._store, self.observer.with_cameras(cameras), plan) as self.run:
            self.plan = plan
            sink.report("tracking", 1.0)
            for step in self.run.steps():
                self.run.take(step)
                sink.take(self.run, step)
        return plan


@contextmanager
def open_stored_session(session: Session) -> Iterator[StoredSession]:
    """Lock a session and open its store and footage.

    Raises:
        TrackerError: another program has it open, or footage is missing.
    """
    require_files(session)
    with (
        SessionLock(session.folder),
        closing(AnnotationStore(session.annotations_path)) as store,
        Recording(session.cameras) as recording,
    ):
        yield StoredSession(session, store, Observer(session.cameras, recording))
