"""Simulated people: skeletons, builds, skin, clothes, and figures of plain model parts."""
