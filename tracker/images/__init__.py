"""Pixels to features, no body and no footage: undistortion, background subtraction, edges, segments, distance
transforms, colour histograms."""
