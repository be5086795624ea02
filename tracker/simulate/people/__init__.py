"""Simulated people: skeletons, builds, skin, clothes, and figures of plain model parts."""

__all__ = ["anatomy", "builds", "model_figure", "outfit", "population", "skeleton", "skin", "textures"]
