"""Poses over time, no images: prediction, interpolation, frames that disagree with their neighbours."""
