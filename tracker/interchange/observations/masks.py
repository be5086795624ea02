"""Read and check masks of other programs: cameras, frames, sizes, values, masks that are empty or full."""

from collections.abc import Mapping

import numpy as np

from tracker.errors import FormatError, TrackerError
from tracker.footage.image_file import UNKNOWN
from tracker.formats.keypoints.detections import MAX_PEOPLE
from tracker.formats.keypoints.picture_table import PictureTable
from tracker.geometry.arrays import IntArray
from tracker.interchange.observations.placing import place_pictures, short_list
from tracker.interchange.observations.plans import (
    ImportRequest,
    MaskFiles,
    MaskPlan,
    MaskRules,
    MaskSurvey,
    ViewPreview,
    survey,
)
from tracker.interchange.observations.readers import MASK_FORMATS
from tracker.interchange.observations.sources import Found, match_cameras, no_camera, source_files
from tracker.session.matching import check_names
from tracker.session.session import Session

_ABSENT = "such frames count as without a mask"
_UNKNOWN = "unknown"
"""Name of the value of pixels that may be of people, beside the names of people."""


def plan_masks(session: Session, request: ImportRequest, format_name: str, files: list[Found]) -> MaskPlan:
    """Read masks and check them against a session; nothing is written.

    Raises:
        FormatError: a file is malformed, or none is of a camera of the session.
    """
    found = MASK_FORMATS[format_name].read(files, session.camera_names)
    names = match_cameras([(m.group.labels, m.group.place) for m in found], session.camera_names, request.cameras)
    problems: list[TrackerError] = [
        no_camera(session.camera_names, m.group) for m, name in zip(found, names, strict=True) if not name
    ]
    masks = {name: m for m, name in zip(found, names, strict=True) if name}
    if not masks:
        raise problems[0]
    tables = {name: PictureTable((), m.numbers, np.empty((len(m.numbers), 0, 0, 3))) for name, m in masks.items()}
    frames, wrong, notes = place_pictures(tables, session, request.first_frame, request.offsets, _ABSENT)
    surveys: dict[str, MaskSurvey] = {}
    unknown = 0 if _UNKNOWN in {p.name for p in session.people} else request.values.get(_UNKNOWN, 0)
    for source in session.cameras:
        name = source.camera.name
        if name in masks:
            try:
                surveys[name] = survey(masks[name], request.picture_size or source.camera.size, unknown)
            except TrackerError as error:
                problems.append(FormatError(f"camera '{name}': {error}", error.remedy))
    problems += wrong
    rules, odd = _rules(session, request, surveys)
    problems += odd
    for name, seen in surveys.items():
        shares = seen.shares_by(rules)
        problems += _extremes(name, shares, frames[name])
        if not shares.all():
            notes.append(f"camera '{name}': nobody in the masks of frames {short_list(frames[name][shares == 0])}")
    notes += [*_value_notes(rules, surveys), *dict.fromkeys(n for m in masks.values() for n in m.notes)]
    notes += [
        f"camera '{c.camera.name}': these masks take the place of those in {c.masks}"
        for c in session.cameras
        if c.masks is not None and c.camera.name in masks
    ]
    sources, by_path = source_files([(m.group, name) for m, name in zip(found, names, strict=True)])
    views = tuple(_preview(name, masks.get(name), surveys.get(name), rules, frames) for name in session.camera_names)
    return MaskPlan(
        request.name, format_name, masks, _pictures(session, request, frames), rules, sources, by_path, tuple(notes),
        request.options, views, tuple(problems),
    )  # fmt: skip


def _pictures(session: Session, request: ImportRequest, frames: Mapping[str, IntArray]) -> dict[str, IntArray]:
    """Return the picture of the footage of each mask by camera; -1 for those outside of a session, as it was chosen."""
    offsets = {c.camera.name: c.offset for c in session.cameras}
    out = {}
    for name, placed in frames.items():
        out[name] = placed + offsets[name]
        if request.first_frame is not None or request.offsets.get(name):
            out[name][(placed < 0) | (placed >= session.n_frames)] = -1
    return out


def _rules(
    session: Session, request: ImportRequest, surveys: Mapping[str, MaskSurvey]
) -> tuple[MaskRules, list[FormatError]]:
    """Return how values are read, and what contradicts that.

    More values than people are opacities, since nobody labels so many people.

    Raises:
        TrackerError: a value is given for somebody who is not in the session.
    """
    values = _values(surveys)
    is_matte, problems = len(values) > MAX_PEOPLE, list[FormatError]()
    kinds = {bool(k) for seen in surveys.values() for k in seen.is_alpha}
    if len(kinds) > 1:
        found = "some by the opacity of a picture and others by its values"
        problems.append(FormatError.mismatch("", "masks of one kind", found, "import them apart"))
    given = dict(request.values)
    numbers = {_UNKNOWN: UNKNOWN, **{p.name: i + 1 for i, p in enumerate(session.people)}}
    check_names(given, list(numbers), "person", "the values by person")
    for name, value in given.items():
        if surveys and (is_matte or value not in values):
            listed = "opacities" if is_matte else ", ".join(map(str, values[:10])) or "none"
            expected = f"masks with the value {value} for '{name}'"
            problems.append(FormatError.mismatch("", expected, listed, "correct the values"))
    if len(set(given.values())) < len(given):
        problems.append(FormatError("expected another value for each person, found one twice; correct the values"))
    return MaskRules(is_matte, {value: numbers[name] for name, value in given.items()} or None), problems


def _values(surveys: Mapping[str, MaskSurvey]) -> list[int]:
    return sorted(set().union(*(seen.values for seen in surveys.values())))


def _value_notes(rules: MaskRules, surveys: Mapping[str, MaskSurvey]) -> list[str]:
    values = _values(surveys)
    if rules.is_matte:
        return ["values are opacities: a pixel of half the highest value or more is a person"]
    others = [value for value in values if value not in (rules.people or {})]
    if len(values) > 1 and others:
        listed = ", ".join(map(str, others[:10])) + (" and others" if len(others) > 10 else "")
        return [f"people of {'value' if len(others) == 1 else 'values'} {listed} are not told from each other"]
    return []


def _extremes(name: str, shares: np.ndarray, frames: IntArray) -> list[FormatError]:
    """Return that the masks of a camera are all empty, or cover whole pictures."""
    where = f"camera '{name}'"
    if len(shares) and not shares.any():
        found, advice = f"nobody in all {len(shares)}", "export them again, or leave this camera out"
        return [FormatError.mismatch(where, "people in the masks", found, advice)]
    if (shares == 1).any():
        found = f"none on frames {short_list(frames[shares == 1])}, where people cover the whole picture"
        return [FormatError.mismatch(where, "background in each mask", found, "export them again")]
    return []


def _preview(
    name: str, masks: MaskFiles | None, seen: MaskSurvey | None, rules: MaskRules, frames: Mapping[str, IntArray]
) -> ViewPreview:
    if masks is None:
        return ViewPreview(name, None)
    n = len(masks.numbers)
    if seen is None:
        return ViewPreview(name, masks.group.place, n)
    shares = seen.shares_by(rules)
    placed = frames[name][shares > 0]
    span = (int(placed[0]), int(placed[-1])) if len(placed) else None
    share = float(np.median(shares[shares > 0])) if len(placed) else np.nan
    return ViewPreview(name, masks.group.place, n, span, share=share)
