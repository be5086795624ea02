"""Annotation of recordings for datasets: the expected error of what is stored, and the click that lowers it most.

May import `tracker.pipeline` and the rooms below. Offers `next_click.propose`, `expected_error.ExpectedErrors`.
"""
