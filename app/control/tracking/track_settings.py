"""Edit the settings of the tracker, and keep them with the session."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import Annotated, Any, TypedDict

import msgspec

from app.state.run_choices import MAX_STRIDE, RunChoices
from tracker.errors import TrackerError
from tracker.estimation.by_frame.settings import EstimationSettings
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.tracking.method import Method, OptionValue
from tracker.estimation.tracking.tracker import TrackerSettings
from tracker.pipeline.methods import METHODS, all_options, compared_by, method_named
from tracker.session.matching import check_names

SETTING = "track_settings"
"""Setting of the session."""
_COSTS = ("theta_px", "outliers")
"""Settings of the search that hold for every method that has them."""
_RENAMED = {"past_poses": "window", **dict.fromkeys(("backward_pass", "audit", "smooth"), "whole_run")}
"""Options whose names have changed since sessions store them. Parts of a whole run had switches of their own."""


class _Stored(TypedDict, total=False):
    """The choices that are no options of a method."""

    method: str
    stride: Annotated[int, msgspec.Meta(ge=1, le=MAX_STRIDE)]
    cameras: tuple[str, ...]


def defaults(method: Method) -> dict[str, OptionValue | None]:
    """Return the default of each option of a method that the page shows."""
    settings = method.settings()
    return {option.name: option.read(settings) for option in method.options if option.is_on_page}


def with_choices(before: RunChoices, changes: Mapping[str, Any], cameras: Sequence[str]) -> RunChoices:
    """Return choices for a run with the changes of a page.

    Args:
        before: the present choices.
        changes: any of `method`, `stride`, `cameras` and `options`: values by name, None for the default.
        cameras: names of all cameras of the session.

    Raises:
        TrackerError: a method, camera or option is unknown, or a value is invalid.
    """
    named = changes.get("cameras", before.cameras)
    check_names(named, cameras, "camera", "the cameras to track with")
    chosen = tuple(name for name in cameras if name in named)
    known, options = all_options(), dict(before.options)
    for name, value in changes.get("options", {}).items():
        if name not in known:
            raise TrackerError(f"expected an option among {', '.join(known)}, found '{name}'; choose one of them")
        options.pop(name, None)
        if value is not None:
            options[name] = known[name].check(value)
    usual = {name: value for method in METHODS.values() for name, value in defaults(method).items()}
    return RunChoices(
        method_named(changes.get("method", before.method)).name,
        changes.get("stride", before.stride),
        () if len(chosen) == len(cameras) else chosen,
        {name: value for name, value in options.items() if value != usual[name]},
    )


def changed(before: TrackSettings, choices: RunChoices) -> TrackSettings:
    """Return the settings of the page's search with the options that a user chose.

    Args:
        before: the present settings.
        choices: of the user.
    """
    method = METHODS[before.method]
    values = {**defaults(method), **choices.options}
    settings = method.with_options(before, {name: value for name, value in values.items() if value is not None})
    assert isinstance(settings, TrackSettings)
    return settings


def of_run(settings: TrackSettings, choices: RunChoices) -> TrackerSettings:
    """Return the settings of a run: the options that a user chose, and what the search has in common with its method.

    Args:
        settings: of the page's search.
        choices: of the user.
    """
    method = METHODS[choices.method]
    own: Any = settings if settings.method == method.name else method.settings()
    shared = {f.name: getattr(settings, f.name) for f in fields(own) if f.name in _COSTS}
    chosen: TrackerSettings = method.with_options(replace(own, **shared), choices.options)
    return chosen if choices.stride == 1 else method.at_stride(chosen, choices.stride)


def of_estimates(settings: TrackSettings, choices: RunChoices) -> EstimationSettings:
    """Return the settings of estimates of stored poses: those of a run, or the usual ones if its method has none.

    Args:
        settings: of the page's search.
        choices: of the user.
    """
    return compared_by(of_run(settings, choices))


def stored(choices: RunChoices) -> dict[str, Any]:
    """Return what the session keeps: the differences from the default, options among them."""
    default = RunChoices()
    own = {"method": choices.method, "stride": choices.stride, "cameras": choices.cameras}
    return {**{k: v for k, v in own.items() if v != getattr(default, k)}, **choices.options}


def restored(data: object, cameras: Sequence[str]) -> RunChoices:
    """Return choices that a session keeps; the default where it keeps none, or none of this version.

    Args:
        data: the result of `stored`, or any other JSON value.
        cameras: names of all cameras of the session.
    """
    if not isinstance(data, Mapping):
        return RunChoices()
    own = {k: v for k, v in data.items() if k in _Stored.__annotations__}
    options = {_RENAMED.get(k, k): v for k, v in data.items() if k not in own}
    options = {k: str(v) if k == "order" else v for k, v in options.items()}  # a number in older sessions
    try:
        return with_choices(RunChoices(), {**msgspec.convert(own, _Stored, strict=True), "options": options}, cameras)
    except (TrackerError, msgspec.ValidationError):
        return RunChoices()
