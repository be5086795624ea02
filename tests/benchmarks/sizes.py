"""Measure sizes that are acquired from nothing: `python tests/benchmarks/sizes.py --data DIR --scenes DIR`.

The people and recordings of `acquisition.py`. No height, joint or pose is given: `init --method auto` finds the people,
`acquire` fits their bodies. Lengths between limb joints are compared with the medians of the reference. Errors over
sigmas have a root mean square of 1 where the stated standard deviations are right.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from acquisition import Recording, new_session, percent, quadrille, run
from doc_tables import Conditions

from tracker.estimation.acquisition.segment_lengths import SEGMENTS, segment_lengths
from tracker.evaluation.references import read_joints
from tracker.session.session import load_session

TABLES = ("sizes",)
HEADS = (*SEGMENTS, "rms", "errors over sigmas")
CONDITIONS = Conditions(
    footage="the people and recordings of `acquisition.py`",
    body="acquired from the footage; no height, joint or pose is given. Errors are those of the lengths between limb "
    "joints, as shares of the reference's; the last column is the root mean square of errors over standard deviations",
    start="found by `init --method auto`",
    settings="defaults of `acquire`",
    chosen="those of first poses, of visual hulls, and of the prior on sizes",
    command="python tests/benchmarks/sizes.py --data DIR --write docs/measurements.md",
)


class Sizes(NamedTuple):
    """The segments of an acquired body against those of the reference."""

    name: str
    shares: np.ndarray
    """Error of each of `SEGMENTS`, as a share of the true length."""
    ratios: np.ndarray
    """The same error over its stated standard deviation."""

    @property
    def cells(self) -> list[str]:
        """Cells of the table, in the order of `HEADS`."""
        rms, ratio = np.sqrt(np.mean(self.shares**2)), np.sqrt(np.mean(self.ratios**2))
        return [*map(percent, self.shares), f"{100 * rms:.1f}%", f"{ratio:.2f}"]


def acquired_sizes(recording: Recording, folder: Path) -> Iterator[Sizes]:
    """Find the people of a recording and acquire their bodies."""
    at = new_session(recording, folder)
    quadrille("init", at, "--method", "auto")
    for person, path in recording.references.items():
        joints = read_joints(path, load_session(at).fps)
        true_m = segment_lengths({n: joints.points[:, i] for i, n in enumerate(joints.names)})
        rows = {row["name"]: row for row in quadrille("acquire", at, "--person", person)["segments"]}
        errors_m = np.array([rows[n]["length_m"] - true_m[n] for n in SEGMENTS])
        sigmas_m = np.array([rows[n]["sigma_m"] for n in SEGMENTS])
        yield Sizes(recording.label(person), errors_m / [true_m[n] for n in SEGMENTS], errors_m / sigmas_m)


if __name__ == "__main__":
    run(__doc__, HEADS, acquired_sizes, TABLES[0], CONDITIONS)
