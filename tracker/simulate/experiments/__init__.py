"""Experiments of papers, run again by one command that writes a report with its figures.

It may import every wing. Callers use `contour_experiment.run_contour_experiment` and
`contour_report.write_contour_report`. Evidence is synthetic: contours of a posed body or of a skinned person, drawn
without an image.
"""

__all__ = ["contour_experiment", "contour_report"]
