"""Acquire a person's body from two near-orthogonal views of one frame, as GD96 Sect. 3 does: `acquire --paper`.

The person faces one view, or turns the back to it, and is seen from the side in the other. The paper leaves open how
parts are segmented, and in which steps they are searched. It assumes orthogonal views. The choices made here are in
docs/log/acquisition.md.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import permutations
from typing import NamedTuple

import numpy as np

from tracker.body.model import PosedBody
from tracker.compute.progress import Report, stages, unreported
from tracker.errors import Remedy, TrackerError
from tracker.estimation.acquisition.from_contours import Acquisition, learn_static_edges, moving, own_views
from tracker.estimation.acquisition.shape_search import ChamferSearchSettings, search_shapes
from tracker.estimation.acquisition.size_fit import SightedPerson, SizeFit
from tracker.estimation.acquisition.size_parameters import SizeParameters, SizePriors
from tracker.estimation.search.chamfer_cost import ChamferCost
from tracker.estimation.tracking.view_regions import read_views
from tracker.evidence.observer import Observer
from tracker.geometry.cameras import Camera

MAX_OFF_RAD = np.radians(35.0)
"""Largest angle between a view and the person's front or side, and of two views from a right angle."""


@dataclass(frozen=True)
class TwoViewSettings:
    """Settings of an acquisition from two views."""

    views: tuple[str, str] | None = None
    """Names of the frontal view and the side view; None chooses them by the person's heading."""
    n_frames: int = 6
    """Number of poses from which the frame is chosen; missing ones are tracked."""
    coupled: bool = True
    """Whether left and right have the same sizes."""
    priors: SizePriors = field(default_factory=SizePriors)
    """Standard deviations that give the searched ranges."""
    search: ChamferSearchSettings = field(default_factory=ChamferSearchSettings)


class FrontAndSide(NamedTuple):
    """A frame on which a person is seen from the front and from the side."""

    frame: int
    front: int
    """Index of the view from the front or the back."""
    side: int
    """Index of the view from the side."""
    off_rad: float
    """Largest angle by which the views depart from front, side and a right angle, rad."""


def acquire_from_two_views(
    observer: Observer,
    bodies: Mapping[int, tuple[PosedBody, ...]],
    person: int,
    settings: TwoViewSettings,
    report: Report = unreported,
) -> Acquisition:
    """Acquire the shapes of one person's parts. Pose, height and lengths stay.

    Args:
        observer: of the recording.
        bodies: all people on each frame that may be used, in their present bodies.
        person: index of the person among them.
        settings: of the acquisition.
        report: shows progress.

    Returns:
        The acquired body. Its covariance is NaN, because a search has none.

    Raises:
        TrackerError: no frame shows the person from the front and from the side, or the views show nothing of them.
    """
    if not bodies:
        raise TrackerError("expected at least one frame with a pose, found none; place the body on one first")
    choosing, reading, searching = stages(report, "choosing views", "reading contours", "searching shapes")
    choosing(0.0)
    chosen = choose_views(observer.working_cameras, bodies, person, settings.views)
    frame, front, side, _ = chosen
    bodies = moving(observer, bodies)
    reading(0.0)
    static_edges = learn_static_edges(observer, bodies)
    views = read_views(observer, frame, bodies[frame], static_edges)
    own = own_views(views, bodies[frame], person)
    sighted = SightedPerson(frame, [own[front], own[side]], bodies[frame], person)
    parameters = SizeParameters(bodies[frame][person].model, settings.coupled, settings.priors)
    found = search_shapes(parameters, sighted, settings.search, searching)
    names = tuple(observer.working_cameras[i].name for i in (front, side))
    if not np.isfinite(found.chamfer_before_m):
        raise TrackerError(
            f"expected contours of the person on frame {frame} in {' and '.join(names)}, found no edges near the body; "
            "place it where the person is"
        )
    body = parameters.body(found.sizes)
    posed = bodies[frame], sighted.moved(body, sighted.pose).bodies
    before, after = (ChamferCost(views, b).at_prediction().total_px for b in posed)
    report("done", 1.0)
    n = len(found.sizes)
    fit = SizeFit(found.sizes, body, (sighted.pose,), found.chamfer_after_m, np.full((n, n), np.nan))
    return Acquisition(
        body, (frame,), fit.poses, before, after, parameters, fit, names, joints_are_given=True
    )  # fmt: skip


def choose_views(
    cameras: Sequence[Camera],
    bodies: Mapping[int, tuple[PosedBody, ...]],
    person: int,
    names: tuple[str, str] | None = None,
) -> FrontAndSide:
    """Choose the frame and the two views that show a person best from the front and from the side.

    Args:
        cameras: all views.
        bodies: all people on each frame to choose from.
        person: index of the person among them.
        names: of the frontal view and the side view, if they are given.

    Raises:
        TrackerError: no frame has such views within `MAX_OFF_RAD`.
    """
    index = {c.name: i for i, c in enumerate(cameras)}
    pairs = [(index[names[0]], index[names[1]])] if names else list(permutations(range(len(cameras)), 2))
    found = []
    for k, people in bodies.items():
        turns = [_direction_rad(people[person], c) for c in cameras]
        found += [FrontAndSide(k, front, side, _off_rad(turns[front], turns[side])) for front, side in pairs]
    best = min((f.off_rad for f in found), default=np.inf)
    if best > MAX_OFF_RAD:
        where = f"{names[0]} and {names[1]}" if names else "two views"
        but = "too few views" if not found else f"{np.degrees(best):.0f} degrees at best"
        raise TrackerError(
            f"expected a frame on which {where} show the person from the front and from the side within "
            f"{np.degrees(MAX_OFF_RAD):.0f} degrees, found {but}",
            Remedy("without_paper"),
        )
    return min(found, key=lambda f: f.off_rad)


def _direction_rad(body: PosedBody, camera: Camera) -> float:
    """Return the direction of a view from the trunk, in the plane across it: 0 is the front, pi/2 the left, rad."""
    T = body.kinematics.Ts_world_part[0]
    x, y, _ = (camera.center_world - T[:3, 3]) @ T[:3, :3]
    return float(np.arctan2(y, x))


def _off_rad(front_rad: float, side_rad: float) -> float:
    """Return how far two directions depart from front or back, from a side, and from a right angle, rad."""
    front = np.arcsin(np.abs(np.sin(front_rad)))
    side = np.arcsin(np.abs(np.cos(side_rad)))
    between = np.arcsin(np.abs(np.cos(front_rad - side_rad)))
    return float(max(front, side, between))
