"""Synthesis: what a posed body looks like in a camera. The contour generator, what hides it, the curves where parts
meet, label images."""
