"""Edit the settings of the tracker, and keep them with the session."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import Annotated, Any, TypedDict

import msgspec

from app.state.run_choices import MAX_STRIDE, RunChoices
from tracker.errors import TrackerError
from tracker.pipeline.methods import MethodName
from tracker.session.matching import check_names
from tracker.tracking.chamfer.settings import Estimation, TrackSettings
from tracker.tracking.contour.settings import ContourSettings
from tracker.tracking.estimation.settings import EstimationSettings, RecoverSettings, at_stride
from tracker.tracking.tracker import TrackerSettings
from tracker.tracking.voxel.settings import VoxelSettings

SETTING = "track_settings"
"""Setting of the session."""
_SHARED = ("predict", "recover", "theta_px", "outliers", "backward_pass", "smooth")
"""Settings that a user chooses for every method."""


class _Kept(TypedDict, total=False):
    """The settings that a user chooses."""

    method: MethodName
    stride: Annotated[int, msgspec.Meta(ge=1, le=MAX_STRIDE)]
    cameras: tuple[str, ...]
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


def with_choices(before: RunChoices, changes: Mapping[str, Any], cameras: Sequence[str]) -> RunChoices:
    """Return choices for a run with the changes of a page.

    Args:
        before: the present choices.
        changes: any of `method`, `stride` and `cameras`.
        cameras: names of all cameras of the session.

    Raises:
        TrackerError: a camera is unknown.
    """
    named = changes.get("cameras", before.cameras)
    check_names(named, cameras, "camera", "the cameras to track with")
    chosen = tuple(name for name in cameras if name in named)
    return RunChoices(
        changes.get("method", before.method), changes.get("stride", before.stride),
        () if len(chosen) == len(cameras) else chosen,
    )  # fmt: skip


def of_run(settings: TrackSettings, choices: RunChoices) -> TrackerSettings:
    """Return the settings of a run: the chosen ones, as far as its method has them."""
    if choices.method == "chamfer":
        return at_stride(settings, choices.stride)
    if choices.method == "voxel":
        return VoxelSettings(smooth=settings.smooth)
    shared = {f.name: getattr(settings, f.name) for f in fields(EstimationSettings) if f.name in _SHARED}
    return at_stride(ContourSettings(**shared), choices.stride)


def stored(settings: TrackSettings, choices: RunChoices) -> dict[str, Any]:
    """Return what the session keeps: the changes from the default, see `changed` and `with_choices`."""
    own, default = dict(_kept(settings, choices)), dict(_kept(TrackSettings(), RunChoices()))
    return {name: value for name, value in own.items() if value != default[name]}


def restored(data: object, cameras: Sequence[str]) -> tuple[TrackSettings, RunChoices]:
    """Return settings and choices that a session keeps; the default where it keeps none, or none of this version.

    Args:
        data: the result of `stored`, or any other JSON value.
        cameras: names of all cameras of the session.
    """
    default = TrackSettings(), RunChoices()
    if not isinstance(data, Mapping) or not data.keys() <= _kept(*default).keys():
        return default
    try:
        kept = msgspec.convert(data, _Kept, strict=True)
        return changed(default[0], kept), with_choices(default[1], kept, cameras)
    except (TrackerError, msgspec.ValidationError):
        return default


def _kept(settings: TrackSettings, choices: RunChoices) -> "_Kept":
    return _Kept(
        method=choices.method,
        stride=choices.stride,
        cameras=choices.cameras,
        estimate=settings.estimate,
        order=settings.predict.order,
        past_poses=settings.predict.window,
        recover=settings.recover is not None,
        backward_pass=settings.backward_pass,
        smooth=settings.smooth,
    )
