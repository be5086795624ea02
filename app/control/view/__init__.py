"""Choices of what the views show: people, the floor, the 3-D view.

May import `app.control.session`. Its classes are used through the controller.
"""
