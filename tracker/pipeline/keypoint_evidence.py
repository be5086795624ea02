"""Key points of imported observations in a session: first poses from them, and evidence of a run.

How a detector sees each person is learnt before a run and stored, so that one that goes on uses the same.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tracker.body.dimensions import HEIGHT_LIMITS_M
from tracker.body.model import BodyModel, PosedBody
from tracker.compute.sampling import spread_indices
from tracker.errors import Remedy, TrackerError
from tracker.estimation.acquisition.from_joints import place_joints
from tracker.estimation.acquisition.from_keypoints import (
    DetectorModel,
    PersonObservations,
    fit_to_keypoints,
    learn_seen_body,
)
from tracker.estimation.acquisition.segment_lengths import segment_lengths
from tracker.estimation.fitting.gauss_newton import PointTargets
from tracker.estimation.fitting.hypothesis import Hypothesis
from tracker.estimation.initialization.first_pose import FirstPose, FirstPoses
from tracker.evidence.keypoints import KeypointEvidence
from tracker.evidence.observer import Observer
from tracker.formats.model_toml import format_model, has_preset_sizes
from tracker.interchange.observations.assignment import people_by_poses
from tracker.interchange.observations.body_points import body_points
from tracker.interchange.observations.observed import ObservationSet
from tracker.interchange.observations.stored import load_observations
from tracker.session.session import Session
from tracker.session.store.annotation_store import AnnotationStore

SEEN_BODIES = "seen bodies"
"""Setting of the session: how the detector of each set of observations sees the people, see `seen_bodies_record`."""
_OFFSET_M = 0.025
"""Standard deviation of the constant offset of a detector's joint, metres: hips and shoulders are off by 2 to 5 cm."""
SOURCE = "key points"
"""Source of a first pose."""
MAX_FRAMES = 12
"""Largest number of frames on which a first pose is looked for: a fit to key points takes 80 ms of processor time, so
that twelve take a second."""


def read_points(session: Session, name: str) -> dict[int, PersonObservations]:
    """Return the observed points of each person, by index, that are points of the person's body.

    Args:
        session: the session.
        name: of the observations.

    Raises:
        TrackerError: there are no such observations, or they are of nobody in the session.
    """
    _, found = _assigned(session, name)
    return {i: found[p.name].known_to(p.model) for i, p in enumerate(session.people) if p.name in found}


def assigned_observations(session: Session, name: str) -> ObservationSet:
    """Return observations with the people in the order in which they are observed.

    Stored poses of the session decide who is who in key points of several people. Points in space keep the order in
    which their files were given.

    Raises:
        TrackerError: there are no such observations.
    """
    return _assigned(session, name)[0]


def _assigned(session: Session, name: str) -> tuple[ObservationSet, dict[str, PersonObservations]]:
    observations = load_observations(session, name)
    found = body_points(observations, [c.camera for c in session.cameras])
    before = observations.people
    if observations.points is None or not found or not set(before) <= {p.name for p in session.people}:
        return observations, found
    joints = np.stack([found[p].joints_world for p in before], axis=1)
    people = people_by_poses(session, before, found[before[0]].names, joints)
    return replace(observations, people=people), {n: found[o] for n, o in zip(people, before, strict=True)}


def find_by_keypoints(session: Session, people: Sequence[int], frames: Sequence[int], name: str) -> FirstPoses:
    """Find the first poses of people from key points, all on one frame. Pictures are not looked at.

    Frames are spread over the half on which most points of all are known. The one whose key points fit the bodies best
    is taken. A body in preset sizes takes the height of the points.

    Args:
        session: the session; nothing is stored.
        people: indices of the people.
        frames: that may be used.
        name: of the observations.

    Raises:
        TrackerError: the observations lack somebody, or have too few points of them.
    """
    points, cameras = read_points(session, name), [c.camera for c in session.cameras]
    known = dict.fromkeys(frames, 0)
    for person in people:
        who = session.people[person].name
        if person not in points:
            raise TrackerError(f"expected key points of '{who}' in '{name}', found none; import them, too")
        n_points = {k: len(points[person].places(k)) for k in frames}
        if max(n_points.values()) < 4:
            raise TrackerError(
                f"expected a frame with four joints of '{who}' in '{name}', found none; place the body by hand",
                Remedy("place_body"),
            )
        known = {k: n + n_points[k] for k, n in known.items() if n_points[k] >= 4}
    if not known:
        raise TrackerError(
            f"expected a frame on which '{name}' has four joints of everybody, found none; find people one by one"
        )
    usual = np.median(list(known.values()))
    better = [k for k, n in known.items() if n >= usual]
    tried = [better[i] for i in spread_indices(len(better), MAX_FRAMES)]
    bodies, costs = dict[int, Mapping[int, PosedBody]](), dict[int, dict[int, float]]()
    for person in people:
        seen = points[person]
        bodies[person] = fit_to_keypoints(at_observed_height(session.people[person].model, seen), seen, tried)
        costs[person] = learn_seen_body(bodies[person], seen, cameras).costs(bodies[person], seen, cameras)
    frame = min(tried, key=lambda k: sum(of_person[k] for of_person in costs.values()))
    starts = {i: Hypothesis(bodies[i][frame], SOURCE, costs[i][frame], is_measured=False) for i in people}
    return FirstPoses(
        frame, {i: FirstPose(frame, start, "doubtful", float("nan"), True, ()) for i, start in starts.items()}
    )


def at_observed_height(model: BodyModel, points: PersonObservations) -> BodyModel:
    """Return a body in preset sizes at the height at which most of its segments are as long as those observed."""
    if not has_preset_sizes(model):
        return model
    lengths = segment_lengths(model.named_points_world(model.neutral()))
    seen = segment_lengths({n: points.joints_world[:, i] for i, n in enumerate(points.names)})
    ratio = float(np.median([seen[n] / lengths[n] for n in lengths]))
    return model.with_height(float(np.clip(model.height_m * ratio, *HEIGHT_LIMITS_M)))


def seen_joints(model: BodyModel, points: PersonObservations, n_frames: int) -> dict[int, PointTargets]:
    """Return the observed limb joints of a person by frame, to acquire sizes with.

    A joint is off by as much on all frames, so that those of several frames together count as one.

    Args:
        model: the body.
        points: of the person.
        n_frames: number of frames from which sizes are acquired.
    """
    sigma_m, frames = _OFFSET_M * n_frames**0.5, range(len(points.joints_world))
    placed = {k: place_joints(model, points.places(k), sigma_m) for k in frames}
    return {k: t for k, t in placed.items() if len(t.points)}


def learn_seen_bodies(
    session: Session,
    points: Mapping[int, PersonObservations],
    bodies: Mapping[int, Mapping[int, PosedBody]] | None = None,
) -> dict[int, DetectorModel]:
    """Learn how the detector sees each person.

    Args:
        session: the session with the present bodies.
        points: of each person, see `read_points`.
        bodies: of people whose poses other evidence shows: by index of the person and by frame, in the present bodies.
            Others are posed by the key points alone, which do not show what all of them have in common.
    """
    cameras, out = [c.camera for c in session.cameras], dict[int, DetectorModel]()
    for person, own in points.items():
        known = (bodies or {}).get(person) or fit_to_keypoints(session.people[person].model, own)
        if known:
            out[person] = learn_seen_body(known, own, cameras)
    return out


def keypoint_evidence(
    session: Session, points: Mapping[int, PersonObservations], seen: Mapping[int, DetectorModel], views: Sequence[str]
) -> KeypointEvidence:
    """Return key points as evidence of a run.

    Args:
        session: the session with the present bodies.
        points: of each person, see `read_points`.
        seen: how the detector sees each person, by index; people who are left out have no key points.
        views: names of the cameras of the run.
    """
    cameras = [c.camera for c in session.cameras]
    names = [c.name for c in cameras]
    people = tuple(
        seen[i].keypoints(p.model, points[i], cameras) if i in seen and i in points else None
        for i, p in enumerate(session.people)
    )
    return KeypointEvidence(people).of_views([names.index(v) for v in views])


def with_keypoints(
    session: Session,
    observer: Observer,
    points: Mapping[int, PersonObservations],
    seen: Mapping[int, DetectorModel] | None = None,
) -> Observer:
    """Return an observer to which key points are evidence, too; `seen` as in `keypoint_evidence`, learnt by default."""
    known = learn_seen_bodies(session, points) if seen is None else seen
    views = [c.camera.name for c in observer.cameras]
    return observer.with_keypoints(keypoint_evidence(session, points, known, views))


def seen_bodies_record(
    session: Session, name: str, seen: Mapping[int, DetectorModel], before: Mapping[str, Any]
) -> Any:
    """Return the setting `SEEN_BODIES` with how one detector sees the people, whose bodies are noted.

    Args:
        session: the session with the present bodies.
        name: of the observations.
        seen: by index of the person.
        before: the setting so far.
    """
    own = {
        session.people[i].name: {
            "body": format_model(session.people[i].model), "points": list(s.names),
            "offsets_m": s.offsets_part.tolist(), "sigmas": s.sigmas.tolist(),
        }
        for i, s in seen.items()
    }  # fmt: skip
    return {**before, name: own}


def stored_seen_bodies(session: Session, store: AnnotationStore, name: str) -> dict[int, DetectorModel] | None:
    """Return how a detector sees the people by their present bodies, as it was stored; None where it was not."""
    stored = store.setting(SEEN_BODIES, {}).get(name)
    if stored is None:
        return None
    out = dict[int, DetectorModel]()
    for i, person in enumerate(session.people):
        own = stored.get(person.name)
        if own is None:
            continue
        if own["body"] != format_model(person.model):
            return None
        out[i] = DetectorModel(tuple(own["points"]), np.array(own["offsets_m"]), np.array(own["sigmas"]))
    return out
