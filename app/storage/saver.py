"""Poses of the screen to the store and back."""

from bisect import bisect_left
from collections.abc import Collection, Iterable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from app.state.people import ShownPose
from app.state.state import State
from app.storage.retry_queue import RetryQueue
from app.storage.timeline_cells import TimelineCells
from tracker.body.model import BodyModel
from tracker.errors import SessionError
from tracker.formats.model_toml import format_model, parse_model
from tracker.geometry.arrays import Array
from tracker.geometry.triangulation import PointObservation
from tracker.pipeline.tracked_changes import keyframes_of
from tracker.posing.retarget import retarget_pose
from tracker.session.session import Session
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import (
    SOURCES,
    Alternative,
    Change,
    FramePose,
    FrameRow,
    HistoryEntry,
    Pin,
    PinChange,
    PoseChange,
    PoseRecord,
)

_BY_HAND = ("manual", "pinned", "fitted")
"""Sources of a person's own edits: a frame that a person's word was fitted to is a keyframe as one set by drags is."""
_SAME_PX = 1e-6
"""Pins nearer than this are the same: what lens distortion there and back leaves."""
_READ_FRAMES = 2000
"""Frames whose numbers are read at once."""


class Saver:
    """Keeps the poses of one open session. Not locked by itself: the controller calls it under its lock."""

    def __init__(self, session: Session, store: AnnotationStore, author: str = "") -> None:
        """List the frames that have poses, and keep the models of the session as revisions.

        Args:
            session: what is open.
            store: its annotations.
            author: who makes the edits, for the history.
        """
        self._session, self._store, self._writing = session, store, RetryQueue(store, author)
        self._bodies: dict[int, BodyModel] = {}
        self._revisions: list[int] = []
        self.set_body_models(session)
        self._cells = TimelineCells(p.name for p in session.people)
        self._frames: list[list[int]] = [[] for _ in session.people]
        self.moved_edits: tuple[int, ...] = ()
        """Entries of the history that the last undo, redo or walk took back or did again, in that order."""
        self._reload()

    @property
    def timeline_version(self) -> int:
        """Rises with every change of stored poses."""
        return self._cells.version

    @property
    def error(self) -> str | None:
        """Why an edit is not on disk; None where all are."""
        return self._writing.error

    def set_body_models(self, session: Session) -> None:
        """Keep the bodies of a session's people as revisions: new poses belong to them."""
        self._session = session
        self._revisions = [self._store.add_model_revision(p.name, format_model(p.model)) for p in session.people]
        self._bodies |= dict(zip(self._revisions, (p.model for p in session.people), strict=True))

    def body(self, revision: int) -> BodyModel:
        """The body model that a pose names: always the same object, so that what is computed of it is kept."""
        if revision not in self._bodies:
            text = self._store.model_revision(revision).toml
            self._bodies[revision] = parse_model(text, f"of the store, revision {revision}")
        return self._bodies[revision]

    def former_body(self, person: int) -> BodyModel | None:
        """The body that a person had before the present one, where the store knows one of the same joints."""
        present = self._revisions[person]
        known = [r.id for r in self._store.model_revisions(self._session.people[person].name) if r.id != present]
        fitting = [r for r in known if self.fits(person, r)]
        earlier = [r for r in fitting if r < present] or fitting
        return self.body(earlier[-1]) if earlier else None

    def fits(self, person: int, revision: int) -> bool:
        """Whether poses of a body model can be shown as this person's: it has the same degrees of freedom."""
        return self.body(revision).value_names == self._session.people[person].model.value_names

    def setting(self, key: str, default: Any = None) -> Any:
        """A setting that is kept with the session: anything that JSON holds."""
        return self._store.setting(key, default)

    def keep_setting(self, key: str, value: Any) -> None:
        """Keep a setting with the session; not part of the history."""
        self._store.set_setting(key, value)

    def pose(self, person: int, frame: int) -> ShownPose | None:
        """The stored pose of a person on a frame."""
        record = self.record(person, frame)
        if record is None or not self.fits(person, record.model_revision):
            return None
        source, revision = _summary(record.sources), record.model_revision
        others = () if record.keyframe else tuple(a.values for a in self.alternatives(person, frame))
        return ShownPose(
            record.values, source, record.status, record.remark, record.part_costs_px, (), revision, others
        )

    def alternatives(self, person: int, frame: int) -> tuple[Alternative, ...]:
        """Poses about as good as the stored one, best first; those of a body of other joints are passed over."""
        name = self._session.people[person].name
        waiting = self._writing.pose(name, frame)
        kept = self._store.alternatives(name, frame) if waiting is None else waiting.alternatives
        return tuple(a for a in kept if self.fits(person, a.model_revision))

    def pose_now(self, person: int, frame: int) -> Array | None:
        """The stored pose of a person, (n_values,), taken over into the present body where it was made with another."""
        shown = self.pose(person, frame)
        return None if shown is None else self.in_present_body(person, shown.values, shown.revision)

    def in_present_body(self, person: int, values: Array, revision: int | None) -> Array:
        """A pose of one of a person's bodies, (n_values,), taken over into the present one."""
        present = self._session.people[person].model
        return values if revision is None else retarget_pose(values, self.body(revision), present)

    def pins(self, person: int, frame: int) -> tuple[PointObservation, ...]:
        """The stored pins of a person on a frame, undistorted px; those of other cameras and bodies are passed over."""
        info, cameras = self._session.people[person], self._session.cameras
        index = {c.camera.name: i for i, c in enumerate(cameras)}
        stored: dict[tuple[str, str], tuple[float, float] | None]
        stored = {(p.point, p.camera): p.position_px for p in self._store.pins(info.name, frame)}
        stored |= {(c.point, c.camera): c.position_px for c in self._writing.pins(info.name, frame)}
        found = []
        for pin in [Pin(*key, place) for key, place in sorted(stored.items()) if place is not None]:
            if pin.camera in index and pin.point in info.model.point_names:
                camera = index[pin.camera]
                u, v = cameras[camera].camera.undistort_points(np.array(pin.position_px))
                found.append(PointObservation(pin.point, camera, (float(u), float(v))))
        return tuple(found)

    def frames(self, person: int) -> list[int]:
        """The frames on which a person has a stored pose, ascending."""
        return list(self._frames[person])

    def frames_within(self, person: int, frames: range) -> list[int]:
        """Those of a range of frames on which a person has a stored pose, ascending."""
        listed = self._frames[person]
        return listed[bisect_left(listed, frames.start) : bisect_left(listed, frames.stop)]

    def keyframes(self, frames: Collection[int]) -> dict[int, dict[int, Array]]:
        """Poses of the keyframes among some frames, in the present bodies, by frame and person."""
        found = keyframes_of(self._store, self._session.people, frames)
        now = {frame: {p: self.pose_now(p, frame) for p in held} for frame, held in found.items()}
        return {frame: {p: v for p, v in held.items() if v is not None} for frame, held in now.items()}

    def nearest_pose(self, person: int, frame: int) -> Array | None:
        """The stored pose nearest in time, the earlier one where two are as near; None where there is none."""
        frames = self._frames[person]
        at = bisect_left(frames, frame)
        near = sorted(frames[max(0, at - 1) : at + 1], key=lambda f: (abs(f - frame), f))
        return self.pose_now(person, near[0]) if near else None

    def pose_rows(self, person: int, frames: Sequence[int]) -> list[FramePose]:
        """What is stored on those of some frames, ascending, that have a pose. Needs no lock of the controller."""
        name, found, first = self._session.people[person].name, [], 0
        for i, frame in enumerate(frames):
            # Read in pieces: whoever wants to write waits for one at most.
            if i + 1 == len(frames) or frames[i + 1] != frame + 1 or i - first >= _READ_FRAMES:
                found += self._store.frame_poses(name, range(frames[first], frame + 1))
                first = i + 1
        return found

    def save(self, state: State, label: str, source: str, amend: int | None) -> int | None:
        """Write what is shown and differs from what is stored: pins, and poses that are not drafts.

        Args:
            state: with the poses and pins.
            label: what the history says.
            source: who set the values that changed, where the pose itself does not say so.
            amend: the entry of the history to add to; None makes a new one.

        Returns:
            What later calls add to; None where there was nothing to write. Where writing fails, `error` says why.
        """
        changes: list[Change] = self._pin_changes(state)
        for person, (shown, revision) in enumerate(zip(state.people, state.revisions, strict=True)):
            name = self._session.people[person].name
            stored = self._record(name, state.frame)
            same = stored is not None and stored.model_revision == revision
            if shown.source is None or (same and np.array_equal(stored.values, shown.values)):  # type: ignore[union-attr]
                continue
            known = stored is not None and len(stored.values) == len(shown.values)
            sources = tuple(
                stored.sources[i]  # type: ignore[union-attr]
                if known and stored.values[i] == value  # type: ignore[union-attr]
                else (shown.sources[i] if shown.sources else source)
                for i, value in enumerate(shown.values)
            )
            keyframe = source in _BY_HAND or (stored is not None and stored.keyframe)
            told = asdict(state.settings) if source in ("searched", "fitted") else {}
            record = PoseRecord(
                shown.values, sources, revision, keyframe, "", state.cost_px, told, view_costs_px=state.view_costs_px
            )
            changes.append(PoseChange(name, state.frame, record))
        return self.write(f"{label}, frame {state.frame}", changes, amend, by_program=False)

    def _pin_changes(self, state: State) -> list[Change]:
        """What makes the stored pins of the frame those that are shown."""
        changes: list[Change] = []
        for person, shown in enumerate(state.pins):
            name = self._session.people[person].name
            before = {(p.point, p.camera): p.position_px for p in self.pins(person, state.frame)}
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

    def undo(self) -> list[int]:
        """Take back the last entry of the history; returns the frames it is about, ascending."""
        self._write_all()
        entry = self._next_undo()
        if entry is None:
            return self._moved([])
        self._store.undo()
        return self._moved([entry.edit])

    def redo(self) -> list[int]:
        """Do again what was taken back last; returns the frames it is about, ascending."""
        self._write_all()
        entry = self._next_redo()
        if entry is None:
            return self._moved([])
        self._store.redo()
        return self._moved([entry.edit])

    def go_to(self, edit: int | None) -> list[int]:
        """Undo or redo until an entry is the last one done, None for none; returns the frames it changes, ascending."""
        self._write_all()
        return self._moved(self._store.go_to(edit))

    def history(self, limit: int) -> list[HistoryEntry]:
        """Entries that redo and undo can reach, latest first; at most `limit` of each."""
        return self._store.history(limit)

    def undo_label(self) -> str | None:
        """What undo would take back."""
        entry = self._next_undo()
        return None if entry is None else entry.label

    def redo_label(self) -> str | None:
        """What redo would do again."""
        entry = self._next_redo()
        return None if entry is None else entry.label

    def timeline(self, since: int, person: int | None = None) -> dict[int, dict | None]:
        """Cells of the frames that changed after a version of the timeline; all for 0.

        Args:
            since: the version.
            person: of whom among several; by default what is said of all together.
        """
        return self._cells.since(since, None if person is None else self._session.people[person].name)

    def _next_undo(self) -> HistoryEntry | None:
        return next((e for e in self._store.history(1) if not e.undone), None)

    def _next_redo(self) -> HistoryEntry | None:
        return next((e for e in self._store.history(1) if e.undone), None)

    def _moved(self, edits: Iterable[int]) -> list[int]:
        self.moved_edits = tuple(edits)
        frames = sorted({frame for edit in self.moved_edits for frame in self._store.frames_of(edit)})
        self._note(frames)
        return frames

    def rows(self, person: int, frames: range) -> list[FrameRow]:
        """The frames of a range on which a person has a stored pose, ascending, in short."""
        return self._store.frames(self._session.people[person].name, frames)

    def revision(self, person: int) -> int:
        """The body model that new poses of a person belong to."""
        return self._revisions[person]

    def record(self, person: int, frame: int) -> PoseRecord | None:
        """The stored pose of a person on a frame with all that is known of it."""
        return self._record(self._session.people[person].name, frame)

    def write(
        self, label: str, changes: Sequence[Change], amend: int | None, by_program: bool, even_empty: bool = False
    ) -> int | None:
        """Commit changes, or add them to an entry of the history.

        Args:
            label: what the history says.
            changes: of poses, their marks, or pins.
            amend: the entry of the history to add to; None makes a new one.
            by_program: leave keyframes as they are.
            even_empty: make an entry of no changes too, of something that is kept elsewhere.

        Returns:
            What later calls add to; None where there was nothing to write. What cannot be written waits, and `error`
            says why.
        """
        if not (changes or even_empty):
            return amend
        edit, written = self._writing.write(label, changes, amend, by_program)
        self._note(written)
        return edit

    def retry(self) -> None:
        """Try again to write what waits; where that fails, `error` says why."""
        self._note(self._writing.retry())

    def _write_all(self) -> None:
        """Write what waits before the history moves.

        Raises:
            SessionError: it still cannot be written.
        """
        self.retry()
        if self.error is not None:
            raise SessionError(f"the history stands still while an edit is not saved: {self.error}")

    def _record(self, name: str, frame: int) -> PoseRecord | None:
        """The pose of a person on a frame: what waits to be written, else what is stored."""
        waiting = self._writing.pose(name, frame)
        return self._store.pose(name, frame) if waiting is None else waiting.pose

    def _reload(self) -> None:
        """List all frames anew."""
        rows: dict[int, dict[str, FrameRow]] = {}
        for person, info in enumerate(self._session.people):
            found = self._store.frames(info.name)
            self._frames[person] = [row.frame for row in found]
            for row in found:
                rows.setdefault(row.frame, {})[info.name] = row
        self._cells.begin(rows)

    def _note(self, frames: Sequence[int]) -> None:
        """Bring the cells of some frames, ascending, up to date."""
        if not frames:
            return
        rows: dict[int, dict[str, FrameRow]] = {}
        for person, info in enumerate(self._session.people):
            found = self._store.frames(info.name, range(frames[0], frames[-1] + 1))
            for row in found:
                rows.setdefault(row.frame, {})[info.name] = row
            # Only what lies between the first and the last of them can have changed.
            listed = self._frames[person]
            between = slice(bisect_left(listed, frames[0]), bisect_left(listed, frames[-1] + 1))
            listed[between] = [row.frame for row in found]
        self._cells.change(frames, rows)


def _summary(sources: tuple[str, ...]) -> str:
    """One word for where a pose came from: that of the values nearest to a person's hand."""
    return min(sources, key=SOURCES.index)
