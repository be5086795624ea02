"""How likely each limb is elsewhere: the mass of all paths on which it is, averaged over views that are left out.

A view that holds a limb at a wrong edge no longer does where it is left out (deletion of groups of data: J. Tukey 1958,
Ann. Math. Stat. 29:614). The hypotheses are those of all views, scored again without one.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tracker.body.limbs import Search, display_name, limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.appearance.region_model import worst_views
from tracker.estimation.by_frame.assessment import part_costs_px
from tracker.estimation.fitting.hypothesis import SAME_POSE_M, Hypothesis, distance_m, distinct, limbs_elsewhere
from tracker.estimation.runs.frame_hypotheses import FrameHypotheses
from tracker.estimation.runs.path_search import PathSearch
from tracker.estimation.tracking.confidence import OFF_ODDS, probabilities
from tracker.estimation.trajectory.hypotheses import HypothesisSet, Paths, path_marginals, reduce_log_sum
from tracker.estimation.trajectory.solve import SolvedPath
from tracker.geometry.arrays import Array, Mask

DOUBTFUL_MASS = float(probabilities(np.array(OFF_ODDS)))
"""Mass of the paths on which a limb is elsewhere, from which it is doubtful."""


class RunPose(NamedTuple):
    """The pose of a person on a frame, by all frames of a run."""

    pose: Array
    """(n_values,)."""
    entry: Search | None
    """How it was found in place of the first guess; None where that stays."""
    part_costs_px: Array
    """Mean distance of the contour of each part to the edges, (n_parts,), px of the footage; NaN where hidden."""
    errors_m2: Array
    """Covariances of the points of the body, (n_points, 3, 3), square metres."""
    elsewhere: Array
    """Mass of the paths on which each limb is elsewhere, (n_limbs,)."""
    by_colors: Array
    """How much likelier each limb is elsewhere by the colours of the run, (n_limbs,), nats; see `elsewhere_nats`."""
    against: tuple[str, ...]
    """For each limb, the part and the view that speak most against it, for people to read."""
    is_shown: Mask
    """Whether two views or more show each limb, (n_limbs,): one shows no depth. All of them where one camera films."""
    is_searched: bool
    """Whether limbs were searched on the frame."""
    others: tuple[Hypothesis, ...]
    """Poses with a limb elsewhere on paths of more than `DOUBTFUL_MASS`, cheapest first. Their costs are those of the
    frame relative to that of the pose, nats."""
    cost_px: float = np.nan
    """Cost of the poses of all people on the frame, px of the footage."""
    view_costs_px: tuple[float, ...] = ()
    """The same in each view, (V,)."""
    is_facing_sure: bool = True
    """Whether it is clear which way the person faces in the run."""


def assessed_path(
    search: PathSearch, solved: SolvedPath, first: Sequence[Array], poses: Array, cameras: Sequence[str]
) -> list[RunPose]:
    """Return poses with what is known of each by the path of a person.

    Keyframes are compared as if other poses were free to take their place.

    Args:
        search: of the path.
        solved: its solution.
        first: first guesses, (n_values,) each.
        poses: the poses that are assessed, (T, n_values): those of the path, or others.
        cameras: names of the views.
    """
    model, paths = search.model, search.paths
    masses, others = compared(model, paths, search.sets, poses)
    is_key = np.array([f.anchor is not None for f in search.frames])
    if is_key.any():
        masses_if_free, others_if_free = compared(model, paths, [f.found for f in search.frames], poses)
        masses[is_key] = masses_if_free[is_key]
        others = [free if key else own for free, own, key in zip(others_if_free, others, is_key, strict=True)]
    by_colors, parts, nats = search.elsewhere(poses)
    views = np.take_along_axis(worst_views(nats, [model]), parts, axis=1)
    names = [display_name(p.name) for p in model.parts]
    out = []
    for t, (frame, pose) in enumerate(zip(search.frames, poses, strict=True)):
        kinematics = model.kinematics(pose)
        J = model.point_jacobian(kinematics, model.point_parts, model.points_world(pose))
        off = model.points_world(solved.poses[t]) - model.points_world(pose)
        errors = np.einsum("pia,ab,pjb->pij", J, solved.covariances[t], J) + off[:, :, None] * off[:, None]
        against = tuple(f"{names[p]} elsewhere in {cameras[v]}" for p, v in zip(parts[t], views[t], strict=True))
        costs, entry = frame.part_costs(pose), _entry(frame, first[t], pose)
        is_shown = frame.views_of_limbs(pose, costs).sum(axis=0) >= min(2, len(cameras))
        own = frame.nats(pose) if others[t] else 0.0
        ranked = tuple(replace(h, cost=h.cost - own) for h in others[t])
        known = by_colors[t], against, is_shown, t in search.searched, ranked
        out.append(RunPose(pose, entry, part_costs_px(frame.evidence.views, costs), errors, masses[t], *known))
    return out


def _entry(frame: FrameHypotheses, first: Array, pose: Array) -> Search | None:
    """Return the entry of a pose that took the place of a first guess, (n_values,) each, if a limb is elsewhere."""
    moved = limbs_elsewhere(PosedBody(frame.model, first), PosedBody(frame.model, pose))
    return Search.of("path", moved, frame.nats(first), frame.nats(pose), True) if moved else None


def compared(
    model: BodyModel, paths: Paths, sets: Sequence[HypothesisSet], poses: Array
) -> tuple[Array, list[tuple[Hypothesis, ...]]]:
    """Return the mass of the paths on which a point of each limb is more than `SAME_POSE_M` elsewhere than in poses,
    (T, n_values): (T, n_limbs). Return also the hypotheses by which a limb is doubtful, by frame, cheapest first."""
    motion = paths.motion_nats(sets)
    masses, elsewhere, others = _path_masses(motion, sets), list[Array](), list[tuple[Hypothesis, ...]]()
    for own, mass, pose in zip(sets, masses, poses, strict=True):
        elsewhere.append(mass @ _apart(model, own.poses, pose))
        here, costs, likely = PosedBody(model, pose), own.costs(), np.flatnonzero(mass > DOUBTFUL_MASS)
        found = [Hypothesis(PosedBody(model, own.poses[i]), own.sources[i], float(costs[i])) for i in likely]
        others.append(tuple(h for h in distinct(found) if distance_m(h.body, here) > SAME_POSE_M))
    return np.array(elsewhere), others


def _path_masses(motion: Sequence[Array], sets: Sequence[HypothesisSet]) -> list[Array]:
    """Return the mass of the paths through each hypothesis, (K,) for each frame, averaged over views that are left out.

    Args:
        motion: cost of each triple of hypotheses of successive frames; see `Paths.motion_nats`.
        sets: hypotheses of each frame.
    """
    from scipy.special import softmax  # imported lazily: loading takes 0.1 s

    n_views = sets[0].view_nats.shape[1]
    views = range(n_views) if n_views > 2 else (None,)  # one view shows no depth
    masked = [path_marginals([s.costs(view) for s in sets], motion, reduce_log_sum) for view in views]
    return [np.mean([softmax(-nats) for nats in of_frame], axis=0) for of_frame in zip(*masked, strict=True)]


def _apart(model: BodyModel, poses: Array, pose: Array) -> Mask:
    """Return whether a point of each limb lies elsewhere in each of some poses, (K, n_limbs), than in one."""
    gaps = np.linalg.norm([model.points_world(p) for p in poses] - model.points_world(pose), axis=-1)
    of_limbs = [gaps[:, np.isin(model.point_parts, limb.parts)].max(axis=1) for limb in limbs(model)]
    return np.stack(of_limbs, axis=1) > SAME_POSE_M
