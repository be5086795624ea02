"""Make a session of what a user has entered in the page."""

from collections.abc import Callable
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from app.session.path_choice import typed_path
from tracker.errors import SessionError
from tracker.session.assemble import DEFAULT_MODEL, NewSession, assemble, footage_in
from tracker.session.session import Session
from tracker.validation import FrameRate, Name

_Path = Annotated[str, Meta(min_length=1, max_length=4096, description="a path")]
_Height = Annotated[float, Meta(ge=0.3, le=3, description="a height of 0.3 to 3 metres")]


class NewSessionForm(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What makes a session, as a user types it."""

    folder: _Path
    """Folder to make."""
    calibration: _Path
    """File of the cameras."""
    footage: _Path
    """Folder with a video or a folder of images for each camera, named after it."""
    people: Annotated[list[Name], Meta(min_length=1, max_length=20)]
    heights_m: Annotated[list[_Height], Meta(max_length=20)] = []
    """Body heights: one for all people, or one for each in their order; empty for that of the body model."""
    up: Literal["x", "y", "z", "-x", "-y", "-z"] = "z"
    """World axis that points up."""
    units: Literal["m", "cm", "mm"] | None = None
    """Unit of the calibration's translations; null for the one that its layout fixes, else metres."""
    fps: FrameRate | None = None
    """Rate at which the cameras filmed, if the videos declare another one or all footage is images."""
    background: _Path | None = None
    """Folder with an image or video of the empty scene for each camera."""


def make_session(form: NewSessionForm, report: Callable[[str], None]) -> Session:
    """Make a session folder. Nothing is written unless all of it fits.

    Args:
        form: what to make it of.
        report: called with a sentence after each check that has passed.

    Raises:
        TrackerError: something is missing or does not fit.
    """
    if len(form.heights_m) not in (0, 1, len(form.people)):
        raise SessionError(
            f"expected one height for all, or one for each of {len(form.people)} people, found {len(form.heights_m)}; "
            "separate them by commas, in the order of the names"
        )
    each = dict(zip(form.people, form.heights_m, strict=False))
    request = NewSession(
        typed_path(form.folder),
        calibration=typed_path(form.calibration),
        videos=footage_in(typed_path(form.footage)),
        background=None if form.background is None else typed_path(form.background),
        people=tuple(form.people),
        models=DEFAULT_MODEL,
        heights=each if len(form.heights_m) > 1 else next(iter(form.heights_m), None),
        fps=form.fps,
        up=form.up,
        units=form.units,
    )
    return assemble(request, report, report)
