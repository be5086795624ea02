"""The fit of one frame by the contour method, iteration by iteration, and the residuals of a pose as vectors."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import PosedBody
from tracker.body.parts import SearchGroup
from tracker.contours import occluding_contours
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array, FloatArray
from tracker.search.best_first import SearchStep, Stage
from tracker.tracking.contour.settings import ContourSettings
from tracker.tracking.estimation.frame_problem import FrameProblem, PersonPrior, with_body
from tracker.tracking.estimation.settings import chamfer_cost
from tracker.tracking.subjects import Subjects

_STRIDE = 3
"""Every so many pieces of contour has a vector: more could not be told apart."""
_NEAR_PX = 0.5
"""A contour that is nearer to an edge has no vector, working px."""


def fit_stages(subjects: Subjects) -> list[Stage]:
    """Return the stages of a fit: one for each person of whom anything may move."""
    free = [
        (person, np.ones(subjects.models[person].n_dofs, bool) if active is None else active)
        for person in subjects.tracked
        for active in (subjects.active_dofs[person],)
    ]
    return [Stage(p, SearchGroup("fit", _names(subjects, p, active)), 1.0) for p, active in free if active.any()]


def _names(subjects: Subjects, person: int, active: NDArray[np.bool_]) -> tuple[str, ...]:
    return tuple(n for n, is_active in zip(subjects.models[person].dof_names, active, strict=True) if is_active)


def fit_frame(
    views: Sequence[ViewEvidence],
    subjects: Subjects,
    start: Sequence[Array],
    settings: ContourSettings,
    planned: Sequence[Stage],
) -> Iterator[SearchStep]:
    """Fit the people of a frame one after the other, one step for each Gauss-Newton iteration.

    The descent begins again for each number of iterations, because it runs in one compiled call. Costs are those of the
    chamfer distance, as everywhere in the page, and not those that are minimized.

    Args:
        views: the evidence of the frame.
        subjects: bodies, whom to fit, and what may move; keyframes are not used.
        start: the pose of each person to begin from, (n_values,).
        settings: of the tracker.
        planned: see `fit_stages`.
    """
    bodies = tuple(PosedBody(m, p) for m, p in zip(subjects.models, start, strict=True))
    people = [PersonPrior(b.model, b.values, a) for b, a in zip(bodies, subjects.active_dofs, strict=True)]
    problem, cost, done = FrameProblem(views, people, settings), chamfer_cost(views, bodies, settings), 0
    for stage in planned:
        person, origin = stage.person, bodies
        blocks = [problem.residuals(person, origin), *problem.priors(person, origin)]
        for n in range(1, settings.max_iterations + 1):
            fit = problem.solve(person, origin[person].values, blocks, n)
            following = problem.solve(person, origin[person].values, blocks, n + 1)
            is_last = n == settings.max_iterations or bool(np.array_equal(following.pose, fit.pose))
            bodies, done = with_body(origin, person, PosedBody(origin[person].model, fit.pose)), done + 1
            poses = tuple(b.values for b in bodies)
            found = cost(poses)
            yield SearchStep(
                stage, poses, found.total_px, poses, found.total_px, found.view_costs_px, done, is_last
            )  # fmt: skip
            if is_last:
                break


def residual_vectors(view: ViewEvidence, bodies: Sequence[PosedBody]) -> FloatArray:
    """Return vectors from visible contours of the model to the image contours, x0, y0, x1, y1, (N, 4), footage px.

    A vector follows the slope of the distance image for the distance there. Contours beyond the limit of the distance
    image have none.

    Args:
        view: the evidence.
        bodies: all people.
    """
    seen = occluding_contours.trace(bodies, view.camera)
    pieces = seen.pieces_px[~seen.occluded][::_STRIDE].astype(np.float64)
    middles = (pieces[:, :2] + pieces[:, 2:]) / 2
    height, width = view.distance.shape
    if height < 3 or width < 3:
        return np.empty((0, 4), np.float32)
    u, v = np.rint(middles).astype(int).T
    inside = (u >= 1) & (v >= 1) & (u < width - 1) & (v < height - 1)
    middles, u, v = middles[inside], u[inside], v[inside]
    image = view.distance
    distances = image[v, u]
    slopes = np.stack([image[v, u + 1] - image[v, u - 1], image[v + 1, u] - image[v - 1, u]], axis=1)
    lengths = np.linalg.norm(slopes, axis=1)
    drawn = (distances > _NEAR_PX) & (distances < 0.99 * image.max()) & (lengths > 0.2)
    ends = middles[drawn] - (distances[drawn] / lengths[drawn])[:, None] * slopes[drawn]
    corner = np.array(view.corner_px)
    # Resizing keeps the borders of pixels, not their centres.
    both = [(points + corner + 0.5) / view.scale - 0.5 for points in (middles[drawn], ends)]
    return np.hstack(both).astype(np.float32)
