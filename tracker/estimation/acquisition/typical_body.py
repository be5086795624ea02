"""The body of typical proportions for a stature, on which the priors of an acquisition are centred."""

from dataclasses import replace

import numpy as np

from tracker.body.dimensions import dimensions_of, stature_m, with_dimensions
from tracker.body.model import BodyModel
from tracker.formats.model_toml import PRESETS, has_preset_proportions, load_model

_LEG_SHARES = ((0.50, 0.348), (1.39, 0.475))
"""Statures, metres, and shares of them that are legs: stature without sitting height. Between newborns (0.50 m; WHO
Child Growth Standards 2006) and the beginning of puberty (1.45 m, 0.483; WHO growth reference 2007) the share rises
linearly, and it reaches that of adults at 1.39 m. Shares are those of the longitudinal study of 332 children in Arch.
Argent. Pediatr. 2013, 111:309: 0.652 of a newborn's length is sitting height, 0.517 at puberty, 0.525 of an adult's."""
_LEGS = ("left_thigh", "right_thigh", "left_calf", "right_calf")


def typical_body(body: BodyModel) -> BodyModel:
    """Return a body of the same preset and stature in typical proportions, whatever the sizes of the body are.

    Below 1.39 m these are a child's: shorter legs, and a head that makes up for them (Snyder et al. 1977). A body of no
    preset stays as it is, because its typical proportions are not known.
    """
    if body.name not in PRESETS:
        return body
    preset = replace(load_model(body.name, body.height_m), height_sigma=body.height_sigma)
    if preset.dof_names != body.dof_names or list(preset.part_index) != list(body.part_index):
        return body
    statures_m, shares = np.transpose(_LEG_SHARES)
    by = float(np.interp(stature_m(preset), statures_m, shares) / shares[-1])
    if by < 1 and {*_LEGS, "head"} <= set(preset.part_index):
        return _with_legs(preset, by)
    return body if has_preset_proportions(body) else preset


def _with_legs(body: BodyModel, by: float) -> BodyModel:
    """Return a body with legs that are longer by a factor, and a head of another size so that the stature stays."""
    with_legs, wanted_m = _scaled(body, {n: by for n in _LEGS}), stature_m(body)
    # The stature grows linearly with the head.
    missing_m = wanted_m - stature_m(with_legs)
    grown_m = stature_m(_scaled(with_legs, {"head": 2.0})) - stature_m(with_legs)
    return _scaled(with_legs, {"head": 1 + missing_m / grown_m})


def _scaled(body: BodyModel, factors: dict[str, float]) -> BodyModel:
    """Return a body with parts that are longer by a factor; the girths of a head change with its length."""
    sizes = dimensions_of(body)
    parts = dict(sizes.parts)
    for name, by in factors.items():
        length_m, (a_m, b_m) = parts[name]
        across = by if name == "head" else 1.0
        parts[name] = parts[name]._replace(length_m=by * length_m, girths_m=(across * a_m, across * b_m))
    return with_dimensions(body, sizes._replace(parts=parts))
