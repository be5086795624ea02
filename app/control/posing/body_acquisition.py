"""Acquire the sizes of a person from the footage in a thread of its own; the result becomes the draft of the sizes."""

from typing import Any

from app.control.session.background_work import BackgroundWork
from app.control.session.session_state import SessionState
from app.drawing.body_outlines import body_outlines
from app.remedies import page_sentence
from app.state.people import AcquiredSize, AcquisitionState, SizeDraft
from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.estimation.acquisition.from_contours import AcquisitionSettings, SizeMethod
from tracker.estimation.acquisition.from_voxels import VoxelSizeSettings
from tracker.estimation.acquisition.size_report import size_changes, unobservable_joints
from tracker.pipeline.body_acquisition import acquire_body


class BodyAcquisition:
    """At most one acquisition at a time. It changes no pose and no size: the user applies the draft, or discards it."""

    def __init__(self, session_state: SessionState) -> None:
        """Acquire nothing yet."""
        self._session_state = session_state
        self._work = BackgroundWork(session_state, "acquisition", "acquisition", "Stopped; the sizes are unchanged.")

    def start(self, person: int, method: SizeMethod = "contours") -> None:
        """Begin to acquire the sizes of a person from all frames.

        Args:
            person: index of the person.
            method: whether voxels are fitted before the contours.

        Raises:
            TrackerError: another acquisition is at work, or the person has no pose.
        """
        session_state = self._session_state
        with session_state.lock:
            self._work.require_free()
            if not session_state.saver.index.frames(person):
                name = session_state.session.people[person].name
                raise TrackerError(
                    f"expected a frame on which {name} is placed, found none; place the body on one first"
                )
            couple, model = session_state.state.sides_alike, session_state.present[person]
            voxels = VoxelSizeSettings() if method == "voxels" else None
            settings = AcquisitionSettings(coupled=couple, voxels=voxels)
            self._work.start(lambda: self._acquire(person, model, settings), AcquisitionState(person=person))

    def stop(self) -> None:
        """Stop the work. The caller must not hold the lock."""
        self._work.stop()

    def forget(self) -> None:
        """Discard the result that is shown."""
        if not self._session_state.state.acquisition.running:
            self._session_state.set(acquisition=AcquisitionState())

    def _acquire(self, person: int, model: BodyModel, settings: AcquisitionSettings) -> dict[str, Any]:
        """Acquire the sizes, make them the draft, and return what shows them."""
        session_state = self._session_state
        session, observer = session_state.session, session_state.frames.observer.at_nearest_times()
        found = acquire_body(session, observer, person, range(session.n_frames), settings, self._work.report)
        sizes = tuple(AcquiredSize(*row) for row in size_changes(found))
        outlines = body_outlines(model, found.body)
        with session_state.lock:
            if session_state.present[person] is not model:
                return {"message": "The sizes were changed meanwhile, so the acquired ones are discarded."}
            draft = SizeDraft(person, found.body, dict(zip(found.frames, found.poses, strict=True)))
            session_state.set(draft=draft, sizes_message="")
        return {
            "message": page_sentence("; ".join(unobservable_joints(found))), "frames": found.frames,
            "cost_before_px": found.cost_before_px, "cost_after_px": found.cost_after_px, "sizes": sizes,
            "outlines": outlines,
        }  # fmt: skip
