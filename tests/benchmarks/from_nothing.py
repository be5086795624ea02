"""Measure starts with nobody's help (docs/measurements.md): `python tests/benchmarks/from_nothing.py --data DIR`.

The people and recordings of `acquisition.py`. No height, joint or pose is given: `track --init auto --acquire` finds
the people, acquires their bodies and tracks them. Accuracy is the mean error of the 12 limb joints; a frame is lost
when one of them is off by more than 150 mm.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from acquisition import Recording, new_session, percent, quadrille, run
from doc_tables import Conditions

from tracker.session.session import load_session

TABLES = ("from_nothing",)
HEADS = ("error, mm", "lost frames", "frames called good", "good, yet a joint over 100 mm", "height off")
OFF_MM = 100.0
CONDITIONS = Conditions(
    footage="the people and recordings of `acquisition.py`",
    body="acquired from the footage; no height, joint or pose is given",
    start="found by `--init auto`",
    settings="`quadrille track --init auto --acquire`",
    chosen="those of first poses, visual hulls and the prior on the joints; on the recordings rules of tracking too",
    command="python tests/benchmarks/from_nothing.py --data DIR --write docs/measurements.md",
)


class Found(NamedTuple):
    """A person that was found and tracked."""

    name: str
    error_mm: float
    lost: int
    n_good: int
    n_good_off: int
    """Frames that are called good and have a limb joint that is off by more than 100 mm."""
    height_share: float | None
    """Error of the height, as a share; None where the height is not known."""

    @property
    def cells(self) -> list[str]:
        """Cells of the table, in the order of `HEADS`."""
        counts = (f"{n}" for n in (self.lost, self.n_good, self.n_good_off))
        return [f"{self.error_mm:.1f}", *counts, percent(self.height_share)]


def found_people(recording: Recording, folder: Path) -> Iterator[Found]:
    """Find and track the people of a recording."""
    at = new_session(recording, folder)
    quadrille("track", at, "--init", "auto", "--acquire")
    heights = {p.name: p.model.height_m for p in load_session(at).people}
    for person, joints in recording.references.items():
        result = quadrille("evaluate", at, "--reference", joints, "--person", person)
        good = [f for f in result["per_frame"] if f["status"] == "good"]
        yield Found(
            recording.label(person), result["mpjpe_mm"], result["lost_frames"], len(good),
            sum((f["worst_mm"] or 0.0) > OFF_MM for f in good),
            recording.height_share(heights[person]),
        )  # fmt: skip


if __name__ == "__main__":
    run(__doc__, HEADS, found_people, TABLES[0], CONDITIONS)
