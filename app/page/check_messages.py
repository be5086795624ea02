"""Messages to the page about poses that deserve a look, as `message_types` explains."""

from app.page.message_types import Message, Part


class MovedLimb(Part, frozen=True):
    """A limb that the fit moved although nobody had touched it."""

    person: int
    limb: str
    """For display: `left arm`."""
    distance_cm: float


class UnseenDepth(Part, frozen=True):
    """Points that the user placed in opposite or neighbouring views alone."""

    person: int
    points: tuple[str, ...]
    """Names of the points, the last placed one first."""
    camera: int
    """The view that looks across, and would show the depth of the first point."""


class RaisedViewCost(Part, frozen=True):
    """A view whose cost contradicts a keyframe."""

    camera: int
    cost_px: float
    usual_px: float
    """Median over the frames around the keyframe."""


class KeyframeDoubt(Part, frozen=True):
    """A keyframe that its neighbours or views contradict."""

    person: int
    frame: int
    distance_cm: float | None
    """Distance from the motion of its neighbours; null if they agree with it."""
    point: str
    """Name of the farthest point, for display; empty if they agree."""
    views: tuple[RaisedViewCost, ...]
    """Most raised first."""


class InconsistentMessage(Message, frozen=True, tag="inconsistent"):
    """Frames whose pose does not agree with the motion around it (`tracker/motion/consistency.py`)."""

    frames: tuple[int, ...]
    """All of them, ascending. A doubted keyframe stands for its neighbours."""
    keyframes: tuple[KeyframeDoubt, ...]
    """By person and frame."""
