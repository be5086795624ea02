"""Pure functions: state to line segments, curves, labels, JPEG."""
