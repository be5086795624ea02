"""Ways to read the points of a file: by names, axes, unit and frames. One score in nats compares them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from math import gcd
from typing import Protocol

import numpy as np

from tracker.compute.quantiles import known_median
from tracker.estimation.acquisition.size_parameters import SizePriors
from tracker.estimation.fitting.hypothesis import CLEAR_NATS
from tracker.formats.joint_maps import JointMap
from tracker.formats.model_toml import DEFAULT_HEIGHT_M
from tracker.formats.trc import axes_matrix, axis_conventions
from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.geometry.lengths import METRES_BY_WORD, USUAL_SIZES
from tracker.geometry.same_place import INLIER_M
from tracker.interchange.observations.checks import SAMPLES
from tracker.interchange.plausibility.body_likelihood import (
    PRIORS,
    Bones,
    Places,
    bend_nats,
    bones,
    stature_nats,
    upright_nats,
)
from tracker.interchange.plausibility.lags import Lag, combined_lag, find_lag


@dataclass(frozen=True, eq=False)
class PosedPerson:
    """Joints of a person on some frames."""

    places: Places
    """Positions by name, (F, 3) each, metres; NaN where unknown."""
    ignores_offsets: bool = False
    """Whether the median offset of each joint costs nothing: where the motion is compared, not the place."""
    n_views: int = 3
    """Number of coordinates of a joint, each of which is measured."""
    knows_frames: bool = True
    """Whether they differ from frame to frame."""

    @property
    def certain(self) -> "PosedPerson":
        """All of it."""
        return self

    def costs(self, places: Places) -> Array:
        """Return how far joints lie from the known ones, (F,); see `readings.KnownPeople`."""
        squares = np.minimum(self._away_m(places, 0) / INLIER_M, 1.0) ** 2
        n_known = np.isfinite(squares).sum(axis=1)
        return np.where(n_known > 0, np.nansum(squares, axis=1) / np.maximum(n_known, 1), np.nan)

    def lag_errors_m(self, places: Places, most: int) -> list[Array]:
        """Return how far joints lie from those of other frames, (2 most + 1, F, n_joints), metres, as a list of one."""
        return [np.stack([self._away_m(places, shift) for shift in range(-most, most + 1)])]

    def _away_m(self, places: Places, shift: int) -> Array:
        """Return the distances from the joints so many frames later, (F, n_joints); NaN where unknown."""
        names = [name for name in places if name in self.places]
        given, known = (np.array([p[n] for n in names]).reshape(len(names), -1, 3) for p in (places, self.places))
        steps = np.full(given.shape, np.nan)
        at = np.arange(given.shape[1])
        inside = (at + shift >= 0) & (at + shift < known.shape[1])
        steps[:, inside] = given[:, inside] - known[:, at[inside] + shift]
        steps = np.swapaxes(steps, 0, 1)
        return np.linalg.norm(steps - known_median(steps) * self.ignores_offsets, axis=-1)


class KnownPeople(Protocol):
    """Evidence of where people are on some frames."""

    @property
    def n_views(self) -> int:
        """Number of measurements of each limb in a posture."""

    @property
    def knows_frames(self) -> bool:
        """Whether it differs from frame to frame."""

    @property
    def certain(self) -> "KnownPeople":
        """The part of it that suffices to refute people who are elsewhere."""

    def costs(self, places: Places) -> Array:
        """Return how far a person is from it, (F,): mean truncated squares, 0 to 1; NaN where unknown.

        Args:
            places: of the person on the frames, metres.
        """

    def lag_errors_m(self, places: Places, most: int) -> Sequence[Array]:
        """Return how far a person is from it on other frames, (n_lags, ..., n), metres; NaN where unknown.

        Each kind of evidence has its own.

        Args:
            places: of the person on the frames, metres.
            most: largest lag of the evidence, steps; lags are evenly spaced, and 0 is in the middle.
        """


@dataclass(frozen=True, eq=False)
class Reading:
    """A way to read the points of a file."""

    joint_map: JointMap
    """Names of its points."""
    axes: str = "x,y,z"
    """Axes of the file that are the session's x, y, z."""
    scale: float = 1.0
    """Factor of the points as they were read."""


@dataclass(frozen=True, eq=False)
class ReadPoints:
    """Points of people on some frames of a session, as a file has them."""

    names: tuple[str, ...]
    """Names of the points in the file, (n_points,); empty if it has none, and a reading names them by their order."""
    points: Array
    """Positions in the axes of the file, (F, n_people, n_points, 3), metres as they are read; NaN where unknown."""
    frames: IntArray
    """Frames of the session, (F,), at equal steps."""
    statures_m: tuple[float, ...]
    """Height of each person that the session states, metres."""
    up: Array
    """Direction of the vertical of the session, (3,)."""
    fps: float
    """Frames of the session per second."""
    known_people: KnownPeople | None
    """The people of the recording on these frames; None for the body alone."""
    is_everybody: bool = True
    """Whether the recording has nobody else."""

    @property
    def step(self) -> int:
        """Frames of the session from one to the next."""
        return int(self.frames[1] - self.frames[0]) if len(self.frames) > 1 else 1

    @cached_property
    def n_postures(self) -> float:
        """Number of postures that are another one each."""
        known = np.isfinite(self.points).all(axis=-1).reshape(len(self.points), -1).any(axis=1)
        return float(np.clip(known.sum() * self.step / self.fps / PRIORS.posture_s, 1.0, PRIORS.postures))

    def places(self, reading: Reading) -> list[Places]:
        """Return the points of the body of each person under a reading, metres."""
        at = {name: i for i, name in enumerate(self.names or reading.joint_map.points)}
        columns = {point: at[marker] for point, marker in reading.joint_map.markers.items() if marker in at}
        read = reading.scale * self.points @ axes_matrix(reading.axes).T
        return [{p: read[:, person, i] for p, i in columns.items()} for person in range(read.shape[1])]

    def bones(self, reading: Reading) -> list[Bones]:
        """Return the bones of each person under a reading."""
        return [bones(places) for places in self.places(reading)]

    def posture_and_place(self, reading: Reading) -> tuple[float, float, float]:
        """Return log likelihood ratios of a reading, nats: by upright people, by bent joints, and by their place."""
        n, people = self.n_postures, self.places(reading)
        upright, bend = sum(upright_nats(p, self.up) for p in people), sum(bend_nats(p) for p in people)
        return n * upright, n * bend, self._place_nats(reading)

    def misplaced(self, reading: Reading) -> float:
        """Return how far the people of a reading are from those of the recording, 0 to 1; NaN if unknown."""
        if self.known_people is None:
            return np.nan
        costs = np.concatenate([self.known_people.costs(places) for places in self.places(reading)])
        known = costs[np.isfinite(costs)]
        return float(known.mean()) if len(known) else np.nan

    def likeliest(self, given: Reading, maps: Sequence[JointMap], in_space: bool) -> list[Reading]:
        """Return the likeliest readings, the best first and all that are about as likely.

        Args:
            given: the one by which the file is read.
            maps: names that the points may have.
            in_space: whether the axes and the unit are the file's; those of key points are the cameras'.
        """
        axes = [*axis_conventions()] if in_space else [given.axes]
        by_map = {m.name: self.bones(replace(given, joint_map=m)) for m in maps}
        scales = self._scales(given) if in_space else [given.scale]
        body = {Reading(*each): -np.inf for each in product(maps, axes, scales)}
        statures = {
            (name, s): sum(stature_nats(s * b.stature, t) for b, t in zip(found, self.statures_m, strict=True))
            for (name, found), s in product(by_map.items(), scales)
        }
        postures = {
            (m.name, a): sum(upright_nats(p, self.up) + bend_nats(p) for p in self.places(Reading(m, a)))
            for m, a in product(maps, axes)
        }
        for r in body:
            name = r.joint_map.name
            of_body = sum(b.nats for b in by_map[name]) + postures[name, r.axes]
            body[r] = self.n_postures * of_body + statures[name, r.scale]
        found, best = list[tuple[float, Reading]](), -np.inf
        for reading in sorted(body, key=lambda r: -body[r]):  # places only take from it
            if body[reading] < best - CLEAR_NATS:
                break
            found.append((body[reading] + self._place_nats(reading), reading))
            best = max(best, found[-1][0])
        return [r for nats, r in sorted(found, key=lambda f: -f[0]) if nats > best - CLEAR_NATS]

    def _scales(self, given: Reading) -> list[float]:
        """Return the factors that give people usual heights; the given one alone if it does, or if none does.

        A height that nobody has competes with none: a person who is too small is within the silhouettes more easily.
        """
        statures = np.array([b.stature for b in self.bones(given)]) / given.scale
        expected = np.array(self.statures_m)[np.isfinite(statures)]
        statures = statures[np.isfinite(statures)]

        def is_near(scale: float) -> Mask:
            return np.abs(np.log(scale * statures / expected)) <= PRIORS.height_sigmas * SizePriors().height

        if is_near(given.scale).all():
            return [given.scale]
        units = {*METRES_BY_WORD.values()}
        scales = sorted({round(a / b, 9) for a in units for b in units})
        usual = [s for s in scales if is_near(s).any() or any(map(USUAL_SIZES["person"].has, s * statures))]
        return usual or [given.scale]

    def lag(self, reading: Reading) -> Lag | None:
        """Return by how many frames of the session the recording is later than the points; None if that is unknown.

        It is at most a quarter of the stretch and `SAMPLES` steps.
        """
        most = min(len(self.points) // 4, SAMPLES)
        if self.known_people is None or not most:
            return None
        of_people = [self.known_people.lag_errors_m(places, most) for places in self.places(reading)]
        n_rows = PRIORS.posture_s * self.fps / self.step
        errors = [np.concatenate(kind, axis=-1) for kind in zip(*of_people, strict=True)]
        return combined_lag([find_lag(e, most * self.step, n_rows) for e in errors])

    def _place_nats(self, reading: Reading) -> float:
        """Return the log likelihood of a reading by where people are, up to a constant; at most 0.

        Beside other people, a place counts only where it is refuted: those who are nearer to another one's place are
        no reason to put them there.
        """
        off = float(np.nan_to_num(self.misplaced(reading)))
        return self._weight * (off if self.is_everybody else max(off, PRIORS.most_off))

    @property
    def _weight(self) -> float:
        """Log likelihood of people who are far from those of the recording.

        Distances are normal with the standard deviation of joints, up to `INLIER_M`. Each limb counts in each view.
        """
        if self.known_people is None:
            return 0.0
        sigma_m = PRIORS.error * float(np.mean(self.statures_m))
        return -0.5 * (INLIER_M / sigma_m) ** 2 * PRIORS.parts * self.known_people.n_views * self.n_postures


def read_beside(
    known: Places, points: Array, frames: Sequence[int], up: Array, fps: float, ignores_offsets: bool = False
) -> ReadPoints:
    """Return points of a person beside known joints of that person, at equal steps from the first frame to the last.

    Args:
        known: joints on some frames; their names are those of the points.
        points: in the axes of their file, (F, n, 3), metres; NaN where unknown.
        frames: which frames these are, ascending, (F,).
        up: direction of the vertical, (3,).
        fps: frames of the session per second.
        ignores_offsets: see `PosedPerson`.
    """
    step = gcd(*np.diff(frames).tolist()) or 1
    rows = (np.asarray(frames) - frames[0]) // step
    both = np.full((2, rows[-1] + 1, len(known), 3), np.nan)
    both[:, rows] = points, np.stack([*known.values()], axis=1)
    names, stature = tuple(known), bones(known).stature
    stature = stature if np.isfinite(stature) else DEFAULT_HEIGHT_M
    person = PosedPerson(dict(zip(names, np.moveaxis(both[1], 1, 0), strict=True)), ignores_offsets)
    at = frames[0] + step * np.arange(len(both[0]))
    return ReadPoints(names, both[0][:, None], at, (stature,), up, fps, person)
