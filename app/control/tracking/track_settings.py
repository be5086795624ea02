"""Edit the settings of the tracker, and keep them with the session."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypedDict

import msgspec

from tracker.errors import TrackerError
from tracker.pipeline.methods import MethodName
from tracker.tracking.chamfer.settings import Estimation, TrackSettings
from tracker.tracking.estimation.settings import RecoverSettings

SETTING = "track_settings"
"""Setting of the session."""


class _Kept(TypedDict, total=False):
    """The settings that a user chooses."""

    method: MethodName
    estimate: Estimation
    order: int
    past_poses: int
    recover: bool
    backward_pass: bool
    smooth: bool


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


def stored(settings: TrackSettings, method: MethodName = "chamfer") -> dict[str, Any]:
    """Return what the session keeps: the changes from the default, see `changed`."""
    own, default = dict(_choices(settings, method)), dict(_choices(TrackSettings(), "chamfer"))
    return {name: value for name, value in own.items() if value != default[name]}


def restored(data: object) -> tuple[TrackSettings, MethodName]:
    """Return settings and method that a session keeps; the default where it keeps none, or none of this version."""
    default = TrackSettings()
    if not isinstance(data, Mapping) or not data.keys() <= _choices(default, "chamfer").keys():
        return default, "chamfer"
    try:
        kept = msgspec.convert(data, _Kept, strict=True)
        return changed(default, kept), kept.get("method", "chamfer")
    except (TrackerError, msgspec.ValidationError):
        return default, "chamfer"


def _choices(settings: TrackSettings, method: MethodName) -> "_Kept":
    return _Kept(
        method=method,
        estimate=settings.estimate,
        order=settings.predict.order,
        past_poses=settings.predict.window,
        recover=settings.recover is not None,
        backward_pass=settings.backward_pass,
        smooth=settings.smooth,
    )
