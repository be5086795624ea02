"""Import files of other programs: read them, place them at the frames of a session, check them, store them.

Files of stored key points are read again to see where each frame and person stands in them.
"""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tracker.errors import FormatError
from tracker.formats.joint_maps import JointMap, guess_joint_map, joint_map_of_size, read_joint_map
from tracker.formats.keypoints.picture_table import PictureTable
from tracker.formats.number_rows import check_size
from tracker.geometry.arrays import IntArray
from tracker.interchange.observations.checks import agreement_problem, picture_problems, timing_problems
from tracker.interchange.observations.masks import plan_masks
from tracker.interchange.observations.observed import ObservationSet, ObservedPoints
from tracker.interchange.observations.placing import place_pictures, read_space, rescaled
from tracker.interchange.observations.plans import ImportPlan, ImportRequest, MaskPlan, ViewPreview, refuse_choices
from tracker.interchange.observations.readers import MASK_FORMATS, PICTURE_FORMATS, find_files
from tracker.interchange.observations.sources import (
    FileGroup,
    Found,
    match_cameras,
    no_camera,
    source_files,
    videos_of_footage,
)
from tracker.interchange.observations.stored import files_folder, new_folder, save_observations, source_path
from tracker.interchange.observations.stored_masks import store_masks
from tracker.session.session import Session
from tracker.validation import Name, check


def plan_import(session: Session, request: ImportRequest, calibrated: bool = True) -> ImportPlan | MaskPlan:
    """Read files and check them against a session; nothing is written.

    Args:
        session: its cameras, frames and people.
        request: the files.
        calibrated: whether key points must agree with the cameras; not if they are there to calibrate them.

    Raises:
        FormatError: a file is missing or malformed, of an unknown format, or of no camera of the session.
        SessionError: the session has observations of this name.
    """
    new_folder(session, request.name)
    format_name, files = find_files(request.paths, request.masks)
    is_of_pictures = format_name in PICTURE_FORMATS
    refuse_choices(request, "masks" if format_name in MASK_FORMATS else "key points" if is_of_pictures else "joints")
    if format_name in MASK_FORMATS:
        return plan_masks(session, request, format_name, files)
    if not is_of_pictures:
        return _plan_of_space(session, request, format_name, files)
    return _plan_of_pictures(session, request, format_name, files, calibrated)


def store_import(session: Session, plan: ImportPlan | MaskPlan) -> Session:
    """Store an import with its session.

    Returns:
        The session; its cameras use masks that were imported.

    Raises:
        TrackerError: the first of the plan's problems.
        SessionError: it cannot be written.
    """
    if isinstance(plan, MaskPlan):
        return store_masks(session, plan)
    if plan.problems:
        raise plan.problems[0]
    save_observations(session, plan.observations, plan.files)
    return session


def _plan_of_pictures(
    session: Session, request: ImportRequest, format_name: str, files: list[Found], calibrated: bool
) -> ImportPlan:
    groups = PICTURE_FORMATS[format_name].read(files, session.camera_names)
    is_own = videos_of_footage([g for g, _ in groups], {c.camera.name: c.footage for c in session.cameras})
    others = [str(g.video) for (g, _), own in zip(groups, is_own, strict=True) if not own]
    groups = [pair for pair, own in zip(groups, is_own, strict=True) if own]
    names = match_cameras([(g.labels, g.place) for g, _ in groups], session.camera_names, request.cameras)
    unmatched = [g for (g, _), name in zip(groups, names, strict=True) if not name]
    problems = [no_camera(session.camera_names, g) for g in unmatched]
    chosen = {name: pair for pair, name in zip(groups, names, strict=True) if name}
    if not chosen:
        raise problems[0]
    cameras = {c.camera.name: c.camera for c in session.cameras}
    tables = {name: _scaled(table, cameras[name].size, request.picture_size) for name, (_, table) in chosen.items()}
    tables = {name: _with_certain_points(table) for name, table in tables.items()}
    if request.confidence is not None:
        tables = {name: _with_confidence(table, request.confidence) for name, table in tables.items()}
    problems += picture_problems(tables, cameras)
    frames, wrong, notes = place_pictures(tables, session, request.first_frame, request.offsets)
    problems += wrong
    point_names, joint_map, unknown = _skeleton(tables, request)
    problems += unknown
    points = _assemble(session, tables, frames, point_names)
    if calibrated and not problems:
        wrong, found = timing_problems(points, session.cameras, session.fps, request.offsets)
        problems, notes = problems + wrong, notes + found
    if calibrated and not problems and (disagreement := agreement_problem(points, [c.camera for c in session.cameras])):
        problems.append(disagreement)
    notes += [f"{name}: {note}" for name, table in tables.items() for note in table.notes]
    notes += _notes(tables)
    if others:
        notes.append(f"points of videos of other footage were left out: {', '.join(others[:3])}")
    sources, by_path = source_files([(g, name) for (g, _), name in zip(groups, names, strict=True)])
    rows = np.unique(np.concatenate([f for f in frames.values()])).astype(np.float64)
    observations = ObservationSet(
        request.name, format_name, request.people, joint_map, points, None, (rows,), sources, tuple(notes),
        request.options,
    )  # fmt: skip
    views = tuple(_preview(name, chosen, tables, points, v) for v, name in enumerate(session.camera_names))
    return ImportPlan(observations, by_path, views, tuple(problems))


def _scaled(table: PictureTable, size: tuple[int, int], given: tuple[int, int] | None) -> PictureTable:
    """Return points in the pixels of the camera, if they are said to be of pictures of another size, or are shares."""
    given = (1, 1) if table.size == (1, 1) else given
    if given is None:
        return table
    points = table.points.copy()
    points[..., :2] = rescaled(points[..., :2], given, size)
    return replace(table, points=points, size=None)


def _with_confidence(table: PictureTable, confidence: float) -> PictureTable:
    """Return points that all have one confidence where the file has none."""
    points = table.points.copy()
    if not table.has_confidence:
        points[..., 2] = np.where(table.is_found, confidence, 0.0)
    return replace(table, points=points)


def _with_certain_points(table: PictureTable) -> PictureTable:
    """Return points that are certain where a person set them, or where they alone state no confidence."""
    is_certain = table.is_found & np.isnan(table.points[..., 2])
    if not (table.has_confidence or table.is_by_hand) or not is_certain.any():
        return table
    points = table.points.copy()
    points[is_certain, 2] = 1.0
    note = f"{is_certain.sum()} points without a confidence, as a person sets them, were taken as certain"
    return replace(table, points=points, notes=(*table.notes, note))


def _skeleton(
    tables: Mapping[str, PictureTable], request: ImportRequest
) -> tuple[tuple[str, ...], JointMap, list[FormatError]]:
    """Return the names of the points, their convention, and what is wrong with it.

    Raises:
        FormatError: cameras have different points, a name cannot be stored, or the file of the map is malformed.
    """
    given = read_joint_map(request.joint_map) if request.joint_map is not None else None
    filled = {name: t for name, t in tables.items() if t.points.shape[2]} or dict(tables)
    first, *others = filled
    for other in others:
        (one, n), (two, m) = ((filled[x].names, filled[x].points.shape[2]) for x in (first, other))
        begins = [", ".join(found[:3])[:60] for found in (one, two)]
        if one != two or n != m:
            seen = f"{n} ({begins[0]}...) for camera '{first}' and {m} ({begins[1]}...) for camera '{other}'"
            raise FormatError.mismatch("", "the same points in all views", seen, "import files of one skeleton")
    names, n_points = filled[first].names, filled[first].points.shape[2]
    where = f"the files of camera '{first}'"
    check(list(names), list[Name], where, FormatError)
    numbered = names or tuple(f"point {i}" for i in range(n_points))
    try:
        if names:
            found = given or guess_joint_map(names, where)
        else:
            known = given if given is not None and given.points else joint_map_of_size(n_points, where)
            if len(known.points) != n_points:
                expected = f"the {len(known.points)} points that the joint map {known.name} lists"
                wrong = FormatError.mismatch(where, expected, n_points, "correct 'points' in the map")
                return numbered, known, [wrong]
            names, found = known.points, given or known
        return names, found, given.missing(names, f"{where} have no point") if given else []
    except FormatError as error:
        return numbered, JointMap("unknown", {}), [error]


def _assemble(
    session: Session, tables: Mapping[str, PictureTable], frames: Mapping[str, IntArray], names: tuple[str, ...]
) -> ObservedPoints:
    """Put the points of all cameras at the frames of the session."""
    most = max(t.points.shape[1] for t in tables.values())
    shape = (session.n_frames, len(session.camera_names), most, len(names))
    check_size((*shape, 3), "the key points")
    points_px, confidence = np.full((*shape, 2), np.nan), np.zeros(shape)
    named = [table.tracks for table in tables.values() if table.tracks is not None]
    tracks = np.zeros(shape[:3], dtype=np.result_type(np.dtype("<U1"), *named))
    for v, name in enumerate(session.camera_names):
        if name not in tables or tables[name].points.shape[2] != len(names):
            continue
        at = frames[name]
        inside = (at >= 0) & (at < session.n_frames)
        points = tables[name].points[inside]
        n = points.shape[1]
        known = tables[name].is_found[inside]
        points_px[at[inside], v, :n] = np.where(known[..., None], points[..., :2], np.nan)
        confidence[at[inside], v, :n] = np.where(known, np.clip(np.nan_to_num(points[..., 2]), 0.0, 1.0), 0.0)
        own = tables[name].tracks
        if own is not None:
            tracks[at[inside], v, :n] = own[inside]
    return ObservedPoints(names, session.camera_names, points_px, confidence, tracks)


def _notes(tables: Mapping[str, PictureTable]) -> list[str]:
    above = sum(int((t.points[..., 2] > 1).sum()) for t in tables.values())
    return [f"{above} confidences are above 1 and were taken as 1"] if above else []


def _preview(
    name: str,
    chosen: Mapping[str, tuple[FileGroup, PictureTable]],
    tables: Mapping[str, PictureTable],
    points: ObservedPoints,
    view: int,
) -> ViewPreview:
    if name not in chosen:
        return ViewPreview(name, None)
    table = tables[name]
    with_points = np.flatnonzero(points.is_known[:, view].any(axis=(1, 2)))
    frames = (int(with_points[0]), int(with_points[-1])) if len(with_points) else None
    known = table.is_found
    confidence = table.points[..., 2][known]
    median = float(np.median(confidence)) if len(confidence) else np.nan
    most = int(np.count_nonzero(known.any(axis=-1), axis=1).max(initial=0))
    return ViewPreview(name, chosen[name][0].place, len(table.numbers), frames, most, median)


def _plan_of_space(session: Session, request: ImportRequest, format_name: str, files: list[Found]) -> ImportPlan:
    placed, problems, notes = read_space(session, request, format_name, [path for path, _ in files])
    files.sort(key=lambda found: placed.places.index(found[0]) if found[0] in placed.places else len(files))
    sources, by_path = source_files([(FileGroup((path,), (path.stem,), root), "") for path, root in files])
    observations = ObservationSet(
        request.name, format_name, request.people, placed.joint_map, None, placed.joints, placed.row_frames, sources,
        tuple(notes), request.options,
    )  # fmt: skip
    views = []
    for k, (path, person) in enumerate(zip(placed.places, request.people, strict=True)):
        with_points = np.flatnonzero(np.isfinite(placed.joints.joints_world[:, k]).all(axis=-1).sum(axis=1))
        frames = (int(with_points[0]), int(with_points[-1])) if len(with_points) else None
        views.append(ViewPreview(person, path, len(placed.row_frames[k]), frames, 1))
    return ImportPlan(observations, by_path, tuple(views), tuple(problems))


class StoredPictures(NamedTuple):
    """The files of one camera."""

    camera: str
    files: tuple[Path, ...]
    """Within the session: one for each picture, or one for all."""
    table: PictureTable
    """Their content, in the pixels of the file."""
    frames: IntArray
    """Frame of the session of each picture, (n,)."""
    part: int
    """Number of this camera among those that the files hold."""


def stored_pictures(session: Session, observations: ObservationSet) -> list[StoredPictures]:
    """Read the files of key points again, and place them as they were when they were imported.

    Raises:
        FormatError: a file was changed meanwhile, so that it cannot be read.
    """
    of_path = {source_path(session, observations.name, s): s for s in observations.sources}
    root = files_folder(session, observations.name)
    groups = PICTURE_FORMATS[observations.format].read([(path, root) for path in of_path], session.camera_names)
    is_own = videos_of_footage([g for g, _ in groups], {c.camera.name: c.footage for c in session.cameras})
    pairs = zip(groups, is_own, strict=True)
    labels = [g.labels if own and not of_path[g.files[0]].camera else () for (g, _), own in pairs]
    matched = match_cameras([(n, g.place) for n, (g, _) in zip(labels, groups, strict=True)], session.camera_names, {})
    cameras = [of_path[g.files[0]].camera or name for (g, _), name in zip(groups, matched, strict=True)]
    tables = {name: table for name, (_, table) in zip(cameras, groups, strict=True) if name}
    options = dict(observations.options)
    first, late = options.get("first_frame"), json.loads(options.get("offsets", "{}"))
    frames, _, _ = place_pictures(tables, session, None if first is None else int(first), late)
    first_files = [group.files[0] for group, _ in groups]
    return [
        StoredPictures(name, group.files, table, frames[name], first_files[:i].count(group.files[0]))
        for i, (name, (group, table)) in enumerate(zip(cameras, groups, strict=True))
        if name
    ]
