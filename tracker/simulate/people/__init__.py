"""Simulated people: skeletons, builds, skin, clothes."""
