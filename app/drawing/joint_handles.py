"""Places on the bodies in each view: joints to grab, with their occlusion, a dragged point out of reach, and heads."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from app.drawing.seen_bodies import at_one_time, bodies_in, picture_times
from app.state.people import DragState
from app.state.state import State
from tracker.body.model import PosedBody, ahead
from tracker.evidence.contours import part_edges
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, Image, IntArray, Mask
from tracker.geometry.cameras import Camera
from tracker.interchange.exports.faces import Circle, around, blurred, head_surface
from tracker.session.session import Session

_SHORT_M = 0.01
"""Smallest distance from the pointer's line of sight that counts as out of reach, metres."""

Side = Literal["left", "right", ""]
SIDES: tuple[Side, ...] = get_args(Side)


@dataclass(frozen=True)
class OutOfReach:
    """A dragged point that stays behind the pointer."""

    camera: int
    person: int
    point: str
    u: float
    """Position of the pointer, undistorted px."""
    v: float
    point_u: float
    """Position of the point, undistorted px."""
    point_v: float
    distance_m: float
    """Distance of the point from the line of sight."""


@dataclass(frozen=True)
class Handle:
    """A joint in one view; a joint behind the camera has none."""

    camera: int
    person: int
    point: str
    u: float
    v: float
    visible: bool
    """False for an occluded joint."""
    hidden_by: int | None
    """Index of another person who occludes it, where the own body does not; null otherwise."""
    held: bool
    """Whether it stays in place while others are dragged."""
    side: Side
    """Side of the body."""


@dataclass(frozen=True)
class HeadCircle:
    """A circle that hides a head in one view, undistorted px."""

    camera: int
    u: float
    v: float
    radius_px: float


def handles(session: Session, state: State, cameras: Collection[int]) -> list[Handle]:
    """Project the joints of all visible people into some views, given by index; joints behind a camera are left out.

    There are none while corrected cameras are previewed: the people are drawn elsewhere, and cannot be dragged.
    """
    if state.calibration.shown_on(state.frame) is not None:
        return []
    found: dict[int, list[Handle]] = {}
    for time, group in at_one_time(picture_times(session, state.frame, cameras)):
        found |= _handles(session, state, ahead(bodies_in(session, state), time), group)
    return [handle for index in sorted(found) for handle in found[index]]


def _handles(
    session: Session, state: State, bodies: Sequence[PosedBody], cameras: Sequence[int]
) -> dict[int, list[Handle]]:
    """Return the handles of all visible people in views of one time, by index of the view."""
    points, views = [b.points_world for b in bodies], [session.cameras[index].camera.pinhole for index in cameras]
    people_not_drawn = state.people_not_drawn
    if "contours" in state.compiled:
        occluded = part_edges.points_occluded_by_body(bodies, views, np.concatenate(points))
    else:  # the kernels are being compiled: every joint can be grabbed
        occluded = np.zeros((len(views), len(bodies), sum(map(len, points))), bool)
    people = np.repeat(np.arange(len(bodies)), list(map(len, points)))
    out: dict[int, list[Handle]] = {index: [] for index in cameras}
    for index, camera, by_body in zip(cameras, views, occluded, strict=True):
        first = 0
        hidden, occluders = np.asarray(by_body.any(axis=0)), _other_occluders(by_body, people)
        for person, body in enumerate(bodies):
            px, held = camera.project(points[person]), state.held_points(person)
            is_in_front = np.all(np.isfinite(px), axis=1)
            for i, (name, (u, v)) in enumerate(zip(body.model.point_names, px.tolist(), strict=True)):
                if person not in people_not_drawn and is_in_front[i]:
                    is_visible, by, is_held = not hidden[first + i], occluders[first + i], name in held
                    out[index].append(Handle(index, person, name, u, v, is_visible, by, is_held, side_of(name)))
            first += len(px)
    return out


def _other_occluders(by_body: Mask, people: IntArray) -> list[int | None]:
    """Return for each point of all bodies the index of another body that occludes it, if its own does not.

    Args:
        by_body: whether each body occludes each point in a view, (n_bodies, n).
        people: index of the body of each point, (n,).
    """
    is_by_other = by_body.any(axis=0) & ~by_body[people, np.arange(len(people))]
    return [int(i) if is_other else None for i, is_other in zip(by_body.argmax(axis=0), is_by_other, strict=True)]


def out_of_reach(session: Session, state: State) -> OutOfReach | None:
    """Describe a dragged point that does not reach the pointer; None if it does."""
    drag = state.drag
    if drag is None or drag.wanted_px is None or drag.short_m < _SHORT_M:
        return None
    camera = session.cameras[drag.camera].camera.pinhole
    u, v = (float(c) for c in camera.project(dragged_place(session, state, drag)))
    if not np.isfinite([u, v]).all():
        return None
    return OutOfReach(drag.camera, drag.person, drag.point, *drag.wanted_px, u, v, drag.short_m)


def side_of(name: str) -> Side:
    """Return the side of the body that a part or a point belongs to, by its name."""
    side = name.partition("_")[0]
    return "left" if side == "left" else "right" if side == "right" else ""


def dragged_place(session: Session, state: State, drag: DragState) -> Array:
    """Return the dragged place, (3,), metres."""
    T_world_part = session.people[drag.person].model.kinematics(state.poses[drag.person]).Ts_world_part[drag.part]
    return rigid.apply(T_world_part, np.array(drag.place_part))


def without_faces(image: Image, heads: Sequence[HeadCircle], camera: int) -> Image:
    """Return an undistorted image of a camera, (H, W, 3) RGB, with the heads in it blurred."""
    return blurred(image, [Circle(np.array([h.u, h.v]), h.radius_px) for h in heads if h.camera == camera])


def head_circles(session: Session, state: State, cameras: Collection[int]) -> list[HeadCircle]:
    """Return the circles of all people in some views, given by index, whether they are drawn or not."""
    found = []
    for time, group in at_one_time(picture_times(session, state.frame, cameras)):
        surfaces = head_surfaces(ahead(bodies_in(session, state), time))
        for index in group:
            circles = circles_around(surfaces, session.cameras[index].camera.pinhole)
            found += [HeadCircle(index, float(u), float(v), radius_px) for (u, v), radius_px in circles]
    return found


def head_surfaces(bodies: Sequence[PosedBody]) -> list[Array]:
    """Return points on the heads of the bodies that have one, (n, 3) each, world, metres."""
    return [head_surface(body) for body in bodies if "head" in body.model.part_index]


def circles_around(surfaces: Sequence[Array], camera: Camera) -> list[Circle]:
    """Return what hides surfaces in an undistorted image."""
    return [around(px[seen]) for px in map(camera.project, surfaces) if (seen := np.isfinite(px).all(axis=1)).any()]
