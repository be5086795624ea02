"""Acquire a person's body from the stored poses of a session, and make it the person's present body."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.compute.progress import Report, part_of, unreported
from tracker.errors import Remedy, TrackerError
from tracker.estimation.acquisition.from_contours import Acquisition, AcquisitionSettings, acquire_from_contours
from tracker.estimation.acquisition.from_joints import place_joints
from tracker.estimation.acquisition.size_report import unobservable_joints
from tracker.estimation.acquisition.two_views import TwoViewSettings, acquire_from_two_views
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.chamfer.tracker import ChamferTracker
from tracker.estimation.fitting.gauss_newton import PointTargets
from tracker.estimation.fitting.pins import PinBlock, pin_block
from tracker.estimation.fitting.retarget import retarget_pose
from tracker.estimation.initialization.first_pose import HEIGHT_SIGMA
from tracker.estimation.tracking.tracker import Subjects, TrackingRun
from tracker.evidence.observer import Observer
from tracker.formats.model_toml import format_model, has_preset_proportions
from tracker.geometry.arrays import Array
from tracker.geometry.triangulation import PointObservation
from tracker.pipeline.marked_points import user_marked_points
from tracker.pipeline.posed_recording import PosedRecording
from tracker.session.session import Session, save_model
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import SEEN, SOURCES, Change, PoseChange, PoseRecord
from tracker.session.store.stored_poses import StoredPose, read_stored_poses

SIZES_EDITS = "sizes_edits"
"""Setting of the session: the entries of the history that changed sizes, see `sizes_changed`."""
PLACED_M = 0.02
"""Standard deviation of a joint that a user has placed in the images, metres."""
_HAND = 3.0
"""Standard deviation of where a hand puts a point, in that of a pin that pulls a pose."""
_MOST_TRACKED = 90
"""Largest number of frames that are tracked for an acquisition where too few poses are stored."""
_ENOUGH = 0.5
"""Share of these frames with good poses above which another round would show little more."""
MEASURED = "is_measured"
"""Key of a pose's settings: the height of its body was measured in the silhouettes."""


class PosedFrames(NamedTuple):
    """Frames with known poses of a person."""

    bodies: Mapping[int, tuple[PosedBody, ...]]
    """On each frame the person in the present body, then the other people who have a pose there."""
    placed: Mapping[int, PointTargets]
    """By frame, joints of the person that were placed by hand or are known."""
    seen: Mapping[int, PinBlock]
    """By frame, points of the person that a user has marked in the images: pins, and the ends of drags."""
    has_known_joints: bool = False
    """Whether some joints come from a file, which may define them otherwise than anatomy does."""
    has_measured_height: bool = False
    """Whether the height of the present body was measured in the silhouettes."""


def acquire_body(
    session: Session,
    observer: Observer,
    person: int,
    frames: Sequence[int],
    settings: AcquisitionSettings | TwoViewSettings,
    report: Report = unreported,
    known: PosedFrames | None = None,
    joints: Mapping[int, PointTargets] = MappingProxyType({}),
) -> Acquisition:
    """Acquire the body of a person from stored poses; where they are too few, from frames tracked for it.

    Nothing is stored; see `store_body`.

    Args:
        session: the session.
        observer: of its recording.
        person: index of the person.
        frames: the frames that may be used, ascending.
        settings: of the acquisition; their type is the method.
        report: shows progress. An exception that it raises ends the acquisition.
        known: poses to begin from, in the present bodies; those that the session stores by default.
        joints: by frame, joints that another program found. They count where nobody has placed any.

    Raises:
        TrackerError: the person has no pose on these frames, or the views show nothing of them.
    """
    known = known or posed_frames(session, person, frames)
    if not len(known.bodies) < settings.n_frames < len(frames):
        return _acquire(observer, _with_joints(known, joints), settings, report)
    rounds = settings.rounds if isinstance(settings, AcquisitionSettings) else 1
    body, number = session.people[person].model, 0
    while True:
        begin, end = number / rounds, (number + 1) / rounds
        between = (begin + end) / 2  # tracking takes about half of a round
        good, usable = _tracked_with(body, observer, frames, known, part_of(report, begin, between))
        # In a dark room, or in a body of other sizes, hardly a frame is good; one shows no joint's centre.
        tracked = good if len(good.bodies) >= settings.n_frames else usable
        acquired = _acquire(observer, _with_joints(tracked, joints), settings, part_of(report, between, end))
        body, number = acquired.body, number + 1
        is_enough = len(good.bodies) > _ENOUGH * min(len(frames), _MOST_TRACKED)
        if number == rounds or is_enough or not acquired.is_better:
            return acquired


def _with_joints(known: PosedFrames, joints: Mapping[int, PointTargets]) -> PosedFrames:
    return known._replace(placed={**{k: t for k, t in joints.items() if k in known.bodies}, **known.placed})


def _acquire(
    observer: Observer, known: PosedFrames, settings: AcquisitionSettings | TwoViewSettings, report: Report
) -> Acquisition:
    if isinstance(settings, TwoViewSettings):
        return acquire_from_two_views(observer, known.bodies, 0, settings, report)
    priors = settings.priors if known.has_known_joints else settings.priors.anatomical()
    if known.has_measured_height:
        priors = replace(priors, height=min(HEIGHT_SIGMA, priors.height))
    settings = replace(settings, priors=priors)
    return acquire_from_contours(observer, known.bodies, 0, known.placed, settings, report, known.seen)


def posed_frames(session: Session, person: int, frames: Sequence[int], start: int | None = None) -> PosedFrames:
    """Return the frames on which a person has a credible pose, with the placed joints.

    Keyframes and good frames are used. If there are none, doubtful ones are.

    Args:
        session: the session.
        person: index of the person.
        frames: that may be used, ascending.
        start: frame that a run goes out from. Its pose is used whatever its status.

    Raises:
        TrackerError: the person has no pose on these frames.
    """
    within = range(frames[0], frames[-1] + 1)
    stored = [read_stored_poses(session.annotations_path, p.name, p.model, within) for p in session.people]
    own, model = {k: s for k, s in stored[person].items() if k in frames}, session.people[person].model
    own = {k: s for k, s in own.items() if len(s.record.values) == len(model.value_names)}
    usable = {k: s for k, s in own.items() if s.record.keyframe or s.record.status in ("", "good") or k == start}
    usable = usable or {k: s for k, s in own.items() if s.record.status != "lost"}
    if not usable:
        raise TrackerError(
            f"expected a pose of '{session.people[person].name}' on a frame from {frames[0]} to {frames[-1]}, found "
            "none that is not lost",
            Remedy("place_body"),
        )
    bodies = {
        k: (
            PosedBody(model, retarget_pose(s.body.values, s.body.model, model)),
            *(other[k].body for i, other in enumerate(stored) if i != person and k in other),
        )
        for k, s in usable.items()
    }
    keyframes = {k: s for k, s in usable.items() if s.record.keyframe}
    with AnnotationStore(session.annotations_path, read_only=True) as store:
        pins = {k: store.pins(session.people[person].name, k) for k in keyframes}
    observed = {k: user_marked_points(session.cameras, model, s.record, pins[k]) for k, s in keyframes.items()}
    cameras = [c.camera for c in session.cameras]
    seen = {k: pin_block(model, cameras, o).widened(_HAND) for k, o in observed.items() if o}
    placed = {k: t for k, s in keyframes.items() if (t := _placed(s, observed[k])) is not None and len(t.points)}
    has_known_joints = any(s.record.settings.get("joints") for s in keyframes.values())
    is_measured = any(s.record.settings.get(MEASURED) for s in usable.values())
    return PosedFrames(bodies, placed, seen, has_known_joints, is_measured)


def generic_people(session: Session) -> list[int]:
    """Return the people who are in the shape of a preset."""
    return [i for i, person in enumerate(session.people) if has_preset_proportions(person.model)]


def generic_doubt(session: Session) -> str:
    """Return a sentence on a check of the cameras by people in the shape of a preset; empty without any."""
    names = " and ".join(session.people[i].name for i in generic_people(session))
    return f"the shape of {names} is a preset's, so that a healthy camera may seem off" if names else ""


def with_acquired_bodies(recording: PosedRecording, session: Session, report: Report = unreported) -> PosedRecording:
    """Return the poses of a session in bodies that are acquired for those of presets. Nothing is stored.

    Args:
        recording: the poses.
        session: of the recording.
        report: shows progress. An exception that it raises ends the work.

    Raises:
        TrackerError: see `acquire_body`.
    """
    bodies, generic = dict[BodyModel, BodyModel](), generic_people(session)
    for n, person in enumerate(generic):
        part = part_of(report, n / len(generic), (n + 1) / len(generic), "acquiring sizes")
        best = acquire_body(session, recording.observer, person, range(session.n_frames), AcquisitionSettings(), part)
        bodies[session.people[person].model] = best.body
    return recording.with_bodies(bodies)


def store_body(
    session: Session, store: AnnotationStore, person: int, body: BodyModel, poses: Mapping[int, Array], label: str,
    starts: Collection[int] = (),
) -> Session:  # fmt: skip
    """Make a body the present one of a person: a new model revision, and keyframes fitted to it, as one undoable edit.

    Other stored poses keep the body that they were made with until they are tracked again, but for those of starts.

    Args:
        session: the session, which this process has locked.
        store: its annotations.
        person: index of the person.
        body: the new body.
        poses: by frame, poses of the new body; they replace those of keyframes. Other keyframes are retargeted.
        label: of the entry of the history.
        starts: frames that a run may go out from.
    """
    name, model = session.people[person].name, session.people[person].model
    before = store.add_model_revision(name, format_model(model))
    changed = save_model(session, person, body)
    revision = store.add_model_revision(name, format_model(body))
    stored = read_stored_poses(session.annotations_path, name, model)
    changes: list[Change] = [
        PoseChange(name, k, refitted_record(s, body, _pose_in(body, s, poses.get(k)), revision))
        for k, s in stored.items()
        if s.record.keyframe
    ]
    others = [k for k in starts if k in stored and not stored[k].record.keyframe]
    changes += [PoseChange(name, k, resized_start(stored[k], body, revision)) for k in others]
    edit = store.commit(label, changes).edit
    store.set_setting(SIZES_EDITS, with_sizes_changed(store.setting(SIZES_EDITS, {}), edit, [(name, before, revision)]))
    return changed


def with_sizes_changed(edits: Mapping[str, Any], edit: int, changed: Sequence[tuple[str, int, int]]) -> dict[str, Any]:
    """Return the setting `SIZES_EDITS` with changes by an entry of the history; `sizes_changed` reads it.

    Args:
        edits: the setting before. It may have earlier changes by the same entry.
        edit: number of the entry.
        changed: name of each person whose sizes it changed, with the revisions before and after it.
    """
    rows = {name: (before, after) for name, before, after in sizes_changed(edits, edit)}
    for name, before, after in changed:
        rows[name] = rows.get(name, (before, after))[0], after
    return {**edits, str(edit): [[name, *revisions] for name, revisions in rows.items()]}


def sizes_changed(edits: Mapping[str, Any], edit: int) -> list[tuple[str, int, int]]:
    """Return the names of the people whose sizes an entry of the history changed, with the revisions before and after.

    Args:
        edits: the setting `SIZES_EDITS`, see `with_sizes_changed`.
        edit: number of the entry.
    """
    found = edits.get(str(edit), [])  # a single row where an older version stored it
    rows = found if found and isinstance(found[0], list) else [found] if found else []
    return [(str(name), int(before), int(after)) for name, before, after in rows]


def refitted_record(keyframe: StoredPose, body: BodyModel, pose: Array, revision: int) -> PoseRecord:
    """Return the record of a keyframe in another body.

    Args:
        keyframe: the keyframe.
        body: the other body.
        pose: the pose in it, (n_values,).
        revision: of the other body.
    """
    record = keyframe.record
    kept = {k: v for k, v in record.settings.items() if k in ("joints", SEEN)}
    what = "sizes" if keyframe.body.model.value_names == body.value_names else "joints"
    return replace(
        record, values=pose, sources=_sources_in(body, keyframe), model_revision=revision, status="", cost_px=None,
        settings={"method": "refit", "model_revision": record.model_revision, **kept}, view_costs_px=(),
        part_costs_px=(), limbs_lost=(), errors=None, trace=None,
        remark=f"refitted to other {what}",
    )  # fmt: skip


def resized_start(start: StoredPose, body: BodyModel, revision: int) -> PoseRecord:
    """Return the record of the pose that a run goes out from, retargeted to acquired sizes; its status stays.

    Args:
        start: the pose, which is no keyframe.
        body: in the acquired sizes.
        revision: of that body.
    """
    pose = retarget_pose(start.body.values, start.body.model, body)
    return replace(
        start.record, values=pose, sources=_sources_in(body, start), model_revision=revision, cost_px=None,
        view_costs_px=(), part_costs_px=(), errors=None,
    )  # fmt: skip


def _sources_in(body: BodyModel, stored: StoredPose) -> tuple[str, ...]:
    """Return the source of each value of a pose in another body; values that only that body has are fitted at most."""
    known = dict(zip(stored.body.model.value_names, stored.record.sources, strict=True))
    least = max("fitted", *stored.record.sources, key=SOURCES.index)
    return tuple(known.get(name, least) for name in body.value_names)


def acquisition_sentence(acquired: Acquisition) -> str:
    """Say from which frames sizes were acquired, and whether they are applied: only where the cost falls."""
    costs = f"cost {acquired.cost_before_px:.2f} px before, {acquired.cost_after_px:.2f} px after"
    if not acquired.is_better:
        return f"sizes not applied: the body would fit the contours worse ({costs})"
    frames = ", ".join(map(str, acquired.frames))
    return "; ".join(
        [f"sizes from frames {frames}: {acquired.body.height_m:.2f} m tall, {costs}", *unobservable_joints(acquired)]
    )


def _pose_in(body: BodyModel, stored: StoredPose, known: Array | None) -> Array:
    """Return a stored pose in another body: a known one, or the stored one retargeted by its joints."""
    return retarget_pose(stored.body.values, stored.body.model, body) if known is None else known


def _placed(stored: StoredPose, observed: Sequence[PointObservation]) -> PointTargets | None:
    """Return the placed joints of a frame: known joints, or those of a keyframe set by hand.

    Points that a user has marked in the images replace those of a keyframe: a body of other sizes may have missed them.
    """
    record, model = stored.record, stored.body.model
    joints = record.settings.get("joints")
    if joints:
        return place_joints(model, {n: np.array(p, dtype=np.float64) for n, p in joints.items()})
    if not {"manual", "pinned", "imported"} & set(record.sources):
        return None  # a tracked pose that was confirmed shows where the flesh is, not the joints
    if observed:
        return None
    return place_joints(model, stored.body.named_points_world, PLACED_M)


def _tracked_with(
    body: BodyModel, observer: Observer, frames: Sequence[int], known: PosedFrames, report: Report
) -> tuple[PosedFrames, PosedFrames]:
    """Track the person with a body of other sizes, and return the poses of the present one; see `_with_tracked`."""
    present = next(iter(known.bodies.values()))[0].model
    if body is present:
        return _with_tracked(observer, frames, known, report)
    good, usable = _with_tracked(observer, frames, _in_body(known, body), report)
    return _in_body(good, present), _in_body(usable, present)


def _in_body(frames: PosedFrames, body: BodyModel) -> PosedFrames:
    """Return the same frames with the poses of the person in another body."""
    return frames._replace(
        bodies={
            k: (PosedBody(body, retarget_pose(own.values, own.model, body)), *others)
            for k, (own, *others) in frames.bodies.items()
        }
    )


def _with_tracked(
    observer: Observer, frames: Sequence[int], known: PosedFrames, report: Report
) -> tuple[PosedFrames, PosedFrames]:
    """Track the person from the first known frame, in both directions; return the known frames with those that are
    good, and with doubtful ones too."""
    first = min(known.bodies)
    ahead, behind = [k for k in frames if k >= first], [k for k in frames if k <= first][::-1]
    room = max(_MOST_TRACKED // 2, _MOST_TRACKED - min(len(ahead), len(behind)))
    ways = [way[:room] for way in (ahead, behind) if len(way) > 1]
    own, done, total = known.bodies[first], 0, max(1, sum(map(len, ways)))
    subjects = Subjects.of([b.model for b in own], keyframes={k: {0: known.bodies[k][0].values} for k in known.placed})
    tracked: dict[str, dict[int, tuple[PosedBody, ...]]] = {"good": {}, "doubtful": {}, "lost": {}}
    for way in ways:
        run = TrackingRun(observer, subjects, [b.values for b in own], way)
        for found in ChamferTracker(TrackSettings()).estimates(run):
            done += 1
            report("tracking", done / total)
            people = zip(subjects.models, found.poses, strict=True)
            tracked[found.statuses[0]].setdefault(found.frame, tuple(PosedBody(m, v) for m, v in people))
    good = {**tracked["good"], **known.bodies}
    return known._replace(bodies=good), known._replace(bodies=tracked["doubtful"] | good)
