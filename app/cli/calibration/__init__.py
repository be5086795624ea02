"""Commands for the cameras of a recording: whether they are off, and how they are calibrated."""
