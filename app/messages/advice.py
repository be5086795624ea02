"""The line over the views: what holds, and the next step."""

from typing import Literal

from app.messages.base import Message, Part

Deed = Literal[
    "accept", "acquire", "apply_correction", "apply_sizes", "by_key_points", "check_cameras", "detect", "export",
    "find", "fit", "go_to", "place", "resume", "retry", "search", "show_before", "show_doubt", "show_section",
    "show_silhouettes", "show_view", "stop", "take_all_back", "take_back", "take_found", "track", "track_again",
]  # fmt: skip
"""Effects of buttons; the page carries them out."""
Level = Literal["next", "work", "doubt", "fault"]
"""Whether the line names the next step, work under way, a result in doubt, or a failure."""


class Action(Part, frozen=True):
    """A button of the line."""

    deed: Deed
    text: str
    """Its label."""
    frame: int | None = None
    """The frame that it is about."""
    person: int | None = None
    """The person that it is about."""
    camera: int | None = None
    """The view that it is about."""
    of: str = ""
    """Name of the work, of the section or of the observations that it is about."""


class Advice(Part, frozen=True):
    """One thing that holds."""

    situation: str
    """Name of its row in the table of situations."""
    text: str
    """A sentence, or two."""
    actions: tuple[Action, ...] = ()
    """The one to take first, then others."""
    level: Level = "next"
    share: float | None = None
    """Share of the work that is done, 0 to 1; null where there is none, or where it cannot be known."""
    done: str = ""
    """How much of the work is done, for people to read."""
    steps: tuple[str, ...] = ()
    """Steps of the whole work in order, for people to read; `share` is that of the present one."""
    step: int = 0
    """Rank of the present step, from 0."""
    is_timed: bool = True
    """Whether the share grows evenly, so that the time left follows from it."""
    at_most_s: float | None = None
    """Longest time that the present step still takes, s; null while unknown, or where it follows from the share."""


class AdviceMessage(Message, frozen=True, tag="advice"):
    """Sentences of the line, whenever they changed: a dismissed one gives way to the next."""

    said: tuple[Advice, ...]
    """The most urgent first."""
