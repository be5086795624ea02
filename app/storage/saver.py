"""Read and write the annotations of an open session: poses, pins, settings, history."""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import asdict, replace
from itertools import product
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from app.state.people import ShownPose
from app.state.state import State
from app.storage import rescue
from app.storage.frame_index import FrameIndex
from app.storage.history_moves import HistoryMoves
from app.storage.pose_origins import PoseOrigin, keyframes_by_annotator, read_origin
from app.storage.revisions import ModelRevisions
from app.storage.shared_storage import SharedStorage
from app.storage.shown_records import is_same, main_source, sources_of, with_marks_of
from tracker.annotation.plan import is_disputed
from tracker.errors import SessionError
from tracker.formats.model_toml import format_model
from tracker.geometry.arrays import Array
from tracker.geometry.triangulation import PointObservation
from tracker.pipeline.calibration_revisions import follow_history, outdated_frames, outdated_sizes
from tracker.pipeline.marked_points import with_drag_ends, without_moved
from tracker.pipeline.tracked_changes import keyframes_of
from tracker.session.session import Session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.calibration_log import present_revision
from tracker.session.store.records import (
    SEEN,
    Alternative,
    Change,
    FramePose,
    FrameRow,
    Pin,
    PinChange,
    PoseChange,
    PoseRecord,
)

T = TypeVar("T")

_BY_HAND = ("manual", "pinned", "fitted")
"""Sources of edits by a person, which make a frame a keyframe; a fit that a person starts is one of them."""
_BY_PROGRAM = ("searched", "fitted")
"""Sources whose settings are those of a program."""
_SAME_PX = 1e-6
"""Pins nearer than this are equal: the rounding of adding and removing lens distortion."""
_READ_FRAMES = 2000
"""Maximum number of frames read in one query."""


class Saver:
    """The annotations of one open session. The caller holds the session's lock."""

    def __init__(
        self, session: Session, store: AnnotationStore, author: str = "", shared: SharedStorage | None = None
    ) -> None:
        """List the frames that have poses, and store the present bodies as revisions.

        Args:
            session: the open session.
            store: its annotations.
            author: of the edits, for the history.
            shared: of the savers of other people on the session; None for the first one.
        """
        self.shared = shared or SharedStorage(session, store)
        """What all savers of the session share."""
        self._session, self._store, self._queue = session, store, self.shared.queue
        self._author = author
        self.moves = HistoryMoves(session, self.shared, author)
        """Undo and redo."""

    def beside(self, author: str) -> "Saver":
        """Return the saver of another person who works on the session."""
        return Saver(self._session, self._store, author, self.shared)

    @property
    def revisions(self) -> ModelRevisions:
        """The bodies that poses were made with."""
        return self.shared.revisions

    @property
    def index(self) -> FrameIndex:
        """The frames that have poses."""
        return self.shared.index

    @property
    def error(self) -> str | None:
        """Why an edit is not on disk; None if all are."""
        return self._queue.error

    @property
    def store(self) -> AnnotationStore:
        """The annotations, for the plan, decisions and comments, which are no part of the history."""
        return self._store

    @property
    def author(self) -> str:
        """Name of the author of the edits."""
        return self._author

    def set_body_models(self, session: Session) -> None:
        """Continue with a session whose people have other bodies, which new poses belong to."""
        self._session = session
        self.revisions.set_body_models(session)

    def follow_session(self, session: Session) -> None:
        """Continue with a session whose bodies or cameras another person has changed."""
        self._session = session

    def setting(self, key: str, default: Any = None) -> Any:
        """Return a setting stored with the session: any JSON value."""
        return self._store.setting(key, default)

    def store_setting(self, key: str, value: Any) -> None:
        """Store a setting with the session; it is no part of the history."""
        self._store.set_setting(key, value)

    def change_cameras(self, change: Callable[[Session, AnnotationStore], Session]) -> Session:
        """Return the session with the cameras that a function stores as an entry of the history.

        Raises:
            SessionError: a queued edit still cannot be written, or the calibration cannot be.
        """
        self.retry()
        if self.error is not None:
            raise SessionError(f"the cameras cannot change while an edit is not saved: {self.error}")
        return self._with_cameras(change(self._session, self._store))

    def follow_calibration(self) -> Session:
        """Return the session with the calibration that belongs to its history; the same session if it has it.

        Raises:
            SessionError: the calibration cannot be written.
        """
        found = follow_history(self._session, self._store)
        return found if found is self._session else self._with_cameras(found)

    def _with_cameras(self, found: Session) -> Session:
        self._session = replace(self._session, cameras=found.cameras)
        return self._session

    @property
    def calibration_revision(self) -> int:
        """Number of the present calibration; 1 if it has never been changed."""
        return present_revision(self._store) or 1

    def frames_of_earlier_calibration(self) -> dict[int, tuple[int, ...]]:
        """Return the frames with poses that were made with an earlier calibration, by index of the person."""
        found = outdated_frames(self._session, self._store)
        return {i: tuple(sorted(found[p.name])) for i, p in enumerate(self._session.people) if p.name in found}

    def outdated_sizes(self) -> list[str]:
        """Return the names of people who have sizes of an earlier calibration."""
        return outdated_sizes(self._session, self._store)

    def pose(self, person: int, frame: int) -> ShownPose | None:
        """Return the stored pose of a person on a frame; None if there is none or its body has other values."""
        record = self.record(person, frame)
        if record is None or not self.revisions.fits(person, record.model_revision):
            return None
        return ShownPose(
            record.values,
            main_source(record.sources),
            record.status,
            record.remark,
            record.part_costs_px,
            revision=record.model_revision,
            alternatives=self._offered(person, frame, record),
            errors=record.errors,
            trace=record.trace,
        )

    def record(self, person: int, frame: int) -> PoseRecord | None:
        """Return the pose of a person on a frame with all its data: the queued one, else the stored one."""
        name = self._session.people[person].name
        queued = self._queue.pose(name, frame)
        return self._store.pose(name, frame) if queued is None else queued.pose

    def alternatives(self, person: int, frame: int) -> tuple[Alternative, ...]:
        """Return the alternatives to a stored pose, best first, without those of a body with other values."""
        name = self._session.people[person].name
        queued = self._queue.pose(name, frame)
        stored = self._store.alternatives(name, frame) if queued is None else queued.alternatives
        return tuple(a for a in stored if self.revisions.fits(person, a.model_revision))

    def _offered(self, person: int, frame: int, record: PoseRecord) -> tuple[Array, ...]:
        """Return the alternatives that are shown: of a keyframe only while two merged copies disagree about it."""
        found = tuple(a.values for a in self.alternatives(person, frame))
        is_decided = (
            record.keyframe and found and not is_disputed(self._store, self._session.people[person].name, frame)
        )
        return () if is_decided else found

    def origin(self, person: int, frame: int) -> PoseOrigin | None:
        """Return where the stored pose of a person comes from; None if there is none, or it is not on disk."""
        record = self._store.pose(self._session.people[person].name, frame)
        if record is None:
            return None
        body = self.revisions.body(record.model_revision)
        return read_origin(self._store, self._session.people[person].name, frame, body)

    def keyframes_by_annotator(self) -> tuple[dict[str, tuple[int, ...]], ...]:
        """Return for each person the keyframes by the annotator who set or marked them last, ascending."""
        return keyframes_by_annotator(self._store, [p.name for p in self._session.people])

    def pose_now(self, person: int, frame: int) -> Array | None:
        """Return the stored pose of a person, (n_values,), retargeted to the present body."""
        shown = self.pose(person, frame)
        return None if shown is None else self.revisions.in_present_body(person, shown.values, shown.revision)

    def nearest_pose(self, person: int, frame: int) -> Array | None:
        """Return the stored pose nearest in time, (n_values,), in the present body; None if there is none."""
        nearest = self.index.nearest(person, frame)
        return None if nearest is None else self.pose_now(person, nearest)

    def keyframes(self, frames: Collection[int]) -> dict[int, dict[int, Array]]:
        """Return the poses of keyframes, (n_values,), in the present bodies, by frame and person."""
        found = keyframes_of(self._store, self._session.people, frames)
        now = {frame: {p: self.pose_now(p, frame) for p in people} for frame, people in found.items()}
        return {frame: {p: v for p, v in people.items() if v is not None} for frame, people in now.items()}

    def pose_rows(self, person: int, frames: Sequence[int]) -> list[FramePose]:
        """Return the stored poses of some frames, ascending. Needs no lock."""
        name, found, first = self._session.people[person].name, [], 0
        for i, frame in enumerate(frames):
            # Read in pieces: a writer waits for one piece at most.
            if i + 1 == len(frames) or frames[i + 1] != frame + 1 or i - first >= _READ_FRAMES:
                found += self._store.frame_poses(name, range(frames[first], frame + 1))
                first = i + 1
        return found

    def replaced(self, person: int, frames: range) -> dict[int, tuple[PoseRecord, PoseRecord]]:
        """Return the stored pose of each frame of a range and the pose that it replaced, by frame, ascending.

        Poses of a body with other values are left out, and frames whose pose replaced none.
        """
        name = self._session.people[person].name
        now, former = self._store.poses(name, frames), self._store.former_poses(name, frames)
        pairs = {frame: (now[frame], former[frame]) for frame in former}
        return {f: p for f, p in pairs.items() if all(self.revisions.fits(person, r.model_revision) for r in p)}

    def rows(self, person: int, frames: range) -> list[FrameRow]:
        """Return the marks and statuses of the frames of a range that have a pose, ascending."""
        return self._store.frames(self._session.people[person].name, frames)

    def pins(self, person: int, frame: int) -> tuple[PointObservation, ...]:
        """Return the stored pins of a person on a frame, undistorted px, without those of unknown cameras or points."""
        info, cameras = self._session.people[person], self._session.cameras
        index = {c.camera.name: i for i, c in enumerate(cameras)}
        stored: dict[tuple[str, str], tuple[float, float] | None]
        stored = {(p.point, p.camera): p.position_px for p in self._store.pins(info.name, frame)}
        stored |= {(c.point, c.camera): c.position_px for c in self._queue.pins(info.name, frame)}
        found = []
        for pin in [Pin(*key, position) for key, position in sorted(stored.items()) if position is not None]:
            if pin.camera in index and pin.point in info.model.point_names:
                camera = index[pin.camera]
                u, v = cameras[camera].camera.undistort_points(np.array(pin.position_px))
                found.append(PointObservation(pin.point, camera, (float(u), float(v))))
        return tuple(found)

    def save(
        self, state: State, label: str, source: str, amend: int | None, vouched: Collection[int] | None = None
    ) -> int | None:
        """Write the pins of a state, and its poses that differ from the stored ones; drafts are left out.

        Args:
            state: with the poses and pins.
            label: of the entry of the history.
            source: of the values that changed, unless the shown pose has sources of its own.
            amend: the entry of the history to add to; None makes a new one.
            vouched: indices of the people whom the edit is about; None for all. Of the others only the values change:
                they become no keyframes, and doubts about them stay.

        Returns:
            The entry that later calls can amend; None if there was nothing to write. If writing fails, `error` says
            why.
        """
        changes: list[Change] = self._pin_changes(state)
        for person, (shown, revision) in enumerate(zip(state.people, state.revisions, strict=True)):
            stored = self._readable(self.record, person, state.frame, None)
            is_stored = stored is not None and is_same(stored, shown, revision) and not shown.seen
            if shown.source is None or is_stored:
                continue
            sources = sources_of(stored, shown, source)
            record = PoseRecord(
                shown.values,
                sources,
                revision,
                keyframe=source in _BY_HAND or (stored is not None and stored.keyframe),
                cost_px=state.cost_px,
                settings=self._settings_of(
                    person, stored, shown, source, asdict(state.settings) if source in _BY_PROGRAM else {}
                ),
                view_costs_px=state.view_costs_px,
            )
            if vouched is not None and person not in vouched:
                record = with_marks_of(stored, record)
            changes.append(PoseChange(self._session.people[person].name, state.frame, record))
        return self.write(f"{label}, frame {state.frame}", changes, amend, by_program=False)

    def with_stored_sources(self, state: State) -> tuple[ShownPose, ...]:
        """Return the people of a state with the sources that are stored of their poses, as `pose` returns them.

        A source that is given to `save` applies to the values that changed; the others keep theirs.
        """
        people = []
        for person, (shown, revision) in enumerate(zip(state.people, state.revisions, strict=True)):
            stored = None if shown.source is None else self._readable(self.record, person, state.frame, None)
            is_stored = stored is not None and is_same(stored, shown, revision)
            source = main_source(stored.sources) if stored is not None and is_stored else shown.source
            people.append(shown if source == shown.source else replace(shown, source=source))
        return tuple(people)

    def write(
        self, label: str, changes: Sequence[Change], amend: int | None, by_program: bool, even_empty: bool = False
    ) -> int | None:
        """Commit changes, or add them to an entry of the history.

        Args:
            label: of the entry of the history.
            changes: of poses, their marks, or pins.
            amend: the entry of the history to add to; None makes a new one.
            by_program: leave keyframes unchanged.
            even_empty: make an entry without changes too, for data that is stored elsewhere.

        Returns:
            The entry that later calls can amend; None if there was nothing to write. Changes that cannot be written
            are queued, and `error` says why.

        Raises:
            TurnError: somebody else works on one of the poses.
        """
        if not (changes or even_empty):
            return amend
        self._require_turns(changes)
        edit, written = self._queue.write(label, changes, amend, by_program, self._author)
        self.shared.changed(self.moves, written)
        return edit

    def retry(self, patient: bool = True) -> None:
        """Try again to write the queued edits; if that fails, `error` says why.

        Args:
            patient: wait for another program that has locked the file.
        """
        self.shared.changed(self.moves, self._queue.retry(patient))

    def require_editable(self, people: Iterable[int], frames: Iterable[int]) -> None:
        """Check that nobody else works on poses of people, given by index, on frames.

        Raises:
            TurnError: somebody does.
        """
        self.shared.turns.require(self.moves, product(people, frames))

    def _require_turns(self, changes: Sequence[Change]) -> None:
        indices = {p.name: i for i, p in enumerate(self._session.people)}
        self.shared.turns.require(self.moves, ((indices[c.person], c.frame) for c in changes if c.person in indices))

    def rescue(self) -> Path | None:
        """Keep the queued edits in a rescue file outside of the session.

        Returns:
            Its path; None if no edit is queued.

        Raises:
            SessionError: it cannot be written anywhere.
        """
        edits = self._queue.edits
        if not edits:
            return None
        models = {r: format_model(self.revisions.body(r)) for r in rescue.revisions_of(edits)}
        return rescue.write(self._session.folder, self._store, edits, models, self._author, self.error or "")

    def _readable(self, read: Callable[[int, int], T], person: int, frame: int, otherwise: T) -> T:
        """Read what is stored of a frame, to write what differs; `otherwise` if the store cannot be read.

        Then too much is written rather than nothing: the edit waits in the queue until its drive is back.
        """
        try:
            return read(person, frame)
        except SessionError:
            return otherwise

    def _settings_of(
        self, person: int, stored: PoseRecord | None, shown: ShownPose, source: str, settings: dict[str, Any]
    ) -> dict[str, Any]:
        """Return the settings of a pose with where a user saw its points, before and now."""
        seen = {} if stored is None else stored.settings.get(SEEN, {})
        if shown.seen:
            seen = with_drag_ends(self._session.cameras, seen, shown.seen)
        elif stored is not None and source == "manual":
            seen = without_moved(self._session.people[person].model, seen, stored.values, shown.values)
        return {**settings, SEEN: seen} if seen else settings

    def _pin_changes(self, state: State) -> list[Change]:
        """Return the changes that make the stored pins of the frame those of the state."""
        changes: list[Change] = []
        for person, shown in enumerate(state.pins):
            name = self._session.people[person].name
            none: tuple[PointObservation, ...] = ()
            pins = self._readable(self.pins, person, state.frame, none)
            before = {(p.point, p.camera): p.position_px for p in pins}
            after = {(p.point, p.camera): p.position_px for p in shown}
            for point, index in sorted({*before, *after}):
                camera = self._session.cameras[index].camera
                old, new = before.get((point, index)), after.get((point, index))
                if old is not None and new is not None and np.allclose(old, new, rtol=0, atol=_SAME_PX):
                    continue
                position_px = None
                if new is not None:
                    u, v = camera.distort_points(np.array(new))
                    position_px = (float(u), float(v))
                changes.append(PinChange(name, state.frame, point, camera.name, position_px))
        return changes
