"""Draw lines over the views: contours, candidates, part edges, epipolar lines, edge segments."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np

from app.drawing.facing import facing_arrow
from app.drawing.joint_handles import SIDES, Side, dragged_place, side_of
from app.drawing.observed_points import limbs_off, mask_outlines, observed_segments
from app.drawing.overlay_colors import KIND_COLORS
from app.drawing.seen_bodies import at_one_time, bodies_in, picture_times
from app.state.calibration import CorrectedFrame
from app.state.page_view import View
from app.state.state import State
from tracker.body.model import BodyModel, PosedBody, ahead
from tracker.estimation.contour.fit_steps import residual_segments
from tracker.estimation.fitting.retarget import retarget_pose
from tracker.evidence.contours import occluding_contours, part_edges
from tracker.evidence.contours.occluding_contours import Contour
from tracker.evidence.contours.pieces import PIECE_PX
from tracker.evidence.contours.surfaces import surfaces_of
from tracker.evidence.images.edge_segments import accept_segments
from tracker.evidence.view_evidence import ACCEPTED_SHARE, ViewEvidence
from tracker.geometry.arrays import Array, FloatArray, IntArray, Mask
from tracker.geometry.cameras import Camera
from tracker.geometry.framing import epipolar_segment
from tracker.interchange.observations.plans import MaskPlan
from tracker.session.session import Person, Session

_PERSON_KINDS = (
    "model", "hidden", "facing", "facing_away", "candidate", "compared", "preview", "alternative", "new_sizes",
)  # fmt: skip
"""Kinds of lines that belong to a person, and are left out when the person is hidden."""
_EDGE_STRIDE_PX = 3
"""Spacing of the edge pixels drawn. More would show only at high zoom, and cost the browser much."""


PathKind = Literal[
    "model", "hidden", "facing", "facing_away", "candidate", "compared", "preview", "alternative", "new_sizes",
    "former", "result", "residual", "part_edge", "epipolar", "accepted", "rejected", "floor", "floor_sight", "error",
    "imported", "imported_off", "other_copy",
]  # fmt: skip


class Path(NamedTuple):
    """Line segments of one kind in one view."""

    camera: int
    person: int
    kind: PathKind
    color: str
    segments_px: FloatArray
    """x0, y0, x1, y1, (N, 4), undistorted px."""
    side: Side = ""
    """Side of the body that they belong to."""


def paths(session: Session, state: State, view: View, views: Sequence[ViewEvidence] | None) -> list[Path]:
    """Draw the layers of a page in the views that it shows.

    Args:
        session: with its cameras and people.
        state: what to draw.
        view: what the page shows.
        views: the evidence of the shown frame; None draws no edge segments.
    """
    stored, state = state, state.drawn
    bodies = bodies_in(session, state)
    out = []
    tried = state.search.candidate if state.search.running or state.search_view.replay is not None else None
    drafted = _with_draft(state, bodies)
    others = _alternatives(state, bodies) if "alternatives" in view.layers else []
    changed = {i for i, (now, other) in enumerate(zip(bodies, others, strict=False)) if now is not other}
    replaced = {} if state.range_comparison is None else state.range_comparison.others.get(state.frame, {})
    former = bodies_in(session, state, [replaced.get(i, pose) for i, pose in enumerate(state.poses)])
    result = stored.poses if state is not stored and state.search_view.replay is None else None
    preview, replay = state.search_view.preview, state.search_view.replay
    outlined: tuple[tuple[PathKind, tuple[Array, ...] | None], ...] = (
        ("candidate", tried if "contours" in view.layers else None),
        ("compared", state.search_view.compared),
        ("compared", None if replay is None else replay.fitted_from),
        ("preview", None if preview is None else preview.poses),
        ("result", result),
    )
    mended = state.calibration.shown_on(state.frame)
    seen = {index: session.cameras[index].camera.pinhole for index in sorted(view.cameras)}
    is_traced = "contours" in state.compiled  # otherwise the contours' kernels are being compiled
    has_edges = is_traced and "part_edges" in view.layers
    times = picture_times(session, state.frame, seen)
    edges = _part_edges(bodies, seen, times) if has_edges else {}
    on_frame = bodies, drafted, others, former
    for index, camera in seen.items():
        bodies, drafted, others, former = ([b.ahead(times[index]) for b in people] for people in on_frame)
        if not is_traced:
            out += _skeletons(session, bodies, camera, index)
            continue
        if not view.layers.isdisjoint(("contours", "hidden")):
            out += _model(session, bodies, camera, index, view) if mended is None else _corrected(mended, index)
        if "contours" in view.layers and mended is None:
            out += _facing(session, bodies, camera, index)
        if state.draft is not None:
            out += _some({state.draft.person}, drafted, camera, index, "new_sizes")
        if others:
            out += _some(changed, others, camera, index, "alternative")
        if replaced:
            out += _some(replaced, former, camera, index, "compared")
        out += _found(state, bodies, camera, index, view)
        for kind, poses in outlined:
            if poses is not None:
                out += _outlined(ahead(bodies_in(session, state, poses), times[index]), camera, index, kind)
        if index in edges:
            out.append(Path(index, 0, "part_edge", KIND_COLORS["part_edge"], edges[index]))
        if views is not None:
            out += [s for s in _segments(bodies, views[index], index, view) if s.kind in view.layers]
            if replay is not None and replay.fitted_from is not None:
                lines = residual_segments(bodies, views[index])
                out.append(Path(index, 0, "residual", KIND_COLORS["residual"], lines))
    out += [line for index in seen for line in _imported(session, state, view, index)]
    if state.drag is not None and "epipolar" in view.layers:
        out += [line for line in _epipolar_lines(session, state) if line.camera in view.cameras]
    # A person who is sought and has no pose yet is drawn by candidates alone.
    people_not_drawn, hidden = state.people_not_drawn, state.visibility.hidden
    return [
        p for p in out
        if p.kind not in _PERSON_KINDS or p.person not in (hidden if p.kind == "candidate" else people_not_drawn)
    ]  # fmt: skip


def part_colors(people: Sequence[Person]) -> list[str]:
    """Return the colours of the parts of some people, in order."""
    return [part.color for person in people for part in person.model.parts]


def traced(bodies: Sequence[PosedBody], camera: Camera) -> Contour:
    """Trace contours for drawing: in pieces that look alike in pictures of any size."""
    return occluding_contours.trace(bodies, camera, PIECE_PX * max(1.0, max(camera.size) / 640))


def _model(session: Session, bodies: Sequence[PosedBody], camera: Camera, index: int, view: View) -> list[Path]:
    """Draw the visible and the occluded contours of the shown poses."""
    contour = traced(bodies, camera)
    out = []
    kinds: tuple[tuple[str, PathKind, Mask], ...] = (
        ("hidden", "hidden", contour.occluded),
        ("contours", "model", ~contour.occluded),
    )
    for layer, kind, pieces in kinds:
        if layer in view.layers and view.by_part:
            out += _by_part(session, bodies, contour, pieces, index, kind)
        elif layer in view.layers:
            out += _by_side(session, bodies, contour, pieces, index, kind)
    return out


def _corrected(found: CorrectedFrame, index: int) -> list[Path]:
    """Draw the visible contours of the people refitted under the corrected cameras."""
    bodies = found.bodies[index]
    contour = traced(bodies, found.cameras[index])
    colors = [KIND_COLORS["preview"]] * len(bodies)
    return _by_person(bodies, contour, ~contour.occluded, index, "preview", colors)


def _skeletons(session: Session, bodies: Sequence[PosedBody], camera: Camera, index: int) -> list[Path]:
    """Draw the bones of the shown poses in the place of their contours."""
    out = []
    for person, body in enumerate(bodies):
        places, px = {name: i for i, name in enumerate(body.model.point_names)}, camera.project(body.points_world)
        ends = np.array([(places[a], places[b]) for a, b in body.model.bones]).reshape(-1, 2)
        segments = px[ends].reshape(-1, 4)
        seen = segments[np.isfinite(segments).all(axis=1)].astype(np.float32)
        out.append(Path(index, person, "model", session.people[person].color, seen))
    return out


def _facing(session: Session, bodies: Sequence[PosedBody], camera: Camera, index: int) -> list[Path]:
    """Draw where the heads face."""
    out = []
    for person, body in enumerate(bodies):
        segments, is_away = facing_arrow(body, camera)
        kind: PathKind = "facing_away" if is_away else "facing"
        out.append(Path(index, person, kind, session.people[person].color, segments))
    return out


def _part_edges(
    bodies: Sequence[PosedBody], seen: Mapping[int, Camera], times: Mapping[int, float]
) -> dict[int, FloatArray]:
    """Return the curves in which parts intersect in some views, by index."""
    out: dict[int, FloatArray] = {}
    for time, group in at_one_time(times):
        found = part_edges.part_edges(ahead(bodies, time), [seen[index] for index in group])
        out |= dict(zip(group, found, strict=True))
    return out


def _outlined(bodies: Sequence[PosedBody], camera: Camera, index: int, kind: PathKind) -> list[Path]:
    """Draw the visible contours of other poses of all people."""
    contour = traced(bodies, camera)
    return _by_person(bodies, contour, ~contour.occluded, index, kind, [KIND_COLORS[kind]] * len(bodies))


def _with_draft(state: State, bodies: Sequence[PosedBody]) -> list[PosedBody]:
    """Return the bodies with the person whose sizes are being edited in the draft's body."""
    people, draft = list(bodies), state.draft
    if draft is not None:
        shown = people[draft.person]
        people[draft.person] = PosedBody(
            draft.model, retarget_pose(shown.values, shown.model, draft.model), shown.velocity
        )
    return people


def _alternatives(state: State, bodies: Sequence[PosedBody]) -> list[PosedBody]:
    """Return the bodies with everybody who has alternatives in the best of these; empty if nobody has any.

    Where the alternatives are ranked they are drawn one by one; see `app.drawing.ghosts`.
    """
    explained = None if state.reason is None or state.reason.alternatives is None else state.person
    best = [() if i == explained else shown.alternatives[:1] for i, shown in enumerate(state.people)]
    if not any(best):
        return []
    return [replace(b, values=poses[0]) if poses else b for b, poses in zip(bodies, best, strict=True)]


def _found(state: State, bodies: Sequence[PosedBody], camera: Camera, index: int, view: View) -> list[Path]:
    """Draw the people who were found on the shown frame so far, while the search for people goes on."""
    candidates = state.finding.candidates.get(state.frame)
    if not candidates or "contours" not in view.layers:
        return []
    return _some(candidates, [candidates.get(i, b) for i, b in enumerate(bodies)], camera, index, "candidate")


def _some(
    chosen: Collection[int], people: Sequence[PosedBody], camera: Camera, index: int, kind: PathKind
) -> list[Path]:
    """Draw the visible contours of some people, given by index, among all people."""
    contour = traced(people, camera)
    found = _by_person(people, contour, ~contour.occluded, index, kind, [KIND_COLORS[kind]] * len(people))
    return [path for path in found if path.person in chosen]


def _by_person(
    bodies: Sequence[PosedBody], contour: Contour, chosen: Mask, index: int, kind: PathKind, colors: Sequence[str]
) -> list[Path]:
    """Return some pieces of a contour as one path per person."""
    people = surfaces_of(tuple(b.model for b in bodies)).people[contour.parts]
    return [
        Path(index, person, kind, colors[person], contour.pieces_px[chosen & (people == person)])
        for person in range(len(bodies))
    ]


@lru_cache(maxsize=32)
def _part_sides(models: tuple[BodyModel, ...]) -> IntArray:
    """Return the side of each part of some bodies, as an index into `SIDES`; cached, because models are immutable."""
    return np.array([SIDES.index(side_of(part.name)) for model in models for part in model.parts])


def _by_side(
    session: Session, bodies: Sequence[PosedBody], contour: Contour, chosen: Mask, index: int, kind: PathKind
) -> list[Path]:
    """Return some pieces of a contour as one path per person and side of the body."""
    models = tuple(b.model for b in bodies)
    people = surfaces_of(models).people[contour.parts]
    sides = _part_sides(models)[contour.parts]
    return [
        Path(index, i, kind, person.color, contour.pieces_px[chosen & (people == i) & (sides == k)], side)
        for i, person in enumerate(session.people)
        for k, side in enumerate(SIDES)
    ]


def _by_part(
    session: Session, bodies: Sequence[PosedBody], contour: Contour, chosen: Mask, index: int, kind: PathKind
) -> list[Path]:
    """Return some pieces of a contour as one path per part that has any."""
    models = tuple(b.model for b in bodies)
    people, colors = surfaces_of(models).people, part_colors(session.people)
    sides = _part_sides(models)
    return [
        Path(
            index,
            int(people[part]),
            kind,
            colors[part],
            contour.pieces_px[chosen & (contour.parts == part)],
            SIDES[sides[part]],
        )
        for part in np.unique(contour.parts[chosen])
    ]


def _segments(bodies: Sequence[PosedBody], view: ViewEvidence, index: int, shown: View) -> list[Path]:
    """Draw the edge segments that the shown poses explain, and the others (GD96 Fig. 6)."""
    if shown.layers.isdisjoint(("accepted", "rejected")):
        return []
    segments, samples = view.segments, view.samples
    if segments is None or samples is None or not len(segments.points_px):
        return []
    contour = occluding_contours.trace(bodies, view.camera)
    chosen = accept_segments(samples, contour.pieces_px[~contour.occluded], ACCEPTED_SHARE * view.theta_px)
    lengths = np.diff(segments.firsts)
    owners = np.repeat(np.arange(len(lengths)), lengths)
    offsets = np.arange(len(owners)) - segments.firsts[owners]
    drawn = np.flatnonzero((offsets % _EDGE_STRIDE_PX == 0) | (offsets == lengths[owners] - 1))
    is_joined = owners[drawn[1:]] == owners[drawn[:-1]]
    # Resizing keeps the borders of pixels, not their centres.
    points_px = (segments.points_px[drawn] + np.array(view.corner_px, np.float32) + 0.5) / view.scale - 0.5
    lines = np.hstack([points_px[:-1], points_px[1:]])[is_joined].astype(np.float32)
    of_accepted = chosen[owners[drawn[:-1][is_joined]]]
    return [
        Path(index, 0, "rejected", KIND_COLORS["rejected"], lines[~of_accepted]),
        Path(index, 0, "accepted", KIND_COLORS["accepted"], lines[of_accepted]),
    ]


def _imported(session: Session, state: State, view: View, index: int) -> list[Path]:
    """Draw the imported points of the shown frame, and above them the limbs that are off; or masks to import."""
    found, source = state.observations, session.cameras[index]
    camera = source.camera
    if "imported" not in view.layers:
        return []
    if isinstance(found.plan, MaskPlan):
        outlines = mask_outlines(found.plan, camera, state.frame + source.offset)
        return [Path(index, 0, "imported", KIND_COLORS["imported"], outlines)]
    if found.drawn is None:
        return []
    lines: tuple[tuple[PathKind, FloatArray], ...] = (
        ("imported", observed_segments(found.drawn, camera, index, state.frame)),
        ("imported_off", limbs_off(found.drawn_judgements, camera, state.frame)),
    )
    return [Path(index, 0, kind, KIND_COLORS[kind], own) for kind, own in lines]


def _epipolar_lines(session: Session, state: State) -> list[Path]:
    """Draw the line of sight of the dragged point in the other views."""
    drag = state.drag
    assert drag is not None
    source = session.cameras[drag.camera].camera.pinhole
    point_world = dragged_place(session, state, drag)
    out = []
    for index, target in enumerate(session.cameras):
        if index != drag.camera:
            segment = epipolar_segment(source, target.camera.pinhole, source.project(point_world))
            if segment is not None:
                row = segment.reshape(1, 4).astype(np.float32)
                out.append(Path(index, drag.person, "epipolar", KIND_COLORS["epipolar"], row))
    return out
