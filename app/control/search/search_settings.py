"""Edit and list the settings of the search by leaf of the decomposition, not by degree of freedom."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tracker.body.limbs import display_name
from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.search.best_first import SearchSettings, stages

_PLAIN = ("bound_rad", "bound_m", "step_rad", "step_m")


@dataclass(frozen=True)
class SearchLeaf:
    """A group of degrees of freedom that is searched together."""

    person: int
    """Index of the person."""
    name: str
    """Name of the group."""
    dofs: tuple[str, ...]
    """Names of its active degrees of freedom."""
    bound_rad: float | None
    """Largest change of its angles, rad; no value if it has none or they differ."""
    step_rad: float | None
    """Spacing along its angles, rad; no value likewise."""
    bound_m: float | None
    """Largest change of its positions, metres; no value likewise."""
    step_m: float | None
    """Spacing along its positions, metres; no value likewise."""
    angles: int
    """Number of its degrees of freedom that are angles."""
    lengths: int
    """Number that are positions."""
    own: bool
    """Whether a bound or step differs from the common one."""


def leaves(
    models: Sequence[BodyModel], settings: SearchSettings, free: Sequence[NDArray[np.bool_]] | None = None
) -> list[SearchLeaf]:
    """Return the leaves of the decomposition, in the order of search within one pass.

    Args:
        models: the body of each person.
        settings: of the search.
        free: of each person the degrees of freedom that may move, (n_dofs,); all by default.
    """
    found = []
    for stage in stages(models, replace(settings, passes=(1.0,)), active_dofs=free):
        model = models[stage.person]
        at = [model.dof_names.index(n) for n in stage.group.dofs]
        bounds, steps = settings.lattice(model, at)
        is_length = model.dof_is_length[at]
        found.append(
            SearchLeaf(
                stage.person, stage.group.name, stage.group.dofs,
                _common(bounds[~is_length]), _common(steps[~is_length]),
                _common(bounds[is_length]), _common(steps[is_length]),
                int((~is_length).sum()), int(is_length.sum()),
                any(n in settings.bounds or n in settings.steps for n in stage.group.dofs),
            )
        )  # fmt: skip
    return found


def changed(before: TrackSettings, models: Sequence[BodyModel], changes: Mapping[str, Any]) -> TrackSettings:
    """Return settings with the changes of a page; a value of a leaf applies to each of its degrees of freedom.

    Args:
        before: the present settings.
        models: the body of each person.
        changes: any of `theta_px` (null for the default), `patience`, `max_expansions`, `passes`, `limbs_apart`,
            `outliers`, `bound_rad`, `bound_m`, `step_rad`, `step_m` (of all), and `leaf`: `{person, name}` with any of
            the latter four for this leaf alone, null to follow the others again.

    Raises:
        TrackerError: a value is invalid, or a leaf is unknown.
        KeyError, TypeError, ValueError: the changes are not understood.
    """
    search, after = before.search, before
    if "theta_px" in changes:
        theta = None if changes["theta_px"] is None else float(changes["theta_px"])
        if theta is not None and not (np.isfinite(theta) and theta > 0):
            raise TrackerError(
                f"expected theta to be above 0 px, found {theta:g}; enter a larger one, or none for 3% of the image"
            )
        after = replace(after, theta_px=theta)
    if "outliers" in changes:
        if changes["outliers"] not in ("truncated", "paper"):
            raise ValueError(f"'{changes['outliers']}' is no treatment of outliers")
        after = replace(after, outliers=changes["outliers"])
    plain: dict[str, Any] = {name: float(changes[name]) for name in _PLAIN if name in changes}
    plain |= {name: int(changes[name]) for name in ("patience", "max_expansions") if name in changes}
    if "passes" in changes:
        plain["passes"] = tuple(float(p) for p in changes["passes"])
    if "limbs_apart" in changes:
        plain["limbs_apart"] = bool(changes["limbs_apart"])
    if "leaf" in changes:
        plain |= _of_leaf(search, models, changes["leaf"])
    return replace(after, search=replace(search, **plain))


def described(settings: TrackSettings) -> dict[str, str]:
    """Return the settings of a search as text by label."""
    s = settings.search
    found = {
        "theta": "default" if settings.theta_px is None else f"{settings.theta_px:g} px",
        "outliers": settings.outliers,
        "passes": " ".join(f"{p:g}" for p in s.passes),
        "patience": str(s.patience),
        "most": str(s.max_expansions),
        "limbs": "apart" if s.limbs_apart else "together",
        "bound": f"{np.degrees(s.bound_rad):.3g}° {100 * s.bound_m:.3g} cm",
        "step": f"{np.degrees(s.step_rad):.3g}° {100 * s.step_m:.3g} cm",
    }
    for what, single in (("bound", s.bounds), ("step", s.steps)):
        for name, value in single.items():
            is_length = name.endswith((".x", ".y", ".z"))
            found[f"{what} of {display_name(name)}"] = (
                f"{100 * value:.3g} cm" if is_length else f"{np.degrees(value):.3g}°"
            )
    return found


def differences(all_settings: Sequence[TrackSettings]) -> list[dict[str, str]]:
    """Return for each settings the values, by label, that are not equal in all of them."""
    texts = [described(s) for s in all_settings]
    labels = dict.fromkeys(label for one in texts for label in one)
    differing = [label for label in labels if len({one.get(label) for one in texts}) > 1]
    return [{label: one.get(label, "as all") for label in differing} for one in texts]


def _of_leaf(search: SearchSettings, models: Sequence[BodyModel], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return bounds and steps by degree of freedom after a change of one leaf."""
    person, name = int(changes["person"]), str(changes["name"])
    found = next((leaf for leaf in leaves(models, search) if (leaf.person, leaf.name) == (person, name)), None)
    if found is None:
        raise TrackerError(
            f"expected a group of the search, found '{name}'; it no longer exists, so choose one from the present list"
        )
    model, single = models[person], {"bounds": dict(search.bounds), "steps": dict(search.steps)}
    for key in (k for k in _PLAIN if k in changes):
        of = single["bounds" if key.startswith("bound") else "steps"]
        for dof in found.dofs:
            if bool(model.dof_is_length[model.dof_names.index(dof)]) == key.endswith("_m"):
                if changes[key] is None or float(changes[key]) == getattr(search, key):
                    of.pop(dof, None)
                else:
                    of[dof] = float(changes[key])
    return dict(single)


def _common(values: np.ndarray) -> float | None:
    """Return the value that all have; None if they differ or there is none."""
    return float(values[0]) if len(values) and np.allclose(values, values[0]) else None
