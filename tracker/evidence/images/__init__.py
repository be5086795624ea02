"""Turn pixels into features: undistortion, background subtraction, edges, segments, distance transforms, histograms.

The room knows neither bodies nor footage and imports only `compute` and `geometry`. Callers use `working_view`,
`background_subtraction`, `edges`, `edge_segments`, `silhouette_contour`, `edges`,
`distance_transform` and `color_histogram`.
"""

__all__ = [
    "background_subtraction",
    "change",
    "color_histogram",
    "distance_transform",
    "edge_segments",
    "edges",
    "silhouette_contour",
    "working_view",
]
