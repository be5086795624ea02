"""Score poses by colours of body parts, and single limbs by colours and edges; region evidence, learnt over a run.

Imports `estimation.fitting` of its wing. Callers use
`part_colors.Colors` and the `limb_score.LimbScorer` that it makes; `region_model.learn_regions`, the
`RegionModel` that it returns, `region_limb_scorer.RegionLimbScorer`, `region_residuals.region_residuals`
and `region_model.elsewhere_nats`.
"""

__all__ = [
    "background_density",
    "part_colors",
    "part_drawing",
    "region_limb_scorer",
    "region_model",
    "region_residuals",
]
