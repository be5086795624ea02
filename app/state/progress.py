"""Progress of long work: tracking, work on ranges of frames, indexing of footage."""

from collections.abc import Container, Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from tracker.body.model import PosedBody

Line = tuple[float, float, float, float]
"""x0, y0, x1, y1, undistorted px."""


CHAIN_STEPS = ("find", "sizes", "track", "estimate")
"""Steps from a recording without poses to tracked ones, as words for the user: find people, acquire their sizes, track
forward and backward, estimate all frames together."""
TrackStage = Literal["tracking", "back", "solve"]
"""Stages of a run: forward, backward, all frames together."""


@dataclass(frozen=True, eq=False)
class WorkState:
    """How far work in the background is, or how the last one ended."""

    running: bool = False
    stage: str = ""
    """The kind of work, as text for the user."""
    share: float = 0.0
    """Share of the work that is done, 0 to 1."""
    message: str = ""
    """How the last one ended; else empty."""
    failed: bool = False
    """Whether it ended with an error."""


class PoseWork(NamedTuple):
    """Something that is being done to poses of a session."""

    what: str
    """As text for others: `drags`, `tracks frames 10 to 50`."""
    people: frozenset[int] | None
    """Indices of the people whose poses change; None for all."""
    frames: Container[int]


@dataclass(frozen=True)
class TrackState:
    """The tracking run, running or paused."""

    running: bool = False
    first: int | None = None
    """First frame of the run in the order of tracking; None if there is no run."""
    last: int | None = None
    """Last frame of the run; smaller than `first` for a backward run."""
    at: int | None = None
    """The frame tracked last; None before the first."""
    done: int = 0
    """Number of frames tracked."""
    total: int = 0
    """Number of frames to track."""
    per_second: float = 0.0
    """Frames tracked per second of work."""
    doubtful: int = 0
    """Number of doubtful frames."""
    lost: int = 0
    """Number of lost frames."""
    stage: TrackStage = "tracking"
    """Stage of the run; `done` and `total` count its steps."""
    message: str = ""
    """How the last run ended."""
    failed: bool = False
    """Whether it ended with an error."""
    notice: str = ""
    """A sentence for the user at its end: why it failed, or that a camera seems off; else empty."""


@dataclass(frozen=True)
class FindState(WorkState):
    """The search for people whom nobody has placed, and the chain that it begins. Tracking has its own progress."""

    steps: tuple[str, ...] = ()
    """Steps of the chain in order, as words for the user."""
    step: str = ""
    """The present one before tracking."""
    trying: str = ""
    """Phrase on the frame that is tried; empty before and after."""
    left_s: float | None = None
    """Longest time that the search still takes, s; None while unknown, and once it has ended."""
    notes: tuple[str, ...] = ()
    """Sentences on who was found and how."""
    tried: int | None = None
    """Frame that is being tried; after a failure the one that the message is about. None otherwise."""
    camera: int | None = None
    """Index of the camera whose silhouette a failure is about; None for no single one."""
    sought: frozenset[int] = frozenset()
    """Indices of the people who are sought; empty when the search has ended."""
    candidates: Mapping[int, Mapping[int, PosedBody]] = field(default_factory=dict)
    """By frame and index of the person, the best first poses so far; empty when the search has ended."""
    takable: int | None = None
    """Frame of the best first poses so far if they are credible; they can be taken then."""
    frame: int | None = None
    """Frame on which people were found; None before."""
    axes: Mapping[str, tuple[tuple[Line, ...], ...]] = field(default_factory=dict)
    """By camera, for each person the successive major axes of the silhouette on that frame (GD96 Fig. 5)."""


@dataclass(frozen=True)
class RangeState:
    """Work on a range of frames: its progress, or how the last one ended."""

    running: bool = False
    what: str = ""
    """The kind of work, as text for the user: `interpolating`."""
    done: int = 0
    """Number of frames written."""
    total: int = 0
    """Number of frames to write."""
    people: frozenset[int] = frozenset()
    """Indices of the people whose poses change; empty if there is no work."""
    frames: range = range(0)
    """From the first frame that changes to the last; empty if there is no work."""
    message: str = ""
    """How the last one ended."""


@dataclass(frozen=True)
class FootageState:
    """How many frames of the videos are indexed, and whether all can be read.

    Long footage is indexed in the background when it is first opened.
    """

    listed: float | None = None
    """Share of the footage, 0 to 1; None when all of it is indexed."""
    error: str | None = None
    """Fault of a file, as a sentence; None without one."""
    recoveries: int = 0
    """Number of times that unreadable footage could be read again. Its pictures are made again then."""
