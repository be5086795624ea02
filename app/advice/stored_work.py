"""Stored poses of each person, as far as the next step depends on them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

from tracker.body.limbs import limb_display_name, limbs
from tracker.body.model import BodyModel
from tracker.formats.model_toml import has_preset_proportions

_OF_RUNS = ("tracked", "smoothed")
"""Sources of the poses of tracking runs."""


class Unsure(NamedTuple):
    """Successive poses in doubt for one reason."""

    first: int
    last: int
    worst: int
    """The frame to look at first."""
    status: str
    """`doubtful` or `lost`, of the worst frame."""
    probability: float
    """Of the limb to be lost on the worst frame; 0 where no limb is named."""
    limb: str
    """For display; empty where no limb is named."""

    @property
    def severity(self) -> tuple[bool, float]:
        """The status, then the probability."""
        return self.status == "lost", self.probability


@dataclass(frozen=True)
class PersonWork:
    """The stored poses of one person."""

    name: str
    first: int | None = None
    """First frame with a pose; None without poses."""
    last: int | None = None
    step: int = 1
    """Smallest distance between frames with poses."""
    n_tracked: int = 0
    """Number of poses of tracking runs."""
    n_poses: int = 0
    unsure: tuple[Unsure, ...] = ()
    """Poses in doubt that nobody has reviewed, the most severe first."""
    n_unsure: int = 0
    """Number of these poses."""
    has_usual_sizes: bool = True
    """Whether the body has the proportions of its preset."""

    @classmethod
    def of(cls, name: str, model: BodyModel, cells: Mapping[int, Mapping[str, Any] | None], fps: float) -> "PersonWork":
        """Sum up the cells of a person's timeline; see `TimelineCells`."""
        rows = sorted((frame, cell) for frame, cell in cells.items() if cell is not None)
        frames = [frame for frame, _ in rows]
        doubted = [(f, c) for f, c in rows if c["status"] in ("doubtful", "lost") and not c["reviewed"]]
        names = [limb_display_name(limb.name) for limb in limbs(model)]
        return cls(
            name=name,
            first=frames[0] if frames else None,
            last=frames[-1] if frames else None,
            step=min((b - a for a, b in pairwise(frames)), default=1),
            n_tracked=sum(cell["source"] in _OF_RUNS for _, cell in rows),
            n_poses=len(rows),
            unsure=_stretches(doubted, names, fps),
            n_unsure=len(doubted),
            has_usual_sizes=has_preset_proportions(model),
        )


@dataclass(frozen=True)
class StoredWork:
    """Stored poses of all people of a session."""

    people: tuple[PersonWork, ...]
    n_frames: int
    has_outlines: bool = True
    """Whether some camera has a background or masks; else only what moves shows the people."""
    cameras: tuple[str, ...] = ()
    """Names of the cameras."""

    @property
    def unplaced(self) -> list[int]:
        """Indices of the people without any pose."""
        return [i for i, p in enumerate(self.people) if not p.n_poses]

    @property
    def is_tracked(self) -> bool:
        """Whether there is a pose of a tracking run."""
        return any(p.n_tracked for p in self.people)

    @property
    def n_poses(self) -> int:
        """Number of poses of all people."""
        return sum(p.n_poses for p in self.people)


def _stretches(
    doubted: Iterable[tuple[int, Mapping[str, Any]]], limbs: Sequence[str], fps: float
) -> tuple[Unsure, ...]:
    """Gather poses in doubt of one reason within a second, as the page's list of doubts does; most severe first."""
    found, last_of = list[Unsure](), dict[str, int]()
    for frame, cell in doubted:
        chances = cell["limbs_lost"]
        probability = max(chances, default=0.0)
        limb = limbs[chances.index(probability)] if chances else ""
        here = Unsure(frame, frame, frame, cell["status"], probability, limb)
        at = last_of.get(limb or cell["remark"])
        if at is None or frame - found[at].last > fps:
            last_of[limb or cell["remark"]] = len(found)
            found.append(here)
            continue
        worst = max(found[at], here, key=lambda u: u.severity)
        found[at] = worst._replace(first=found[at].first, last=frame)
    return tuple(sorted(found, key=lambda u: (*u.severity, u.last - u.first), reverse=True))
