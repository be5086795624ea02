"""The tracker as KRH08 describe it.

The paper leaves some choices open; docs/log/trackers.md lists them with what is chosen here.
"""

import numpy as np

from tracker.body.motion.pose_steps import PredictSettings
from tracker.estimation.contour.settings import ContourSettings, ImageContours, with_sliding
from tracker.evidence.view_evidence import EdgeSettings


def paper_settings(image_contours: ImageContours = "silhouettes", sliding: bool = True) -> ContourSettings:
    """Return the settings of KRH08: each frame from the pose of the frame before, model to image, plain squares.

    Args:
        image_contours: what the contours of the model are compared with.
        sliding: whether the sliding term is part of the Jacobian.
    """
    settings = ContourSettings(
        predict=PredictSettings(order=0),
        recover=None,
        segments=False,
        edges=EdgeSettings(whole_images=True, static=False, max_segment_px=None, max_angle_rad=float(np.pi / 2)),
        whole_run=False,
        image_contours=image_contours,
        paper=True,
    )
    return with_sliding(settings, sliding)
