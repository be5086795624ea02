"""Poses changed by a person: drags, steps, pins, locks, sizes, alternatives."""
