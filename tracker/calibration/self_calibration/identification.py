"""First cameras from joints of people who are known by name or alone, and all people whom these cameras recognize."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from tracker.calibration.boards.camera_graph import MIN_SHARED
from tracker.calibration.boards.view_choice import MAX_LENS_VIEWS
from tracker.calibration.self_calibration.camera_chain import chain_cameras
from tracker.calibration.self_calibration.joint_adjustment import AdjustedJoints, Gauge, UnknownLenses
from tracker.calibration.self_calibration.named_people import NamedPeople, people_by_name
from tracker.calibration.self_calibration.people_matching import MatchedPeople, match_across_cameras
from tracker.calibration.self_calibration.person_calibration import Identified, adjusted_to
from tracker.calibration.self_calibration.rival_cameras import Solution
from tracker.calibration.self_calibration.seen_joints import SeenJoints, joints_of_people, own_columns
from tracker.calibration.self_calibration.stature import metres_per_unit
from tracker.compute.sampling import spread_indices
from tracker.errors import CalibrationError
from tracker.formats.model_toml import DEFAULT_HEIGHT_M
from tracker.geometry.arrays import IntArray
from tracker.geometry.camera_rig import scaled_cameras
from tracker.geometry.cameras import Camera
from tracker.geometry.robust_triangulation import Views
from tracker.interchange.observations.observed import ObservationSet

Statures = Mapping[str, float] | float | None
"""Statures of people by name, that of all, or nothing for typical adults, metres."""


class FirstCameras(NamedTuple):
    """Cameras that are about right, and the joints of the people whom they recognize."""

    cameras: tuple[Camera, ...]
    """In the unit of the gauge."""
    gauge: Gauge
    seen: SeenJoints
    """With sides mended."""
    statures_m: tuple[float, ...]
    """Of each person; NaN for one who does not count for the scale."""
    identified: Identified
    notes: tuple[str, ...]
    rivals: tuple[Solution, ...]
    """Other cameras that explain the first joints about as well."""


def first_cameras(
    observations: ObservationSet, cameras: Sequence[Camera], statures_m: Statures, lenses: UnknownLenses | None
) -> FirstCameras:
    """Find first cameras, and recognize people by them.

    The start are people whom the files name. Where they name nobody, or where the names contradict the cameras, it is
    the person in pictures that show nobody else.

    Args:
        observations: key points in pictures.
        cameras: at the origin, with their lenses or average ones.
        statures_m: of the people.
        lenses: knowledge of the lenses; None for lenses that stay as they are.

    Raises:
        CalibrationError: neither start leads to cameras.
    """
    points = observations.points
    assert points is not None
    named = people_by_name(points, cameras, own_columns(observations))
    alone = _alone(observations)
    if named is None:
        return _recognized(observations, alone, cameras, statures_m, lenses)
    try:
        return _recognized(observations, named, cameras, statures_m, lenses)
    except CalibrationError as error:
        if len(named.names) == 1 or isinstance(statures_m, Mapping):
            raise
        try:
            found = _recognized(observations, alone, cameras, statures_m, lenses)
        except CalibrationError:
            raise error from None
    note = "the names of the people contradict each other in the cameras and were not used"
    return found._replace(notes=(note, *found.notes))


def _alone(observations: ObservationSet) -> NamedPeople:
    """Return the person in pictures that show nobody else, who has no name."""
    points = observations.points
    assert points is not None
    present = points.is_known.any(axis=-1)
    return NamedPeople((), np.where(present & (present.sum(axis=2, keepdims=True) == 1), 0, -1))


def _recognized(
    observations: ObservationSet,
    start: NamedPeople,
    cameras: Sequence[Camera],
    statures_m: Statures,
    lenses: UnknownLenses | None,
) -> FirstCameras:
    """Find first cameras by some people, and recognize all: once by these cameras, and once by those of all people."""
    names, is_named = start.names or ("person",), bool(start.names)
    seen = joints_of_people(observations, start.persons, len(names))
    require_shared(seen, cameras, _left_out(observations, start.persons), is_named)
    few = seen.on_frames(_spread(start.persons))
    statures = statures_of(names, statures_m, is_named)
    (first, gauge), rivals = chain_cameras(few, cameras, statures, lenses)
    points = observations.points
    assert points is not None
    if len(names) == 1 and points.is_known.any(axis=-1).sum(axis=2).max() == 1:
        seen = joints_of_people(observations, start.persons, 1, _in_metres(first, few, statures))
        return FirstCameras(first.cameras, gauge, seen, statures, Identified(names), (), rivals)
    known = start.persons if is_named else np.full_like(start.persons, -1)
    for is_last in (False, True):
        in_metres = _in_metres(first, few, statures)
        matched = match_across_cameras(observations, Views(in_metres), known, len(start.names))
        _require_names(known, matched, cameras)
        names, persons = _frequent(matched, start.names)
        statures = statures_of(names, statures_m, is_named)
        seen = joints_of_people(observations, persons, len(names), in_metres)
        identified = Identified(names, _left_out(observations, persons), int(matched.is_exchanged.sum()))
        require_shared(seen, cameras, identified.n_left_out, True)
        if is_last:
            _require_recognized(observations, persons)
        else:
            few = seen.on_frames(_spread(persons))
            first = adjusted_to(first.cameras, few, gauge, lenses)
    notes = _notes(start, identified, statures_m)
    return FirstCameras(first.cameras, gauge, seen, statures, identified, notes, rivals)


def _spread(persons: IntArray) -> IntArray:
    """Return some frames on which two cameras show people, spread over all of them."""
    frames = np.flatnonzero((persons >= 0).any(axis=2).sum(axis=1) > 1)
    return frames[spread_indices(len(frames), MAX_LENS_VIEWS)]


def _in_metres(adjusted: AdjustedJoints, seen: SeenJoints, statures_m: Sequence[float]) -> tuple[Camera, ...]:
    scale = metres_per_unit(seen.by_joint(adjusted.points_world), seen.names, statures_m)
    return scaled_cameras(adjusted.cameras, scale)


def _frequent(matched: MatchedPeople, names: Sequence[str]) -> tuple[tuple[str, ...], IntArray]:
    """Return the names of the people whom two cameras show on several frames, and the person of each detection."""
    is_seen = (matched.persons[..., None] == np.arange(matched.n_people)).any(axis=2)
    counts = (is_seen.sum(axis=1) > 1).sum(axis=0)
    kept = np.flatnonzero(counts >= min(MIN_SHARED, counts.max())).tolist()
    numbers = np.full(matched.n_people + 1, -1)  # the last one is that of nobody
    numbers[kept] = np.arange(len(kept))
    others = [f"person {k + 1}" for k in range(len(kept))] if len(kept) > 1 else ["person"]
    return tuple(names[p] if p < len(names) else others[kept.index(p)] for p in kept), numbers[matched.persons]


def _left_out(observations: ObservationSet, persons: IntArray) -> int:
    """Return the number of pictures that show people, of whom nobody is used."""
    points = observations.points
    assert points is not None
    return int((points.is_known.any(axis=(2, 3)) & (persons < 0).all(axis=2)).sum())


def _require_names(named: IntArray, matched: MatchedPeople, cameras: Sequence[Camera]) -> None:
    """Refuse names that mean nothing in a camera, by people whom another one names on the same frame.

    Names that two cameras give two people at random agree on half of the frames; on the others, one of the cameras is
    outvoted. So three of four names stand then.
    """
    of = named[..., None] == np.arange(named.max(initial=-1) + 1)
    is_shared = (of & (of.any(axis=2).sum(axis=1) > 1)[:, None, None]).any(axis=-1)
    for v, camera in enumerate(cameras):
        n_named = int(is_shared[:, v].sum())
        n_off = int((is_shared & (matched.persons != named))[:, v].sum())
        if 4 * n_off > n_named:
            raise CalibrationError(
                f"expected names that mean one person in all cameras, found {n_off} of {n_named} in camera "
                f"'{camera.name}' that do not fit the other cameras; correct the tracks, or film one person alone"
            )


def _require_recognized(observations: ObservationSet, persons: IntArray) -> None:
    """Refuse cameras that do not recognize over a quarter of the people, as `_require_names` refuses names.

    Somebody whom one camera alone finds does not count.
    """
    points = observations.points
    assert points is not None
    counts = points.is_known.any(axis=-1).sum(axis=2)
    expected = np.minimum(counts, np.sort(counts, axis=1)[:, -2:-1])
    n_people, n_found = int(expected.sum()), int(np.minimum(expected, (persons >= 0).sum(axis=2)).sum())
    if 4 * (n_people - n_found) > n_people:
        raise CalibrationError(
            f"expected people who fit between the cameras, found {n_people - n_found} of {n_people} in pictures who do "
            "not; let one person walk through the volume alone for longer, or name the people in all files"
        )


def require_shared(seen: SeenJoints, cameras: Sequence[Camera], n_left_out: int, is_named: bool) -> None:
    """Check that each camera shows people on frames on which others show them, too."""
    for i, camera in enumerate(cameras):
        others = np.delete(seen.is_seen, i, axis=1).any(axis=1)
        n_frames = int((seen.is_seen[:, i] & others).any(axis=1).sum())
        if n_frames < MIN_SHARED:
            unknown = "" if is_named else ", because not all files name the people"
            crowded = f"; {n_left_out} pictures show several people and were left out{unknown}" if n_left_out else ""
            remedy = " or name the people in the files of all cameras" if n_left_out and not is_named else ""
            raise CalibrationError(
                f"expected one person in camera '{camera.name}' together with another camera on at least {MIN_SHARED} "
                f"frames, found {n_frames}{crowded}; film one person where they see the same place{remedy}"
            )


def statures_of(names: Sequence[str], statures_m: Statures, is_named: bool) -> tuple[float, ...]:
    """Return the stature of each person, metres; NaN for one without, where others have one.

    Raises:
        CalibrationError: a name is none of the people.
    """
    if not isinstance(statures_m, Mapping):
        return (DEFAULT_HEIGHT_M if statures_m is None else statures_m,) * len(names)
    unknown = [name for name in statures_m if name not in names]
    if unknown or not is_named:
        found = f"the people {', '.join(names)}" if is_named else "no names of people in the files"
        raise CalibrationError(
            f"expected heights of people whom the files name, found '{next(iter(unknown or statures_m))}' and {found}; "
            "correct the name, or give one height"
        )
    return tuple(statures_m.get(name, np.nan) for name in names)


def _notes(start: NamedPeople, identified: Identified, statures_m: Statures) -> tuple[str, ...]:
    """Return sentences on who was taken for whom."""
    out = []
    if start.renamed:
        files = ", ".join(start.renamed)
        out.append(f"key points of {files} name people otherwise than those of {start.named_by}, whose names are used")
    if start.unproved:
        files = ", ".join(start.unproved)
        out.append(
            f"the joints do not show whether key points of {files} name the people as the others do; names count"
        )
    if identified.n_exchanged:
        out.append(
            f"{identified.n_exchanged} times a file gives a person the name of another, by what other cameras show"
        )
    if identified.n_left_out:
        out.append(f"{identified.n_left_out} pictures show people who cannot be identified, and were left out")
    if len(identified.names) > 1 and isinstance(statures_m, int | float):
        out.append(f"the height was taken for that of each of the {len(identified.names)} people")
    return tuple(out)
