"""Judge imported joints limb by limb, and say why."""

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from tracker.body.model import BodyModel
from tracker.compute.progress import Report, unreported
from tracker.errors import TrackerError
from tracker.estimation.acquisition.from_keypoints import PersonObservations
from tracker.estimation.tracking.pose_errors import point_covariances
from tracker.estimation.tracking.tracker import TrackerSettings
from tracker.evaluation.judging.verdicts import LIMBS, is_exchanged, jumps, outside, probability_beyond, with_doubt
from tracker.evidence.observer import Observer
from tracker.evidence.view_evidence import ViewEvidence
from tracker.formats.joint_maps import JointMap
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import GroundPlane, floor_plane
from tracker.interchange.observations.stored import save_observations, source_path
from tracker.interchange.plausibility.examine import contradictions
from tracker.interchange.plausibility.readings import Reading, ReadPoints, read_beside
from tracker.pipeline.automatic_run import ChainPlan, Sink, StoredSession, find_and_track
from tracker.pipeline.find_people import FindSettings
from tracker.pipeline.keypoint_evidence import assigned_observations, read_points
from tracker.pipeline.stored_run import TrackPlan
from tracker.session.session import Session, create_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.stored_poses import StoredPose, read_stored_poses

_NOTABLE_M = 0.03
"""Constant offset of a joint from which it is worth a sentence, metres: conventions differ by less at most joints."""
_PARTS = (("upper_arm", 0, 1), ("forearm", 1, 2)), (("thigh", 0, 1), ("calf", 1, 2))
"""Parts of arms and of legs, between joints of the limb."""
_ALONG = np.linspace(0.2, 0.8, 7)
"""Places along a part that are looked for in the silhouettes."""


class LimbVerdict(NamedTuple):
    """Judgement of one limb on one frame."""

    probability_off: float
    """That a joint of it is farther than `OFF_M` from its true place."""
    distance_m: float
    """Distance of its farthest joint from the tracked one, metres."""
    reason: str
    """Why, for people; empty where it is in order."""
    joint: str = ""
    """Name of its farthest joint."""

    @property
    def is_doubted(self) -> bool:
        """Whether the limb is more likely off than not; it gets a reason then."""
        return self.probability_off >= 1 - self.probability_off


class Doubt(NamedTuple):
    """A limb on a frame, for a list by severity."""

    frame: int
    limb: str
    verdict: LimbVerdict


@dataclass(frozen=True, eq=False)
class Judgement:
    """Judgement of the imported joints of one person."""

    person: str
    frames: Mapping[int, Mapping[str, LimbVerdict]]
    """By frame and limb; limbs of which no joint is known are left out."""
    offsets_m: Mapping[str, Array]
    """Median step from each tracked joint to the imported one, forward, left and up of the body part, (3,), metres."""
    spread_m: Mapping[str, float]
    """Median distance that is left of each joint without its offset, metres."""
    imported: PersonObservations
    """The joints."""
    tracked: Mapping[int, StoredPose]
    """The poses that they were compared with, by frame."""
    lag_frames: int = 0
    """Frames by which the joints lag behind the tracked ones throughout; 0 if no lag is clear."""
    misread: tuple[str, ...] = ()
    """By what names, axes or unit all joints would fit a person better, or why they fit none."""

    @property
    def worst(self) -> list[Doubt]:
        """All limbs, the most likely and farthest off first."""
        doubts = [Doubt(k, limb, v) for k, of_frame in self.frames.items() for limb, v in of_frame.items()]
        return sorted(doubts, key=lambda d: (-round(d.verdict.probability_off, 2), -d.verdict.distance_m))

    @property
    def share_in_order(self) -> float:
        """Share of the frames with no limb that is off."""
        fine = [all(not v.is_doubted for v in of_frame.values()) for of_frame in self.frames.values()]
        return float(np.mean(fine)) if fine else 1.0

    @property
    def sentences(self) -> list[str]:
        """Sentences on what is off throughout."""
        out = [*self.misread]
        if self.lag_frames:
            n, word = abs(self.lag_frames), "late" if self.lag_frames > 0 else "early"
            out.append(f"all joints are {n} frame{'s' * (n != 1)} {word} throughout")
        for joint in (j for joints in LIMBS.values() for j in joints if j in self.offsets_m):
            offset = self.offsets_m[joint]
            length = float(np.linalg.norm(offset))
            if length > _NOTABLE_M:
                out.append(f"{joint.replace('_', ' ')} off by {100 * length:.0f} cm throughout: {_directions(offset)}")
        return out


def judge(
    session: Session, observer: Observer, name: str, settings: TrackerSettings, sink: Sink, report: Report = unreported
) -> list[Judgement]:
    """Judge imported observations of all their people.

    People are tracked from the observations by contours and key points, in sizes that are acquired. A joint is off
    where it lies farther from the tracked one than the expected error of that explains.

    Args:
        session: the session, which stays as it is.
        observer: of its recording.
        name: of the observations.
        settings: of the tracker.
        sink: receives the progress of the tracking. An exception that it raises ends the work.
        report: shows the progress of what follows.

    Raises:
        TrackerError: there are fewer than three cameras, the observations are of nobody in the session, or tracking
            cannot begin.
    """
    if len(session.cameras) < 3:
        raise TrackerError(
            f"expected three cameras or more to judge, found {len(session.cameras)}: without one of two, nothing shows "
            "depth"
        )
    points = read_points(session, name)
    if not points:
        raise TrackerError(
            f"expected observations of somebody in the session, found none in '{name}'; import them again"
        )
    best = best_motion(session, observer, name, tuple(points), settings, sink)
    floor = floor_plane(session.up, session.floor)
    names = [p.name for p in session.people]
    return [judge_person(names[i], points[i], best[i], observer, session.fps, report, floor) for i in points]


def judge_person(
    person: str, imported: PersonObservations, tracked: Mapping[int, StoredPose], observer: Observer | None,
    fps: float, report: Report = unreported, floor: GroundPlane | None = None,
) -> Judgement:  # fmt: skip
    """Judge the imported joints of a person by tracked poses.

    Args:
        person: name.
        imported: the joints.
        tracked: poses by frame, with the errors of their points.
        observer: shows where the person is, for the reasons; None for reasons without.
        fps: frames per second.
        report: shows progress. An exception that it raises ends the work.
        floor: of the session; None for that across z.
    """
    frames = [k for k in sorted(tracked) if k < len(imported.joints_world)]
    at = {n: i for i, n in enumerate(imported.names)}
    gaps = np.array([_gaps(imported, tracked[k], k) for k in frames]).reshape(len(frames), len(at), 3)
    has_jumped = dict(zip(frames, jumps(imported.joints_world[frames]), strict=True)) if frames else {}
    out, usual = dict[int, dict[str, LimbVerdict]](), _usual_errors(tracked)
    for number, (k, of_frame) in enumerate(zip(frames, gaps, strict=True)):
        report("comparing", number / len(frames))
        own, verdicts = tracked[k], dict[str, LimbVerdict]()
        for limb, joints in LIMBS.items():
            columns = [at[j] for j in joints if j in at and np.isfinite(of_frame[at[j]]).all()]
            if columns:
                names = [imported.names[i] for i in columns]
                verdicts[limb] = _verdict(own, usual, limb, names, of_frame[columns])
        doubted = [limb for limb, v in verdicts.items() if v.is_doubted]
        if doubted:
            seen = _Outside(observer, k) if observer is not None else None
            for limb in doubted:
                reason = _reason(limb, imported, own, k, has_jumped[k], seen, verdicts[limb])
                verdicts[limb] = verdicts[limb]._replace(reason=reason)
        out[k] = verdicts
    offsets, spread = _constant(imported, tracked, frames, gaps)
    points = [[tracked[k].body.model.point_names.index(n) for n in imported.names] for k in frames]
    places = np.array([tracked[k].body.joint_centers_world[p] for k, p in zip(frames, points, strict=True)])
    if not frames:
        return Judgement(person, out, offsets, spread, imported, tracked)
    known = dict(zip(imported.names, np.moveaxis(places, 1, 0), strict=True))
    up = floor_plane("z", floor).normal
    read = read_beside(known, imported.joints_world[frames], frames, up, fps, ignores_offsets=True)
    return Judgement(person, out, offsets, spread, imported, tracked, *_throughout(read))


def _throughout(read: ReadPoints) -> tuple[int, tuple[str, ...]]:
    """Return by how many frames joints lag behind tracked ones, 0 if that is not clear, and how they are misread."""
    reading = Reading(JointMap("the import", {name: name for name in read.names}))
    lag, found = read.lag(reading), contradictions(read, reading, [reading.joint_map], 0, in_space=True)
    of_limbs = ("shift_points", "check_world_of_file")  # lags and places, which are judged anyway
    misread = tuple(str(f) for f in found if f.remedy is None or f.remedy.code not in of_limbs)
    return 0 if lag is None else -lag.frames, misread


def _gaps(imported: PersonObservations, own: StoredPose, frame: int) -> Array:
    """Return from the tracked joints to the imported ones, (N, 3), metres."""
    model = own.body.model
    points = [model.point_names.index(n) for n in imported.names]
    return imported.joints_world[frame] - own.body.joint_centers_world[points]


def _usual_errors(tracked: Mapping[int, StoredPose]) -> Array | None:
    """Return the median covariance of the points, (n_points, 3, 3), m^2, for the start, which has not been assessed;
    None where nothing has been."""
    known = [t.record.errors for t in tracked.values() if t.record.errors is not None]
    return np.median(known, axis=0) if known else None


def _verdict(own: StoredPose, usual: Array | None, limb: str, names: Sequence[str], gaps: Array) -> LimbVerdict:
    points = [own.body.model.point_names.index(n) for n in names]
    known = usual if own.record.errors is None else own.record.errors
    errors = (point_covariances(own.body.model) if known is None else known)[points]
    off = with_doubt(probability_beyond(gaps, errors), np.array(_lost(own, limb)))
    distances = np.linalg.norm(gaps, axis=1)
    return LimbVerdict(float(off.max()), float(distances.max()), "", names[int(distances.argmax())])


def _lost(own: StoredPose, limb: str) -> float:
    """Return the probability that a tracked limb is lost; 0 where it was not assessed."""
    from tracker.body.limbs import limbs

    model, last = own.body.model, LIMBS[limb][1]
    part = model.point_parts[model.point_names.index(last)]
    lost = [p for x, p in zip(limbs(model), own.record.limbs_lost, strict=False) if part in x.parts]
    return float(lost[0]) if lost else 0.0


def _constant(
    imported: PersonObservations, tracked: Mapping[int, StoredPose], frames: Sequence[int], gaps: Array
) -> tuple[dict[str, Array], dict[str, float]]:
    """Return the median step of each joint in the frame of its part, and the median distance that is left."""
    offsets, spread = dict[str, Array](), dict[str, float]()
    for i, name in enumerate(imported.names):
        turned = [_turned(tracked[k], name, s[i]) for k, s in zip(frames, gaps, strict=True) if np.isfinite(s[i]).all()]
        if turned:
            offsets[name] = np.median(turned, axis=0)
            spread[name] = float(np.median(np.linalg.norm(turned - offsets[name], axis=1)))
    return offsets, spread


def _turned(own: StoredPose, name: str, step: Array) -> Array:
    model: BodyModel = own.body.model
    part = model.proximal_parts[model.point_names.index(name)]
    return np.asarray(own.body.kinematics.Ts_world_part[part, :3, :3].T @ step)


def _directions(offset: Array) -> str:
    words = (("forward", "back"), ("left", "right"), ("up", "down"))
    directions = [
        f"{100 * abs(x):.0f} cm {ahead if x > 0 else behind}"
        for x, (ahead, behind) in zip(offset, words, strict=True)
        if abs(x) > _NOTABLE_M / 3
    ]
    return ", ".join(directions)


def _reason(
    limb: str, imported: PersonObservations, own: StoredPose, frame: int, jumps: Array, outside: "_Outside | None",
    verdict: LimbVerdict,
) -> str:  # fmt: skip
    """Return why a limb is off, the most telling reason first."""
    _, kind = limb.split()
    pair = [LIMBS[f"{side} {kind}"] for side in ("left", "right")]
    at = {n: i for i, n in enumerate(imported.names)}
    model = own.body.model
    if all(j in at for joints in pair for j in joints):
        imported_places = np.array([imported.joints_world[frame][[at[j] for j in joints]] for joints in pair])
        centers = own.body.joint_centers_world
        places = np.array([centers[[model.point_names.index(j) for j in joints]] for joints in pair])
        if is_exchanged(imported_places, places):
            return f"{kind}s exchanged"
    said = [] if outside is None else outside.sentences(limb, imported.joints_world[frame], at)
    if any(jumps[at[j]] for j in LIMBS[limb] if j in at):
        said.append(f"{limb} jumps")
    return "; ".join(said) or f"{limb} {1000 * verdict.distance_m:.0f} mm from where the footage shows it"


class _Outside:
    """Finds parts of limbs that lie outside the silhouettes of a frame."""

    def __init__(self, observer: Observer, frame: int) -> None:
        self._views = observer.evidence(frame)
        self._names = [c.camera.name for c in observer.cameras]

    def sentences(self, limb: str, joints_world: Array, at: Mapping[str, int]) -> list[str]:
        """Return a sentence on each part of a limb that lies outside the person in a view."""
        side, kind = limb.split()
        out = []
        for part, first, last in _PARTS[kind == "leg"]:
            ends = [joints_world[at[LIMBS[limb][i]]] for i in (first, last) if LIMBS[limb][i] in at]
            if len(ends) < 2 or not np.isfinite(ends).all():
                continue
            points = ends[0] + _ALONG[:, None] * (ends[1] - ends[0])
            views = [n for n, v in zip(self._names, self._views, strict=True) if _is_outside(v, points)]
            if views:
                out.append(outside(f"{side}_{part}", views))
        return out


def _is_outside(view: ViewEvidence, points_world: Array) -> bool:
    """Return whether most points of a part are in the picture of a view, but not in its silhouette."""
    if view.silhouette is None:
        return False
    px = view.camera.project(points_world)
    inside = view.silhouette.inside
    u, v = np.round(px).astype(np.int64).T if np.isfinite(px).all() else (np.empty(0, np.int64),) * 2
    within = (u >= 0) & (v >= 0) & (u < inside.shape[1]) & (v < inside.shape[0])
    if np.count_nonzero(within) <= len(points_world) / 2:
        return False
    return bool(np.mean(inside[v[within], u[within]]) < 0.5)


def best_motion(
    session: Session, observer: Observer, name: str, people: tuple[int, ...], settings: TrackerSettings, sink: Sink
) -> dict[int, dict[int, StoredPose]]:
    """Track people from the key points' start, with acquired sizes, by contours and key points together.

    Everything is stored in a temporary folder; the session stays as it is.

    Args:
        session: the session.
        observer: of its recording.
        name: of the observations.
        people: indices of the people.
        settings: of the tracker.
        sink: receives progress. An exception that it raises ends the work.

    Returns:
        The poses of each person, by index and frame.

    Raises:
        TrackerError: see `find_and_track`.
    """
    with TemporaryDirectory(prefix="quadrille-judge-") as folder:
        twin = create_session(
            Path(folder) / "judged", cameras=session.cameras, people=session.people, fps=session.fps,
            n_frames=session.n_frames, up=session.up,
        )  # fmt: skip
        twin = replace(twin, floor=session.floor)
        observations = assigned_observations(session, name)
        files = {s.path: source_path(session, name, s) for s in observations.sources}
        save_observations(twin, observations, files)
        plan = ChainPlan(
            TrackPlan(range(session.n_frames), people, settings, keypoints=name), FindSettings(keypoints=name), people
        )
        with closing(AnnotationStore(twin.annotations_path)) as store:
            opened = StoredSession(twin, store, observer)
            find_and_track(plan, opened, sink)
        bodies = opened.session.people
        return {i: read_stored_poses(twin.annotations_path, bodies[i].name, bodies[i].model) for i in people}
