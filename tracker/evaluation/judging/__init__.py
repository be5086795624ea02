"""Judge joints that another program found: `judge` compares them with poses tracked from the same footage.

Imports `pipeline`. Contours and colours are evidence that detectors of key points do not use.
"""

__all__ = ["judge", "verdicts"]
