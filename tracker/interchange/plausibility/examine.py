"""Examine points of people by the body and by the footage: are they what they are read as?"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.formats.joint_maps import JointMap, joint_maps_of_size
from tracker.formats.model_toml import DEFAULT_HEIGHT_M
from tracker.formats.trc import MarkerTable, axes_matrix, is_mirrored
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.cameras import Camera
from tracker.geometry.ground_plane import floor_plane
from tracker.geometry.lengths import USUAL_SIZES
from tracker.interchange.observations.checks import SAMPLES
from tracker.interchange.observations.importing import plan_import
from tracker.interchange.observations.observed import ObservationSet, triangulate_observations
from tracker.interchange.observations.plans import ImportPlan, ImportRequest, MaskPlan
from tracker.interchange.plausibility.body_likelihood import PRIORS
from tracker.interchange.plausibility.filmed_people import segment_filmed_people
from tracker.interchange.plausibility.readings import Reading, ReadPoints
from tracker.session.session import Session


def plan_examined_import(session: Session, request: ImportRequest) -> ImportPlan | MaskPlan:
    """Read files, check them against a session, and examine their points; nothing is written.

    Raises:
        TrackerError: as `plan_import`.
    """
    plan = plan_import(session, request)
    return plan if isinstance(plan, MaskPlan) else examine_import(session, request, plan)


def examine_import(session: Session, request: ImportRequest, plan: ImportPlan) -> ImportPlan:
    """Return a plan with reasons against its points as problems, or as notes where the user accepts that.

    Args:
        session: its cameras, footage and people.
        request: the user's choices.
        plan: key points or joints at the frames of the session.
    """
    if plan.problems:
        return plan
    observations = plan.observations
    read = _read_points(session, observations, request.axes)
    given = Reading(observations.joint_map, request.axes)
    maps = [given.joint_map] if read.names else _known_maps(given.joint_map)
    first_row = int(observations.row_frames[0][0])
    found = contradictions(read, given, maps, first_row, in_space=observations.joints is not None)
    notes = _step_notes(read, given)
    if request.unusual:
        notes, found = [*(f"{problem}; kept, as chosen" for problem in found), *notes], []
    observations = replace(observations, notes=(*observations.notes, *notes))
    return replace(plan, observations=observations, problems=tuple(found))


def examine_joints(session: Session, person: int, joints: MarkerTable, axes: str, around: int) -> list[FormatError]:
    """Return reasons against joints of a person in space, by the frames around one.

    Args:
        session: its cameras, footage and people.
        person: index of the person.
        joints: positions under the body's names, at frames of the session, read by some axes of their file.
        axes: these axes.
        around: the frame.
    """
    reach = SAMPLES // 8  # a quarter of a stretch in all
    near = np.arange(max(0, around - reach), min(session.n_frames, around + reach + 1))
    rows = np.isin(joints.frames, near)
    points = np.full((len(near), 1, len(joints.names), 3), np.nan)
    points[joints.frames[rows] - near[0], 0] = joints.points[rows] @ axes_matrix(axes)
    own = JointMap("the file", {name: name for name in joints.names})
    read = _with_film(session, near, joints.names, points, (session.people[person].model.height_m,))
    return contradictions(read, Reading(own, axes), [own], int(joints.frames[0]), in_space=True)


def examine_keypoints(observations: ObservationSet, cameras: Sequence[Camera], fps: float) -> list[FormatError]:
    """Return reasons against the names of key points, by the bones of the people whom they calibrated.

    Args:
        observations: key points in pictures.
        cameras: calibrated by them, in a world with z up.
        fps: frames per second.
    """
    frames, names, points = _triangulated(observations, cameras, fps)
    statures = (DEFAULT_HEIGHT_M,) * points.shape[1]
    read = ReadPoints(names, points, frames, statures, floor_plane("z", None).normal, fps, None)
    given = Reading(observations.joint_map)
    maps = [given.joint_map] if names else _known_maps(given.joint_map)
    return contradictions(read, given, maps, 0, in_space=False)


def _read_points(session: Session, observations: ObservationSet, axes: str) -> ReadPoints:
    """Return the points of an import on the frames of its liveliest stretch, in the axes of the file."""
    heights = {p.name: p.model.height_m for p in session.people}
    statures = tuple(heights[name] for name in observations.people)
    if observations.joints is not None:
        points = observations.joints.joints_world @ axes_matrix(axes)
        chosen = _window(points, session.fps)
        return _with_film(session, chosen, observations.joints.names, points[chosen], statures)
    cameras = [c.camera for c in session.cameras]
    chosen, names, points = _triangulated(observations, cameras, session.fps)
    return _with_film(session, chosen, names, points, statures)


def _triangulated(
    observations: ObservationSet, cameras: Sequence[Camera], fps: float
) -> tuple[IntArray, tuple[str, ...], Array]:
    """Return the frames of the liveliest stretch of key points, their names if the file has some, and their places."""
    key_points = observations.points
    assert key_points is not None
    flat = np.where(key_points.is_known[..., None], key_points.points_px, np.nan)
    chosen = _window(flat.reshape(key_points.n_frames, -1, *flat.shape[-2:]), fps)
    px, confidence = key_points.points_px[chosen], key_points.confidence[chosen]
    few = replace(key_points, points_px=px, confidence=confidence, tracks=None, colors=None)
    found = triangulate_observations(replace(observations, points=few), cameras, mend_sides=False)
    names = () if key_points.names == observations.joint_map.points else key_points.names
    return chosen, names, found.joints.joints_world


def _with_film(
    session: Session, frames: IntArray, names: tuple[str, ...], points: Array, statures: tuple[float, ...]
) -> ReadPoints:
    up = floor_plane(session.up, session.floor).normal
    is_everybody = len(statures) == len(session.people)
    return ReadPoints(
        names, points, frames, statures, up, session.fps, segment_filmed_people(session, frames), is_everybody
    )


def _window(points: Array, fps: float) -> IntArray:
    """Return frames of the stretch in which points, (F, n_people, n_points, d), are known and move most.

    There are at most `SAMPLES`, over `PeoplePriors.stretch_s` or more.
    """
    step = max(1, round(fps * PRIORS.stretch_s / SAMPLES))
    n = min(len(points), step * SAMPLES)
    speeds = np.zeros(len(points))
    known = np.isfinite(points).all(axis=-1)
    moved = np.linalg.norm(np.diff(points, axis=0), axis=-1)
    scale = np.nanmedian(moved[moved > 0]) if (moved > 0).any() else 1.0
    speeds[1:] = np.nansum(np.minimum(moved / scale, SAMPLES), axis=(1, 2))
    weights = np.concatenate([[0.0], np.cumsum(speeds + known.sum(axis=(1, 2)))])
    first = int((weights[n:] - weights[:-n]).argmax()) if n else 0
    return np.arange(first, first + n, step)


def _known_maps(given: JointMap) -> list[JointMap]:
    return [given, *(m for m in joint_maps_of_size(len(given.points)) if m.name != given.name)]


def contradictions(
    read: ReadPoints, given: Reading, maps: Sequence[JointMap], first_row: int, in_space: bool
) -> list[FormatError]:
    """Return how points would fit better than as they are read, else why they are no person of the recording.

    Args:
        read: the points.
        given: the reading by which they would be stored.
        maps: names that they may have.
        first_row: frame of the session of the first row of the file.
        in_space: whether the file states their places in space.
    """
    if not any(np.isfinite(bones.stature) for bones in read.bones(given)):
        return []
    best = read.likeliest(given, [*maps, *(m.with_sides_exchanged for m in maps)], in_space)
    if any(_same(r, given) for r in best) or _impossible(read, best[0]):
        found = []
        if is_mirrored(given.axes) and not all(is_mirrored(r.axes) for r in best):
            text = f"the axes {given.axes} mirror the world, left to right, and nothing in the points confirms it"
            found = [FormatError(text, Remedy("turn_axis"))]
        best = [given]
    else:
        found = _others(read, given, best)
    if (lag := read.lag(best[0])) and abs(lag.frames) > PRIORS.in_step:
        text = f"expected points in step with the footage, found that they fit the frames of {lag} best"
        found.append(FormatError(text, Remedy("shift_points", frame=first_row + lag.frames)))
    return found or _impossible(read, best[0])


def _step_notes(read: ReadPoints, given: Reading) -> list[str]:
    """Say how far it is known that points are in step with the footage."""
    if read.known_people is None or not read.known_people.knows_frames:
        return []
    lag = read.lag(given)
    if lag is None:
        return ["the footage does not show whether the points are in step with it"]
    if abs(lag.frames) == PRIORS.in_step:
        return [f"the points fit the frames of {lag} best"]
    within = max(abs(lag.low), abs(lag.high))
    return [] if lag.frames or within <= PRIORS.in_step else [f"the points are in step within {within} frames"]


def _same(a: Reading, b: Reading) -> bool:
    return a.joint_map.name == b.joint_map.name and a.axes == b.axes and a.scale == b.scale


def _others(read: ReadPoints, given: Reading, best: Sequence[Reading]) -> list[FormatError]:
    """Return the names, axes and units by which the points would fit a person of the recording better."""
    first, found = best[0], list[FormatError]()
    bones = min(read.bones(given), key=lambda b: b.nats)
    low, high = bones.lengths
    if first.joint_map.points != given.joint_map.points:
        text = f"expected the points of a person as {given.joint_map.name} names them, found that the {bones.oddest} "
        text += f"would measure {low:.2f} to {high:.2f} m; they fit as {_listed(best, 'joint_map')}"
        found.append(FormatError(text, Remedy("read_as_skeleton", name=first.joint_map.name)))
    elif first.joint_map.name != given.joint_map.name:
        text = "expected knees, elbows and feet that point forwards, found that they do with left for right"
        found.append(FormatError(text, Remedy("exchange_sides")))
    if first.scale != given.scale:
        stature = min(read.bones(first), key=lambda b: b.nats).stature  # a body of another size has other proportions
        before, factor = stature * given.scale / first.scale, first.scale / given.scale
        text = f"expected a person of a usual height, found one {before:.4g} m tall; times {factor:.4g} "
        text += f"the points fit one of {stature:.2f} m"
        found.append(FormatError(text, Remedy("read_in_unit")))
    if first.axes != given.axes:
        found.append(_other_axes(read, given, best))
    return found


_ELSEWHERE = (
    "lie across the vertical or stand on their heads",
    "bend knees and elbows the wrong way, as in a mirror",
    "are elsewhere",
)
"""Reasons against axes, in the order of `ReadPoints.posture_and_place`."""


def _other_axes(read: ReadPoints, given: Reading, best: Sequence[Reading]) -> FormatError:
    first = best[0]
    other = replace(given, joint_map=first.joint_map, scale=first.scale)
    gains = np.subtract(read.posture_and_place(first), read.posture_and_place(other))
    text = f"expected people as the recording shows them, found that they {_ELSEWHERE[gains.argmax()]}; they fit "
    return FormatError(f"{text}with the axes {_listed(best, 'axes')}", Remedy("read_with_axes", axes=first.axes))


def _listed(best: Sequence[Reading], part: str) -> str:
    """List what equally likely readings have of a kind, at most three."""
    values = dict.fromkeys(r.joint_map.name if part == "joint_map" else r.axes for r in best)
    return " or ".join([*values][:3])


def _impossible(read: ReadPoints, reading: Reading) -> list[FormatError]:
    """Return why points are those of no person of the recording; nothing if they may be."""
    found = []
    for bones in read.bones(reading):
        low, high = bones.lengths
        if not bones.is_of_person:
            text = f"expected points of a person, found that the {bones.oddest} measures {low:.2f} to {high:.2f} m"
            found.append(FormatError(text, Remedy("check_points")))
        elif not USUAL_SIZES["person"].has(bones.stature):
            text = f"expected a person of a usual height, found one {bones.stature:.3g} m tall"
            found.append(FormatError(text, Remedy("check_points")))
    known_people = None if read.known_people is None else read.known_people.certain
    cost = replace(read, known_people=known_people).misplaced(reading)
    if not found and cost > PRIORS.most_off:
        places = np.concatenate([[*p.values()] for p in read.places(reading)], axis=1).reshape(-1, 3)
        middle = ", ".join(f"{x:.2f}" for x in np.nanmedian(places, axis=0))
        is_filmed = known_people is not None and known_people.knows_frames
        wanted, where = ("people", "their silhouettes") if is_filmed else ("points", "pictures")
        text = f"expected {wanted} that two cameras show, found {1 - cost:.0%} in {where}, around {middle} m"
        found.append(FormatError(text, Remedy("check_world_of_file")))
    return found[:1]
