"""Poses changed by a person: drags, steps, pins, locks, body sizes, alternatives.

May import `app.control.session` and `app.control.search`. Its classes are used through the controller.
"""
