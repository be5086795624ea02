"""What is drawn over the views: contours, candidates, part edges, joints, epipolar lines, segments of edges."""

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np

from app.state.page_view import View
from app.state.state import State
from tracker.body.model import BodyModel, PosedBody
from tracker.contours import occluding_contours, part_edges
from tracker.contours.occluding_contours import Contour
from tracker.evidence.view_evidence import ACCEPTED_SHARE, ViewEvidence
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, FloatArray
from tracker.geometry.cameras import Camera, epipolar_segment
from tracker.images.background_subtraction import Mask
from tracker.images.edge_segments import accept_segments
from tracker.posing.retarget import retarget_pose
from tracker.session.session import Person, Session

CANDIDATE_COLOR = "#ffffff"
COMPARED_COLOR = "#ff9df2"
PREVIEW_COLOR = "#5ce1ff"
OTHER_COLOR = "#d8f25a"
PART_EDGE_COLOR = "#9aa3ad"
EPIPOLAR_COLOR = "#ffd54a"
ACCEPTED_COLOR = "#35e0c8"
REJECTED_COLOR = "#ff4fa3"
_OF_A_PERSON = ("model", "hidden", "candidate", "ghost")
"""Kinds of lines that are somebody's, and go where that person is not to be shown."""
_EDGE_STRIDE = 3
"""Every so many pixels of an edge are drawn: more would be seen only far in, and cost the browser much."""


class Path(NamedTuple):
    """Line segments of one kind in one view."""

    camera: int
    person: int
    kind: str
    """`model`, `hidden`, `candidate`, `ghost`, `part_edge`, `epipolar`, `accepted` or `rejected`."""
    color: str
    segments_px: FloatArray
    """x0, y0, x1, y1, (N, 4), undistorted px."""


class Handle(NamedTuple):
    """A joint in one view."""

    camera: int
    person: int
    point: str
    u: float
    v: float
    visible: bool
    """Whether nothing hides it."""


def bones(model: BodyModel) -> list[tuple[str, str]]:
    """Pairs of points that a stick figure joins: each point and the joint of the part that carries it."""
    pairs = []
    for i, name in enumerate(model.point_names):
        part = int(model.point_parts[i])
        joint = model.joints[part]
        if i != part:
            pairs.append((joint.name, name))  # a landmark hangs on its part's joint
        elif joint.parent:
            pairs.append((model.joints[model.part_index[joint.parent]].name, name))
    return pairs


def paths(session: Session, state: State, view: View, views: Sequence[ViewEvidence] | None) -> list[Path]:
    """Everything that the layers of a page call for, in the views that it shows.

    Args:
        session: with its cameras and people.
        state: what to draw.
        view: what the page shows.
        views: the evidence of the shown frame; without it there are no segments of edges to draw.
    """
    state = state.drawn
    bodies = [PosedBody(p.model, v) for p, v in zip(session.people, state.poses, strict=True)]
    out = []
    tried = state.job.candidate if state.job.running or state.look.replay is not None else None
    drafted, others = _with_draft(state, bodies), _others(state, bodies)
    ghosts = ((state.look.compared, COMPARED_COLOR), (state.look.preview, PREVIEW_COLOR))
    for index in sorted(view.cameras):
        camera = session.cameras[index].camera.pinhole
        if not view.layers.isdisjoint(("contours", "hidden")):
            out += _model(session, bodies, camera, index, view)
        if state.draft is not None:
            out += _ghosts({state.draft.person}, drafted, camera, index, PREVIEW_COLOR)
        if others:
            changed = {i for i, (now, other) in enumerate(zip(bodies, others, strict=True)) if now is not other}
            out += _ghosts(changed, others, camera, index, OTHER_COLOR)
        if "contours" in view.layers and tried is not None:
            out += _outlined(session, tried, camera, index, "candidate", CANDIDATE_COLOR)
        for ghost, color in ghosts:
            if ghost is not None:
                out += _outlined(session, ghost, camera, index, "ghost", color)
        if "part_edges" in view.layers:
            out.append(Path(index, 0, "part_edge", PART_EDGE_COLOR, part_edges.part_edges(bodies, camera)))
        if views is not None:
            out += [s for s in _segments(bodies, views[index], index, view) if s.kind in view.layers]
    if state.drag is not None and "epipolar" in view.layers:
        out += [line for line in _epipolar_lines(session, state) if line.camera in view.cameras]
    return [p for p in out if p.kind not in _OF_A_PERSON or p.person not in state.cast.hidden]


def handles(session: Session, state: State, cameras: Collection[int]) -> list[Handle]:
    """The joints of everybody shown, in some views, given by index; those behind a camera are left out."""
    bodies = [PosedBody(p.model, v) for p, v in zip(session.people, state.poses, strict=True)]
    points = [b.points_world for b in bodies]
    seen = {index: session.cameras[index].camera.pinhole for index in sorted(cameras)}
    out, hidden_by_view = [], part_edges.points_occluded(bodies, list(seen.values()), np.concatenate(points))
    for (index, camera), hidden in zip(seen.items(), hidden_by_view, strict=True):
        first = 0
        for person, body in enumerate(bodies):
            px = camera.project(points[person])
            for i, name in enumerate(body.model.point_names):
                if person not in state.cast.hidden and np.all(np.isfinite(px[i])):
                    u, v = float(px[i, 0]), float(px[i, 1])
                    out.append(Handle(index, person, name, u, v, not hidden[first + i]))
            first += len(px)
    return out


def part_colors(people: Sequence[Person]) -> list[str]:
    """Colours of the parts, counted through some people."""
    return [part.color for person in people for part in person.model.parts]


def _traced(bodies: Sequence[PosedBody], camera: Camera) -> Contour:
    return occluding_contours.trace(bodies, camera, occluding_contours.PIECE_PX * max(1.0, max(camera.size) / 640))


def _model(session: Session, bodies: Sequence[PosedBody], camera: Camera, index: int, view: View) -> list[Path]:
    """The contours of the poses shown: what one sees of them, and what parts hide."""
    contour = _traced(bodies, camera)
    out = []
    for layer, kind, those in (("hidden", "hidden", contour.occluded), ("contours", "model", ~contour.occluded)):
        if layer in view.layers and view.by_part:
            out += _by_part(session, bodies, contour, those, index, kind)
        elif layer in view.layers:
            out += _by_person(bodies, contour, those, index, kind, [p.color for p in session.people])
    return out


def _outlined(
    session: Session, poses: Sequence[Array], camera: Camera, index: int, kind: str, color: str
) -> list[Path]:
    """What one would see of other poses of everybody, all in one colour."""
    bodies = [PosedBody(p.model, v) for p, v in zip(session.people, poses, strict=True)]
    contour = _traced(bodies, camera)
    return _by_person(bodies, contour, ~contour.occluded, index, kind, [color] * len(bodies))


def _with_draft(state: State, bodies: Sequence[PosedBody]) -> list[PosedBody]:
    """Everybody in the poses shown, the person whose sizes are being edited in the draft's body."""
    people, draft = list(bodies), state.draft
    if draft is not None:
        shown = people[draft.person]
        people[draft.person] = PosedBody(draft.model, retarget_pose(shown.values, shown.model, draft.model))
    return people


def _others(state: State, bodies: Sequence[PosedBody]) -> list[PosedBody]:
    """Everybody in the poses shown, but for those of whom another is about as good: in the best of these."""
    if not any(shown.others for shown in state.people):
        return []
    return [PosedBody(b.model, s.others[0]) if s.others else b for b, s in zip(bodies, state.people, strict=True)]


def _ghosts(chosen: Collection[int], people: Sequence[PosedBody], camera: Camera, index: int, color: str) -> list[Path]:
    """What one would see of some of the people, given by index, if everybody stood so."""
    contour = _traced(people, camera)
    found = _by_person(people, contour, ~contour.occluded, index, "ghost", [color] * len(people))
    return [path for path in found if path.person in chosen]


def _by_person(
    bodies: Sequence[PosedBody], contour: Contour, those: Mask, index: int, kind: str, colors: Sequence[str]
) -> list[Path]:
    """Those pieces of a contour, one path for each person."""
    people = occluding_contours.surfaces_of(tuple(b.model for b in bodies)).people[contour.parts]
    return [
        Path(index, person, kind, colors[person], contour.pieces_px[those & (people == person)])
        for person in range(len(bodies))
    ]


def _by_part(
    session: Session, bodies: Sequence[PosedBody], contour: Contour, those: Mask, index: int, kind: str
) -> list[Path]:
    """Those pieces of a contour, one path for each part that has any."""
    people, colors = occluding_contours.surfaces_of(tuple(b.model for b in bodies)).people, part_colors(session.people)
    return [
        Path(index, int(people[part]), kind, colors[part], contour.pieces_px[those & (contour.parts == part)])
        for part in np.unique(contour.parts[those])
    ]


def _segments(bodies: Sequence[PosedBody], view: ViewEvidence, index: int, shown: View) -> list[Path]:
    """The segments of edges that the poses shown explain, and those that they do not (GD96 Fig. 6)."""
    if shown.layers.isdisjoint(("accepted", "rejected")):
        return []
    segments, samples = view.segments, view.samples
    if segments is None or samples is None or not len(segments.points_px):
        return []
    contour = occluding_contours.trace(bodies, view.camera)
    chosen = accept_segments(samples, contour.pieces_px[~contour.occluded], ACCEPTED_SHARE * view.theta_px)
    lengths = np.diff(segments.firsts)
    owners = np.repeat(np.arange(len(lengths)), lengths)
    places = np.arange(len(owners)) - segments.firsts[owners]
    drawn = np.flatnonzero((places % _EDGE_STRIDE == 0) | (places == lengths[owners] - 1))
    goes_on = owners[drawn[1:]] == owners[drawn[:-1]]
    # As resized pictures keep the borders of their pixels, not the centres.
    points_px = (segments.points_px[drawn] + np.array(view.corner_px, np.float32) + 0.5) / view.scale - 0.5
    lines = np.hstack([points_px[:-1], points_px[1:]])[goes_on].astype(np.float32)
    of_accepted = chosen[owners[drawn[:-1][goes_on]]]
    return [
        Path(index, 0, "rejected", REJECTED_COLOR, lines[~of_accepted]),
        Path(index, 0, "accepted", ACCEPTED_COLOR, lines[of_accepted]),
    ]


def _epipolar_lines(session: Session, state: State) -> list[Path]:
    """The line of sight of the dragged point, as the other views see it."""
    drag = state.drag
    assert drag is not None
    model = session.people[drag.person].model
    source = session.cameras[drag.camera].camera.pinhole
    T_world_part = model.kinematics(state.poses[drag.person]).Ts_world_part[drag.part]
    place: Array = rigid.apply(T_world_part, np.array(drag.place_part))
    out = []
    for index, target in enumerate(session.cameras):
        if index != drag.camera:
            segment = epipolar_segment(source, target.camera.pinhole, source.project(place))
            if segment is not None:
                row = segment.reshape(1, 4).astype(np.float32)
                out.append(Path(index, drag.person, "epipolar", EPIPOLAR_COLOR, row))
    return out
