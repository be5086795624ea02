"""People detected in the footage by a network: their points in each picture, matched across views and over time.

Imports `interchange.observations` of its wing. A network sees one picture; what views know of
each other is in `people_in_views`. Callers use `detectors.DETECTORS` and `detect.detect_people`.
"""

__all__ = ["detect", "detector", "detectors"]
