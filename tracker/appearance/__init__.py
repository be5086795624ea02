"""Score poses by colours of body parts, and single limbs by colours and edges.

The room imports `compute`, `geometry`, `body`, `images`, `contours` and `evidence`. Callers use `part_colors.Colors`
and the `limb_score.LimbScorer` that it makes.
"""
