"""Frozen values: everything that the views need."""
