"""Updates on where the shown pose comes from, and on another copy of the session (docs/protocol.md)."""

from app.control.controller import Controller
from app.messages.base import Message, made_of
from app.messages.observation import (
    AnnotatorsMessage,
    CopyDifferenceInfo,
    OtherCopyMessage,
    PointProvenance,
    ProvenanceMessage,
    WatchProvenance,
)
from app.state.identity import ObjectIdentity
from app.state.page_view import View
from app.state.state import State
from app.storage.pose_origins import PoseOrigin
from tracker.interchange.exports.provenance import point_lost
from tracker.session.store.records import BETWEEN, SOURCES, TAKEN_FROM

_UNWATCHED = WatchProvenance(None)
_NO_COPY = OtherCopyMessage("", "", 0.0, (), (), ())


class ProvenanceFeed:
    """Remembers what one page asks for, and what it has received."""

    def __init__(self) -> None:
        """Begin with nothing asked for."""
        self._wanted = _UNWATCHED
        self._made_from: tuple[object, ...] = ()
        self._sent: dict[type[Message], Message] = {OtherCopyMessage: _NO_COPY}

    def watch(self, wanted: WatchProvenance) -> None:
        """Note what the page shows from now on."""
        self._wanted = wanted
        for kind in (ProvenanceMessage, AnnotatorsMessage):
            self._sent.pop(kind, None)

    def is_due(self, state: State, _: View | None = None) -> bool:
        """Return whether there may be updates; quick. None are made during a drag or a search."""
        return not (state.is_dragging or state.search.running) and self._ingredients(state) != self._made_from

    def updates(self, controller: Controller, state: State) -> list[Message]:
        """Return the messages that bring the page up to date. It reads the annotations: call it in a worker.

        Raises:
            SessionError: the annotations cannot be read.
        """
        self._made_from = self._ingredients(state)
        now: list[Message] = [other_copy(controller, state)]
        if (person := self._wanted.person) is not None:
            origin = controller.stored_poses.origin(person, state.frame)
            now.append(provenance(state, person, origin))
        if self._wanted.annotators:
            now.append(AnnotatorsMessage(controller.stored_poses.keyframes_by_annotator()))
        changed = [message for message in now if self._sent.get(type(message)) != message]
        self._sent |= {type(message): message for message in changed}
        return changed

    def _ingredients(self, state: State) -> tuple[object, ...]:
        """Return what the messages are made from, for comparison."""
        copy = ObjectIdentity(state.other_copy), None if state.other_copy is None else state.frame
        if self._wanted == _UNWATCHED:
            return copy
        present = (state.timeline_version, state.present, state.calibration.n_changes)
        return (*copy, self._wanted, state.frame, present, ObjectIdentity(state.checked))


def provenance(state: State, person: int, origin: PoseOrigin | None) -> ProvenanceMessage:
    """Describe where the stored pose of a person on the shown frame comes from."""
    if origin is None:
        return ProvenanceMessage(
            state.frame, person, None, "", "", "", False, False, "", None, None, "", "", "", 0, False, 0, False, ()
        )
    record, model = origin.record, origin.model
    source = min(record.sources, key=SOURCES.index)
    between = record.settings.get(BETWEEN)
    lost = point_lost(model, record.limbs_lost).tolist()
    points = tuple(
        PointProvenance(name, p.source, p.author, p.time, p.views, None if q != q else round(q, 3))
        for name, p, q in zip(model.point_names, origin.points, lost, strict=True)
    )
    return made_of(
        ProvenanceMessage, record, frame=state.frame, person=person, source=source,
        reviewed=record.reviewed or record.keyframe, method=str(record.settings.get("method", "")),
        between=None if between is None else (int(between[0]), int(between[1])),
        imported_from=_imported_from(record.remark) if "imported" in record.sources else "",
        taken_from=str(record.settings.get(TAKEN_FROM, "")), body=model.name, body_revision=record.model_revision,
        is_earlier_body=record.model_revision != state.present[person],
        calibration_revision=origin.calibration_revision,
        is_earlier_calibration=origin.calibration_revision != origin.present_calibration, points=points,
    )  # fmt: skip


def _imported_from(remark: str) -> str:
    """Return the name of the observations that a pose was taken from: `keypoint_poses` notes it as `by NAME`."""
    return remark.removeprefix("by ") if remark.startswith("by ") else ""


def other_copy(controller: Controller, state: State) -> OtherCopyMessage:
    """Describe the copy that is compared with the session."""
    copy = state.other_copy
    if copy is None:
        return _NO_COPY
    people = tuple(
        tuple(CopyDifferenceInfo(k, joint, round(1000 * m, 1), (i, k) in copy.decided) for k, joint, m in found)
        for i, found in enumerate(copy.differences)
    )
    posed = tuple(state.frame in poses for poses in copy.poses)
    return OtherCopyMessage(copy.name, copy.own_name, round(1000 * copy.tolerance_m, 3), copy.notes, posed, people)
