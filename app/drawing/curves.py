"""Plot poses and costs against the frame, in degrees, centimetres and pixels (GD96 Fig. 8)."""

from collections.abc import Sequence
from typing import Literal, NamedTuple, get_args

import numpy as np

from tracker.body.model import BodyModel
from tracker.geometry.arrays import Array, FloatArray
from tracker.session.store.records import FramePose

CurveGroup = Literal["arms", "torso", "legs", "cost"]
GROUPS: tuple[CurveGroup, ...] = get_args(CurveGroup)

# Words in the names of the joints of limbs; all other joints belong to the trunk.
_LIMBS = {
    "arms": ("clavicle", "collarbone", "shoulder", "elbow", "wrist", "hand"),
    "legs": ("hip", "knee", "ankle", "foot", "toe"),
}


class Plot(NamedTuple):
    """Curves that share a value axis."""

    title: str
    unit: str
    """`deg`, `cm` or `px`."""
    labels: tuple[str, ...]
    """Names of the curves."""
    dofs: tuple[int, ...]
    """Degree of freedom of each curve; empty for costs, whose curves are the mean and the views."""


def plots_of(model: BodyModel, cameras: Sequence[str], group: str) -> list[Plot]:
    """Sort a body's degrees of freedom into plots.

    Args:
        model: the body.
        cameras: names of the views.
        group: one of `GROUPS`.
    """
    if group == "cost":
        return [Plot("Cost", "px", ("mean", *cameras), ())]
    if group == "torso":
        dofs = [d for d in range(model.n_dofs) if _limb(model, d) is None]
        angles = [d for d in dofs if not model.dof_is_length[d]]
        lengths = [d for d in dofs if model.dof_is_length[d]]
        plots = [_plot(model, "Angles", angles), _plot(model, "Position", lengths)]
    else:
        dofs = [d for d in range(model.n_dofs) if _limb(model, d) == group]
        sides = {side: [d for d in dofs if model.dof_names[d].startswith(f"{side}_")] for side in ("left", "right")}
        limb = group.removesuffix("s")
        plots = [_plot(model, f"{side.capitalize()} {limb}", found) for side, found in sides.items()]
    return [plot for plot in plots if plot.dofs]


def samples(model: BodyModel, plots: Sequence[Plot], frames: Sequence[int], rows: Sequence[FramePose]) -> FloatArray:
    """Sample the curves of some plots, one after the other.

    Args:
        model: the body that the poses belong to.
        plots: of this body.
        frames: to sample, ascending.
        rows: the stored poses on these frames, ascending.

    Returns:
        (n_curves, n_frames) in the plots' units; NaN where there is no pose, or a pose of another body.
    """
    out = np.full((sum(len(p.labels) for p in plots), len(frames)), np.nan, dtype=np.float32)
    known = [row for row in rows if len(row.values) == len(model.value_names)]
    if not known:
        return out
    at = np.searchsorted(np.asarray(frames), [row.frame for row in known])
    first = 0
    for plot in plots:
        n = len(plot.labels)
        if plot.dofs:
            chosen = list(plot.dofs)
            scale = np.where(model.dof_is_length[chosen], 100.0, 180.0 / np.pi)
            out[first : first + n, at] = (scale * _dof_values(model, known)[:, chosen]).T
        else:
            out[first, at] = [np.nan if row.cost_px is None else row.cost_px for row in known]
            for column, row in zip(at, known, strict=True):
                if len(row.view_costs_px) == n - 1:
                    out[first + 1 : first + n, column] = [np.nan if c is None else c for c in row.view_costs_px]
        first += n
    return out


def _dof_values(model: BodyModel, rows: Sequence[FramePose]) -> Array:
    """Return poses in degrees of freedom, (N, n_dofs), rad and metres; ball joints as rotation vectors."""
    values = np.stack([row.values for row in rows])
    if model.value_names == model.dof_names:
        return values
    upright = np.array([float(name.endswith(".qw")) for name in model.value_names])
    return np.stack([model.difference(v, upright) for v in values])


def _limb(model: BodyModel, dof: int) -> str | None:
    joint = model.joints[model.dof_joint[dof]].name
    return next((limb for limb, words in _LIMBS.items() if any(word in joint for word in words)), None)


def _plot(model: BodyModel, title: str, dofs: Sequence[int]) -> Plot:
    """Make a plot. A curve is named by its axis alone if that is unique within the plot."""
    names = [model.dof_names[d].removeprefix("left_").removeprefix("right_") for d in dofs]
    axes = [name.partition(".")[2] for name in names]
    labels = tuple(
        axis if axes.count(axis) == 1 else name.replace(".", " ").replace("_", " ")
        for name, axis in zip(names, axes, strict=True)
    )
    unit = "cm" if dofs and model.dof_is_length[dofs[0]] else "deg"
    return Plot(title, unit, labels, tuple(dofs))
