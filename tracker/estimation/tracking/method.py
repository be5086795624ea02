"""The descriptor of a tracking method: its name, settings, options and paper.

Command line and page make their options and controls from it. A descriptor is light: its functions import the room of
the tracker when they are called, so that help needs no kernels.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.body.model import BodyModel
    from tracker.estimation.tracking.tracker import Tracker, TrackerSettings

OptionValue: TypeAlias = bool | float | str
"""The value of an option."""
OptionKind: TypeAlias = Literal["switch", "choice", "whole", "number"]


@dataclass(frozen=True)
class Option:
    """A setting of a tracker that users choose. Methods that share it use the same object."""

    name: str
    """Key in stored settings. The command line shows it with hyphens."""
    label: str
    """Name on the page."""
    help: str
    """Description for both programs; begins lower-case."""
    defaults: str
    """Its value where nobody chooses one, for the help; empty for a switch, which is on."""
    kind: OptionKind
    """A switch is on by default; other options of the command line may be left out."""
    read: Callable[[Any], OptionValue | None]
    """Returns the value in some settings."""
    write: Callable[[Any, Any], Any]
    """Returns settings with another value."""
    choices: Mapping[str, str] | None = None
    """Of a choice, the labels by value."""
    limits: tuple[float, float] | None = None
    """Of a number, its least and largest value; None where it is positive."""
    step: float = 1
    """Of a number, the step of the page's control."""
    is_on_page: bool = True
    """Whether the page shows it with the settings of the tracker."""

    def check(self, value: object) -> OptionValue:
        """Return a value.

        Raises:
            TrackerError: the option cannot have it.
        """
        if self.kind == "switch":
            if isinstance(value, bool):
                return value
            expected = "true or false"
        elif self.choices is not None:
            if isinstance(value, str) and value in self.choices:
                return value
            expected = f"one of {', '.join(self.choices)}"
        else:
            low, high = self.limits or (0.0, float("inf"))
            if not isinstance(value, bool) and isinstance(value, int | float) and value != 0 and low <= value <= high:
                is_whole = float(value).is_integer()
                if self.kind == "number" or is_whole:
                    return value
            expected = f"{'a whole number' if self.kind == 'whole' else 'a number'} "
            expected += "above 0" if self.limits is None else f"from {low:g} to {high:g}"
        raise TrackerError(f"expected {expected} as '{self.name}', found {value!r}; correct it")


def later(room: str | None, module: str, name: str) -> Callable[..., Any]:
    """Return a function that calls one of a room's module, which is imported then: a descriptor needs no kernels."""
    return lambda *arguments: getattr(import_module(f"{room}.{module}"), name)(*arguments)


@dataclass(frozen=True)
class PaperMode:
    """A method as its paper describes it."""

    source: str
    """Authors and year."""
    settings: "Callable[[], TrackerSettings]"
    """Returns the settings of the paper."""
    body: str | None = None
    """Name of the body model that the paper is for; None for any."""
    require_body: "Callable[[Mapping[str, BodyModel]], None]" = lambda bodies: None
    """Raises a TrackerError if a person, by name, has another body."""


@dataclass(frozen=True)
class Method:
    """A tracking method."""

    name: str
    """Stored with each pose. The settings of the method have it as `method`."""
    label: str
    """Name on the page."""
    help: str
    """How it works, in a few words; begins lower-case."""
    settings: "Callable[[], TrackerSettings]"
    """Returns the default settings."""
    make_tracker: "Callable[[Any], Tracker]"
    """Returns the tracker with some settings."""
    options: tuple[Option, ...]
    """The settings that users choose, in the order in which they are shown."""
    paper: PaperMode | None = None
    at_stride: Callable[[Any, int], Any] = lambda settings, stride: settings
    """Returns settings for a run that tracks every so many frames."""

    def with_options(self, settings: Any, values: Mapping[str, OptionValue]) -> "TrackerSettings":
        """Return settings of the method with some options.

        Args:
            settings: of the method.
            values: by name of the option; those that the method does not have are ignored.

        Raises:
            TrackerError: an option cannot have its value.
        """
        for option in self.options:
            if option.name in values:
                settings = option.write(settings, option.check(values[option.name]))
        found: TrackerSettings = settings
        return found
