"""Acquire the sizes of a person from the footage in a thread of its own; the result becomes the draft of the sizes."""

import logging
import threading
from dataclasses import replace

from app.control.session.session_state import SessionState
from app.drawing.body_outlines import body_outlines
from app.remedies import page_text
from app.state.people import AcquiredSize, AcquisitionState, SizeDraft
from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.estimation.acquisition.from_contours import Acquisition, AcquisitionSettings, SizeMethod
from tracker.estimation.acquisition.from_voxels import VoxelSizeSettings
from tracker.estimation.acquisition.size_report import size_changes, unobservable_joints
from tracker.pipeline.body_acquisition import acquire_body

_LOG = logging.getLogger(__name__)
_STEPS = 100
"""Progress is shown in so many steps."""


class _StoppedError(Exception):
    """The user has stopped the acquisition."""


class BodyAcquisition:
    """At most one acquisition at a time. It changes no pose and no size: the user applies the draft, or discards it."""

    def __init__(self, session_state: SessionState) -> None:
        """Acquire nothing yet."""
        self._session_state = session_state
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()

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
            if session_state.state.acquisition.running:
                raise TrackerError("expected no other acquisition at work, found one; stop it or wait for its end")
            if not session_state.saver.index.frames(person):
                name = session_state.session.people[person].name
                raise TrackerError(
                    f"expected a frame on which {name} is placed, found none; place the body on one first"
                )
            couple, model = session_state.state.sides_alike, session_state.present[person]
            session_state.set(acquisition=AcquisitionState(running=True, person=person, stage="starting"))
        self._stopping.clear()
        voxels = VoxelSizeSettings() if method == "voxels" else None
        settings = AcquisitionSettings(coupled=couple, voxels=voxels)
        self._thread = threading.Thread(target=self._work, args=(person, model, settings), name="acquire", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop an acquisition that is at work; the sizes stay as they are. The caller must not hold the lock."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join(30)

    def forget(self) -> None:
        """Discard the result that is shown."""
        if not self._session_state.state.acquisition.running:
            self._session_state.set(acquisition=AcquisitionState())

    def _work(self, person: int, model: BodyModel, settings: AcquisitionSettings) -> None:
        session_state = self._session_state
        try:
            session = session_state.session
            found = acquire_body(
                session,
                session_state.frames.observer.in_time(),
                person,
                range(session.n_frames),
                settings,
                self._report,
            )
            self._finish(person, model, found)
        except _StoppedError:
            session_state.set(acquisition=AcquisitionState(person=person, message="Stopped; the sizes are unchanged."))
        except Exception as error:
            if not isinstance(error, TrackerError):
                _LOG.exception("an acquisition failed")
            text = page_text(error)
            session_state.set(acquisition=AcquisitionState(person=person, message=f"{text[:1].upper()}{text[1:]}."))

    def _report(self, stage: str, share: float, text: str = "", /) -> None:
        if self._stopping.is_set():
            raise _StoppedError
        session_state, share = self._session_state, round(share * _STEPS) / _STEPS
        with session_state.lock:
            before = session_state.state.acquisition
            if (stage, share) != (before.stage, before.share):
                session_state.set(acquisition=replace(before, stage=stage, share=share))

    def _finish(self, person: int, model: BodyModel, found: Acquisition) -> None:
        """Show the result, and make it the draft."""
        sizes = tuple(AcquiredSize(*row) for row in size_changes(found))
        outlines = body_outlines(model, found.body)
        session_state = self._session_state
        with session_state.lock:
            if session_state.present[person] is not model:
                message = "The sizes were changed meanwhile, so the acquired ones are discarded."
                session_state.set(acquisition=AcquisitionState(person=person, message=message))
                return
            session_state.set(
                acquisition=AcquisitionState(
                    person=person, message=_notes(found), frames=found.frames, cost_before_px=found.cost_before_px,
                    cost_after_px=found.cost_after_px, sizes=sizes, outlines=outlines,
                ),
                draft=SizeDraft(person, found.body, dict(zip(found.frames, found.poses, strict=True))),
                sizes_message="",
            )  # fmt: skip


def _notes(found: Acquisition) -> str:
    """Return what the footage does not show of the acquired sizes, as a sentence of the page; empty if nothing."""
    text = "; ".join(unobservable_joints(found))
    return f"{text[:1].upper()}{text[1:]}." if text else ""
