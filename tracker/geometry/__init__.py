"""Space without people: rotations and rigid motions, cameras, planes, solid primitives, distances to line segments."""
