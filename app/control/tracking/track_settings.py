"""Edit the settings of the tracker."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from tracker.tracking.chamfer.settings import RecoverSettings, TrackSettings


def changed(before: TrackSettings, changes: Mapping[str, Any]) -> TrackSettings:
    """Return settings with the changes of a page.

    Args:
        before: the present settings.
        changes: any of `estimate`, `order` and `past_poses` (of the motion model), `recover`, `backward_pass`,
            `smooth`.

    Raises:
        TrackerError: a value is invalid.
    """
    predict = replace(
        before.predict,
        order=changes.get("order", before.predict.order),
        window=changes.get("past_poses", before.predict.window),
    )
    recovers = changes.get("recover", before.recover is not None)
    return replace(
        before,
        estimate=changes.get("estimate", before.estimate),
        predict=predict,
        recover=(before.recover or RecoverSettings()) if recovers else None,
        backward_pass=changes.get("backward_pass", before.backward_pass),
        smooth=changes.get("smooth", before.smooth),
    )
