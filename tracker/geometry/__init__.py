"""Space without people: rotations and rigid motions, cameras, planes, solid primitives, distances to line segments.

Imports `compute`. Callers use the modules: `arrays`, `rigid`, `cameras`, `ground_plane`, `shapes`, `segment_distance`,
`triangulation`.
"""
