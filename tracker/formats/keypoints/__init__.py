"""Files of key points in pictures, and of masks beside them: one module each.

Imports `geometry` and `body`; knows no session. Callers use `picture_table.PictureTable` and the modules; the table of
all programs is `tracker.interchange.observations.readers`.
"""

__all__ = [
    "coco",
    "coco_reading",
    "coco_segmentation",
    "deeplabcut",
    "detections",
    "hand_labels",
    "hdf5",
    "picture_names",
    "picture_table",
]
