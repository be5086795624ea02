"""Drive a recording to tracked poses from whatever is there: find, acquire, track out from the start, assess.

Command line, page and batch call `find_and_track` with a plan, an open session that stores the results, and a sink that
shows them. Each stage is stored when it is done. The same plan goes on where it was stopped.
"""

from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

from tracker.body.model import PosedBody
from tracker.compute.progress import Report, part_of
from tracker.errors import Remedy, TrackerError
from tracker.estimation.acquisition.from_contours import Acquisition, AcquisitionSettings
from tracker.estimation.acquisition.from_keypoints import PersonObservations
from tracker.estimation.fitting.gauss_newton import PointTargets
from tracker.estimation.initialization.first_pose import FirstPoses
from tracker.estimation.initialization.frame_trials import Trying
from tracker.evidence.observer import Observer, open_observer
from tracker.formats.model_toml import has_preset_proportions
from tracker.pipeline.body_acquisition import acquire_body, acquisition_sentence, posed_frames, store_body
from tracker.pipeline.calibration_revisions import follow_history, outdated_sizes
from tracker.pipeline.find_people import FINDING, FindSettings, find_people, sentences, store_found
from tracker.pipeline.keyframe_stretches import KeyframeStretch, stretches_to_track
from tracker.pipeline.keypoint_evidence import (
    SEEN_BODIES,
    learn_seen_bodies,
    read_points,
    seen_bodies_record,
    seen_joints,
    with_keypoints,
)
from tracker.pipeline.keypoint_poses import store_keypoint_poses
from tracker.pipeline.stored_run import TrackPlan, is_interrupted, stored_run
from tracker.pipeline.track_session import Step, TrackSession
from tracker.session.lock import SessionLock
from tracker.session.relink import require_files
from tracker.session.session import Session
from tracker.session.store.annotation_store import AnnotationStore

ACQUIRING = "acquiring sizes"
"""The stage of the chain after the search for people."""
FOLLOWED = ("tracked", "interpolated")
"""Sources of poses that follow from those of other frames, so that no run starts from them."""


@dataclass(frozen=True)
class ChainPlan:
    """Stages of a chain. The same plan goes on where it was stopped."""

    track: TrackPlan
    """Whom to track on which frames, without a start; frames ascending."""
    find: FindSettings | None = field(default_factory=FindSettings)
    """How people who have no pose are found; None if nobody is looked for."""
    acquire: tuple[int, ...] = ()
    """People whose sizes are acquired from the contours, unless they have sizes of their own under this calibration."""


class Sink(Protocol):
    """Receives progress and results of a chain. Raise from any method to stop it; what was stored stays."""

    def report(self, stage: str, share: float, text: str = "", /) -> None:
        """Receive the progress of finding or of acquiring; see `tracker.compute.progress.Report`."""

    def show(self, trying: Trying) -> None:
        """Receive how far the search for people is, from several threads; see `Show`, also for how to end it."""

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

    def store_found(self, found: FirstPoses) -> None:
        """Store people who were found."""

    def store_body(self, person: int, acquired: Acquisition, start: int) -> None:
        """Make an acquired body the present one of a person, and retarget the pose of the start to it."""

    def store_setting(self, name: str, value: Any) -> None:
        """Store a setting of the session."""

    def setting(self, name: str, default: Any) -> Any:
        """Return a setting of the session."""

    def outdated_sizes(self) -> list[str]:
        """Return the names of people who have sizes of an earlier calibration."""

    def is_interrupted(self, plan: TrackPlan) -> bool:
        """Return whether this run was interrupted, so that it goes on there."""

    def track(self, plan: TrackPlan, sink: Sink) -> TrackPlan:
        """Track and store the poses; return the plan."""


def find_and_track(plan: ChainPlan, opened: OpenSession, sink: Sink) -> TrackPlan:
    """Find the people who have no pose, acquire sizes, and track out from there everybody who has a pose there.

    Args:
        plan: what to do.
        opened: the session.
        sink: receives progress and results.

    Returns:
        The plan of tracking with the frame that the run went out from.

    Raises:
        TrackerError: see `find_and_acquire`.
    """
    return opened.track(find_and_acquire(plan, opened, sink), sink)


def find_and_acquire(plan: ChainPlan, opened: OpenSession, sink: Sink) -> TrackPlan:
    """Find the people who have no pose, and acquire sizes; nothing is tracked yet.

    Args:
        plan: what to do.
        opened: the session.
        sink: receives progress and results.

    Returns:
        The plan of tracking everybody who has a pose on the frame that the run is to go out from.

    Raises:
        TrackerError: no frame shows the people well enough, people are placed on different frames alone, or somebody
            has no pose and nobody is looked for.
    """
    track = plan.track
    missing = unplaced(opened, track.people)
    if missing and plan.find is None:
        names = ", ".join(f"'{opened.session.people[i].name}'" for i in missing)
        raise TrackerError(f"expected a pose of {names}, found none", Remedy("find_or_place"))
    if missing and plan.find is not None:
        poses = find_people(opened.session, opened.observer, missing, track.frames, plan.find, sink.report, sink.show)
        sink.report(FINDING, 1.0)  # the last chance to stop before anything is stored
        opened.store_found(poses)
        for sentence in sentences(opened.session, poses):
            sink.report(FINDING, 1.0, sentence)
        start = poses.frame
    else:
        start = start_frame([opened.sources(i) for i in track.people], track.frames)
    people = tuple(i for i in track.people if start in opened.sources(i))
    track = replace(track, people=people, start=start)
    if not opened.is_interrupted(track):  # a run goes on in the bodies in which it was begun
        of_sizes = part_of(sink.report, 0.0, 1.0, ACQUIRING)
        points = {} if track.keypoints is None else read_points(opened.session, track.keypoints)
        acquired = _acquire([i for i in plan.acquire if i in people], track, points, opened, of_sizes)
        if track.keypoints is not None:
            session, before = opened.session, opened.setting(SEEN_BODIES, {})
            seen = learn_seen_bodies(session, points, acquired)
            opened.store_setting(SEEN_BODIES, seen_bodies_record(session, track.keypoints, seen, before))
    sink.report("tracking", 1.0, f"tracking from frame {start} to {track.frames[0]}, and to {track.frames[-1]}")
    return track


def _acquire(
    people: Sequence[int],
    track: TrackPlan,
    points: Mapping[int, PersonObservations],
    opened: OpenSession,
    report: Report,
) -> dict[int, dict[int, PosedBody]]:
    """Acquire the sizes of those people who have none of their own, or those of an earlier calibration, one after the
    other, and store each; return their bodies by frame."""
    assert track.start is not None
    out, outdated, known_people = dict[int, dict[int, PosedBody]](), opened.outdated_sizes(), opened.session.people
    people = [i for i in people if has_preset_proportions(known_people[i].model) or known_people[i].name in outdated]
    settings = AcquisitionSettings(rounds=2)  # again with acquired sizes where few frames were good with the preset's
    whole = range(track.frames[0], track.frames[-1] + 1)
    for number, person in enumerate(people):
        session, part = opened.session, part_of(report, number / len(people), (number + 1) / len(people))
        known = posed_frames(session, person, whole, track.start)
        observer, joints = opened.observer, dict[int, PointTargets]()
        if points:
            observer = with_keypoints(session, observer, points)
        if person in points:
            joints = seen_joints(session.people[person].model, points[person], settings.n_frames)
        acquired = acquire_body(session, observer, person, whole, settings, part, known, joints)
        if acquired.is_better:
            opened.store_body(person, acquired, track.start)
            poses = zip(acquired.frames, acquired.poses, strict=True)
            out[person] = {k: PosedBody(acquired.body, pose) for k, pose in poses}
        part("", 1.0, f"{session.people[person].name}: {acquisition_sentence(acquired)}")
    return out


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
        elsewhere = sorted(set.intersection(*(set(own) for own in people)))
        if elsewhere:
            raise TrackerError(
                f"expected a frame of {min(frames)} to {max(frames)} on which all people have a pose, found frame "
                f"{elsewhere[0]}",
                Remedy("start_beyond"),
            )
        raise TrackerError("expected a frame on which all people have a pose, found none", Remedy("common_start"))
    return min(placed, key=lambda k: (sum(own[k] in FOLLOWED for own in people), k))


class StoredSession:
    """A session on disk that no page has open."""

    def __init__(self, session: Session, store: AnnotationStore, observer: Observer) -> None:
        """Use a locked session and its open store; see `open_stored_session`."""
        self.session, self.observer, self._store = session, observer, store
        self.plan: TrackPlan | None = None
        """The last plan that was tracked."""
        self.is_changed = False
        """Whether people or sizes were stored."""
        self.run: TrackSession | None = None
        """The results of that."""

    @property
    def backup_error(self) -> str | None:
        """Why the store could not be backed up; None if it could."""
        return self._store.backup_error

    def sources(self, person: int) -> Mapping[int, str]:
        """See `OpenSession.sources`."""
        return {row.frame: row.source for row in self._store.frames(self.session.people[person].name)}

    def store_found(self, found: FirstPoses, label: str = "find people") -> None:
        """See `OpenSession.store_found`; the label is that of the entry of the history."""
        self.session = store_found(self.session, self._store, found, label)
        self.is_changed = True

    def store_body(self, person: int, acquired: Acquisition, start: int) -> None:
        """See `OpenSession.store_body`."""
        label = f"acquire sizes of {self.session.people[person].name}"
        poses = dict(zip(acquired.frames, acquired.poses, strict=True))
        self.session = store_body(self.session, self._store, person, acquired.body, poses, label, [start])
        self.is_changed = True

    def store_setting(self, name: str, value: Any) -> None:
        """See `OpenSession.store_setting`."""
        self._store.set_setting(name, value)

    def setting(self, name: str, default: Any) -> Any:
        """See `OpenSession.setting`."""
        return self._store.setting(name, default)

    def outdated_sizes(self) -> list[str]:
        """See `OpenSession.outdated_sizes`."""
        return outdated_sizes(self.session, self._store)

    def is_interrupted(self, plan: TrackPlan) -> bool:
        """See `OpenSession.is_interrupted`."""
        return is_interrupted(self._store, plan)

    def store_keypoint_poses(self, people: Sequence[int], frames: Sequence[int], name: str) -> dict[int, int]:
        """Store poses by key points alone; see `keypoint_poses.store_keypoint_poses`."""
        return store_keypoint_poses(self.session, self._store, people, frames, name)

    def stretches_to_track(self, plan: TrackPlan) -> dict[tuple[int, ...], list[KeyframeStretch]]:
        """Return the stretches between keyframes within the frames of a plan; see `stretches_to_track`."""
        within = range(min(plan.frames), max(plan.frames) + 1)
        return stretches_to_track(self.session, self._store, plan.people, within)

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
def open_stored_session(session: Session) -> Generator[StoredSession, None, None]:
    """Lock a session and open its store and footage.

    Raises:
        TrackerError: another program has it open, or footage is missing.
    """
    require_files(session)
    with SessionLock(session.folder), AnnotationStore(session.annotations_path) as store:
        session = follow_history(session, store)
        with open_observer(session.cameras) as observer:
            yield StoredSession(session, store, observer.at_nearest_times())
