"""Space without people: rotations and rigid motions, cameras, planes, solid primitives, distances, sizes.

Imports `compute`. Callers use the modules: `arrays`, `rigid`, `cameras`, `ground_plane`, `shapes`, `segment_distance`,
`triangulation`, `robust_triangulation`, `lengths`.
"""

__all__ = [
    "arrays",
    "camera_correction",
    "camera_derivatives",
    "camera_rig",
    "cameras",
    "euler",
    "framing",
    "ground_plane",
    "lengths",
    "lens_tables",
    "rigid",
    "robust_triangulation",
    "same_place",
    "segment_distance",
    "shapes",
    "surface_nets",
    "triangulation",
]
