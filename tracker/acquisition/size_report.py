"""Report acquired sizes: lengths and girths before and after, with their uncertainty."""

from typing import NamedTuple

import numpy as np

from tracker.acquisition.from_contours import Acquisition
from tracker.acquisition.size_parameters import DIFFERENCE, SizeParameters
from tracker.body.dimensions import dimensions_of, mirror_part, with_height_of_stature
from tracker.body.limbs import display_name
from tracker.body.model import BodyModel


class SizeChange(NamedTuple):
    """One size of a body before and after an acquisition, metres."""

    name: str
    """For people, such as `left forearm, length`."""
    before_m: float
    after_m: float
    sigma_m: float
    """Standard deviation of the size after the acquisition, metres."""


def size_changes(acquisition: Acquisition) -> list[SizeChange]:
    """List all sizes, those that changed most, by share, first. One side stands for both if they are coupled."""
    parameters, fit = acquisition.parameters, acquisition.fit
    before, after = (_measured(parameters, b) for b in (parameters.body(np.zeros_like(fit.sizes)), fit.body))
    J = np.empty((len(after), len(fit.sizes)))
    for i, step in enumerate(DIFFERENCE * np.eye(len(fit.sizes))):
        more = _measured(parameters, parameters.body(fit.sizes + step))
        J[:, i] = [(more[n] - after[n]) / DIFFERENCE for n in after]
    sigmas = np.sqrt(np.einsum("ij,jk,ik->i", J, fit.covariance, J))
    rows = [SizeChange(n, before[n], after[n], float(s)) for n, s in zip(after, sigmas, strict=True)]
    return sorted(rows, key=lambda r: -abs(np.log(r.after_m / r.before_m)))


def _measured(parameters: SizeParameters, body: BodyModel) -> dict[str, float]:
    """Return each size of a body, metres, by its name for people."""
    sizes = dimensions_of(body)
    out = {"height": with_height_of_stature(body, parameters.base).height_m}
    for part, own in sizes.parts.items():
        if parameters.coupled and part.startswith("right_") and mirror_part(part) in sizes.parts:
            continue
        name = display_name(part.removeprefix("left_") if parameters.coupled else part)
        out[f"{name}, length"] = own.length_m
        for side, girth_m in zip(("front to back", "side to side"), own.girths_m, strict=True):
            out[f"{name}, thickness {side}"] = 2 * girth_m
    return out | {f"distance of the {w}s": width_m for w, width_m in sizes.widths_m.items()}
