"""Read the stored poses of the session for views: timeline, curves, trails."""

from app.control.session.session_state import SessionState
from app.storage.pose_origins import PoseOrigin
from tracker.body.model import PosedBody
from tracker.geometry.arrays import Array
from tracker.session.store.records import FramePose


class StoredPoses:
    """The stored poses, read under the session's lock. Nothing is changed."""

    def __init__(self, session_state: SessionState) -> None:
        """Read what is stored of this session."""
        self._session_state = session_state

    def timeline(self, since: int = 0, person: int | None = None) -> dict[int, dict | None]:
        """Return the cells of the frames whose stored poses changed after a version of the timeline.

        Args:
            since: the version; 0 returns all cells.
            person: index of one of several people; None summarizes all people.
        """
        with self._session_state.lock:
            return self._session_state.saver.index.timeline(since, person)

    def rows(self, person: int, since: int = 0) -> tuple[list[int], list[FramePose]]:
        """Return the frames on which a person's poses changed after a version of the timeline, and their present rows.

        Args:
            person: index of the person.
            since: the version; 0 returns all frames on which the person has a pose.
        """
        saver = self._session_state.saver
        with self._session_state.lock:
            frames = sorted(saver.index.timeline(since)) if since > 0 else saver.index.frames(person)
        return frames, saver.pose_rows(person, frames)

    def on_frame(self, frame: int) -> dict[int, PosedBody]:
        """Return the stored poses of a frame by index of the person, each in the body that it was made with, and with
        their velocities where a camera needs them."""
        saver, found = self._session_state.saver, dict[int, PosedBody]()
        with self._session_state.lock:
            velocities = dict(enumerate(self._session_state.frame_poses.velocities(frame)))
            for person in range(len(self._session_state.session.people)):
                pose = saver.pose(person, frame)
                if pose is not None:
                    assert pose.revision is not None, "a stored pose has a revision"
                    found[person] = PosedBody(saver.revisions.body(pose.revision), pose.values, velocities.get(person))
        return found

    def origin(self, person: int, frame: int) -> PoseOrigin | None:
        """Return where the stored pose of a person comes from; None if there is none."""
        with self._session_state.lock:
            return self._session_state.saver.origin(person, frame)

    def keyframes_by_annotator(self) -> tuple[dict[str, tuple[int, ...]], ...]:
        """Return for each person the keyframes by the annotator who set or marked them last, ascending."""
        with self._session_state.lock:
            return self._session_state.saver.keyframes_by_annotator()

    def in_present_body(self, person: int, frames: range) -> dict[int, Array]:
        """Return a person's poses, (n_values,), in the present body by frame; frames without a pose are left out."""
        saver = self._session_state.saver
        with self._session_state.lock:
            listed = saver.index.within(person, frames)
        return {
            row.frame: saver.revisions.in_present_body(person, row.values, row.model_revision)
            for row in saver.pose_rows(person, listed)
            if saver.revisions.fits(person, row.model_revision)
        }
