"""Best-first search over a decomposed pose space (GD96 Sect. 4.1, Eq. 4-7 and Fig. 2).

The space of a stage is a lattice around the prediction in a few degrees of freedom, with the others fixed. The cheapest
unexpanded node is expanded: its neighbours along each axis are scored. The search is a generator with one step per
expansion, so that a user can watch it and a program can drain it. It can be stopped after any step.
"""

import heapq
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.body.parts import SearchGroup
from tracker.errors import TrackerError
from tracker.estimation.search.chamfer_cost import ChamferCost
from tracker.geometry.arrays import TINY, Array


@dataclass(frozen=True)
class SearchSettings:
    """Bounds and steps of the lattice. The defaults are those of GD96 Sect. 5, with finer passes added."""

    step_rad: float = float(np.radians(5))
    """Spacing of the lattice along an angle, rad."""
    step_m: float = 0.05
    """Spacing of the lattice along a position, metres."""
    bound_rad: float = float(np.radians(15))
    """Largest change of an angle from the prediction, rad."""
    bound_m: float = 2 * step_m
    """Largest change of a position from the prediction, metres."""
    bounds: dict[str, float] = field(default_factory=dict)
    """Bounds of single degrees of freedom by name where they differ, rad or metres."""
    steps: dict[str, float] = field(default_factory=dict)
    """Steps of single degrees of freedom by name where they differ, rad or metres."""
    passes: tuple[float, ...] = (1.0, 0.5, 0.25)
    """Factors on the steps. All stages are searched once per factor, each time around the best pose so far. The paper's
    single pass is `(1.0,)`."""
    patience: int = 3
    """Number of consecutive expansions without improvement that end a stage (the paper gives no rule)."""
    max_expansions: int = 60
    """Largest number of expansions of a stage."""
    limbs_apart: bool = False
    """Whether the limbs of a group are searched one after the other. Two arms are nearly independent, and searching
    them together scores the neighbours of both for each move of one. The paper searches them together."""

    def __post_init__(self) -> None:
        """Check the settings.

        Raises:
            TrackerError: a bound below 0, a step or pass not above 0, or a stage without a single expansion.
        """
        for name, bound in {"angles": self.bound_rad, "positions": self.bound_m, **self.bounds}.items():
            if not (np.isfinite(bound) and bound >= 0):
                raise TrackerError(f"expected the bound of {name} to be 0 or more, found {bound:g}; enter a larger one")
        for name, step in {"angles": self.step_rad, "positions": self.step_m, **self.steps}.items():
            if not (np.isfinite(step) and step > 0):
                raise TrackerError(f"expected the step of {name} to be above 0, found {step:g}; enter a larger one")
        if not self.passes or not all(np.isfinite(p) and p > 0 for p in self.passes):
            raise TrackerError(
                f"expected passes as factors above 0, such as 1, 0.5, 0.25, found {list(self.passes)}; enter one"
            )
        if min(self.patience, self.max_expansions) < 1:
            raise TrackerError(
                "expected a stage to take 1 expansion or more, found patience "
                f"{self.patience} and at most {self.max_expansions}; enter larger ones"
            )

    def lattice(self, model: BodyModel, dofs: Sequence[int]) -> tuple[Array, Array]:
        """Return bounds and steps of some degrees of freedom, each (len(dofs),), rad or metres."""
        names = [model.dof_names[d] for d in dofs]
        lengths = model.dof_is_length[list(dofs)]
        bounds = [
            self.bounds.get(n, self.bound_m if is_m else self.bound_rad) for n, is_m in zip(names, lengths, strict=True)
        ]
        steps = [
            self.steps.get(n, self.step_m if is_m else self.step_rad) for n, is_m in zip(names, lengths, strict=True)
        ]
        return np.array(bounds), np.array(steps)


COARSE_SEARCH = SearchSettings(passes=(1.5,), patience=1, limbs_apart=True)
"""A coarse search before a refinement; it scores a small fraction of the poses of the default search."""


@dataclass(frozen=True, eq=False)
class Stage:
    """One leaf of the decomposition tree at one spacing."""

    person: int
    """Index of the person whose pose is searched."""
    group: SearchGroup
    """Degrees of freedom searched together."""
    factor: float
    """Factor on the steps of the lattice."""

    @property
    def name(self) -> str:
        """Name for display."""
        return self.group.name if self.factor == 1 else f"{self.group.name}, steps x {self.factor:g}"


@dataclass(frozen=True, eq=False)
class SearchStep:
    """Result of one expansion."""

    stage: Stage
    candidate: tuple[Array, ...]
    """Pose of each person, with the cheapest of the nodes just scored, (n_values,) each."""
    candidate_px: float
    """Cost of the candidate, px."""
    best: tuple[Array, ...]
    """Cheapest poses so far, (n_values,) each."""
    best_px: float
    """Their cost, px."""
    evaluations: int
    """Poses scored since the search began."""
    stage_done: bool
    """Whether this was the last step of its stage."""


class _Progress(NamedTuple):
    """State of the search between stages."""

    best: tuple[Array, ...]
    """Cheapest poses so far, (n_values,) each."""
    best_px: float
    """Their cost, px."""
    evaluations: int
    """Poses scored so far."""


def stages(
    models: Sequence[BodyModel],
    settings: SearchSettings,
    people: Sequence[int] | None = None,
    active_dofs: Sequence[NDArray[np.bool_]] | None = None,
) -> list[Stage]:
    """List the leaves of the decomposition in order of search: pass by pass, person by person (GD96 Fig. 2).

    Leaves without any active degree of freedom are left out.

    Args:
        models: body of each person.
        settings: passes and decomposition.
        people: indices of the people to search; all by default.
        active_dofs: degrees of freedom of each person that may change, (n_dofs,); all by default.
    """
    chosen = range(len(models)) if people is None else people
    return [
        Stage(person, left, factor)
        for factor in settings.passes
        for person in chosen
        for group in models[person].search_groups
        for leaf in (_limbs(models[person], group) if settings.limbs_apart else (group,))
        if (left := _active_group(leaf, models[person], None if active_dofs is None else active_dofs[person])).dofs
    ]


def _active_group(group: SearchGroup, model: BodyModel, active_dofs: NDArray[np.bool_] | None) -> SearchGroup:
    """Return a group restricted to active degrees of freedom."""
    if active_dofs is None:
        return group
    return replace(group, dofs=tuple(d for d in group.dofs if active_dofs[model.dof_names.index(d)]))


def _limbs(model: BodyModel, group: SearchGroup) -> list[SearchGroup]:
    """Divide a group into the joints above a branch of the body, and its limbs one by one."""
    children = Counter(model.parents)
    branches = [children[part] > 1 for part in range(len(model.parts))]
    for part in range(len(model.parts) - 1, 0, -1):
        branches[model.parents[part]] |= branches[part]
    leaves: dict[int, list[str]] = {}
    for name in group.dofs:
        part = int(model.dof_joint[model.dof_names.index(name)])
        while not branches[part] and model.parents[part] >= 0 and not branches[model.parents[part]]:
            part = model.parents[part]
        leaves.setdefault(-1 if branches[part] else part, []).append(name)
    if len(leaves) == 1:
        return [group]
    return [SearchGroup(f"{group.name}: {dofs[0].split('.')[0]}", tuple(dofs)) for dofs in leaves.values()]


def search(
    cost: ChamferCost,
    poses: Sequence[Array],
    settings: SearchSettings | None = None,
    people: Sequence[int] | None = None,
    active_dofs: Sequence[NDArray[np.bool_]] | None = None,
) -> Iterator[SearchStep]:
    """Search the poses of all people one stage after the other.

    While person i is searched, people before it have their found poses, and people after it their predicted ones.

    Args:
        cost: cost to minimize.
        poses: predicted pose of each person, (n_values,) each.
        settings: bounds, steps and stopping rule.
        people: indices of the people to search; all by default. The others are fixed, but still occlude and explain
            edges.
        active_dofs: degrees of freedom of each person that may change, (n_dofs,); all by default.

    Yields:
        One step per expansion; at least one per stage.
    """
    settings = settings or SearchSettings()
    predicted = [np.array(p, dtype=np.float64) for p in poses]
    progress = _Progress(tuple(predicted), cost(predicted).total_px, 1)
    for stage in stages(cost.models, settings, people, active_dofs):
        for step in _search_stage(cost, stage, settings, predicted[stage.person], progress):
            yield step
            progress = _Progress(step.best, step.best_px, step.evaluations)


def _search_stage(
    cost: ChamferCost, stage: Stage, settings: SearchSettings, predicted: Array, progress: _Progress
) -> Iterator[SearchStep]:
    """Search one stage best-first around the best pose so far, within the bounds around the prediction."""
    model, person = cost.models[stage.person], stage.person
    best, best_px, evaluations = progress
    dofs = [model.dof_names.index(d) for d in stage.group.dofs]
    bounds, steps = settings.lattice(model, dofs)
    steps = steps * stage.factor
    center = best[person]
    offset = model.difference(center, predicted)[dofs]
    # Lattice coordinates within the bounds around the prediction; the centre itself is always allowed.
    low = np.minimum(0, np.ceil((-bounds - offset) / steps - TINY)).astype(int)
    high = np.maximum(0, np.floor((bounds - offset) / steps + TINY)).astype(int)

    def poses_at(nodes: list[tuple[int, ...]]) -> Array:
        change = np.zeros((len(nodes), model.n_dofs))
        change[:, dofs] = np.array(nodes) * steps
        return model.move(center, change)

    origin = (0,) * len(dofs)
    queue: list[tuple[float, tuple[int, ...]]] = [(best_px, origin)]
    visited = {origin}
    idle = expansions = 0
    while True:
        _, node = heapq.heappop(queue)
        neighbours = []
        for axis in range(len(dofs)):
            for direction in (-1, 1):
                moved = (*node[:axis], node[axis] + direction, *node[axis + 1 :])
                if moved not in visited and low[axis] <= moved[axis] <= high[axis]:
                    visited.add(moved)
                    neighbours.append(moved)
        expansions, idle = expansions + 1, idle + 1
        candidate, candidate_px = best[person], best_px
        if neighbours:
            candidates = poses_at(neighbours)
            totals, _ = cost.of_person(person, candidates, best)
            evaluations += len(neighbours)
            for total, neighbour in zip(totals, neighbours, strict=True):
                heapq.heappush(queue, (float(total), neighbour))
            cheapest = int(np.argmin(totals))
            candidate, candidate_px = candidates[cheapest], float(totals[cheapest])
            if candidate_px < best_px:
                best = (*best[:person], candidate, *best[person + 1 :])
                best_px, idle = candidate_px, 0
        done = not queue or idle >= settings.patience or expansions >= settings.max_expansions
        shown = tuple(candidate if i == person else p for i, p in enumerate(best))
        yield SearchStep(stage, shown, candidate_px, best, best_px, evaluations, done)
        if done:
            return
