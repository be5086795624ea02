"""All cameras, one after the other, from silhouettes of a person: turns about the vertical are tried all round.

The person stands on one place of the floor in all views. What is left of a camera is its turn about the vertical.
Frontier points judge each, and the best ones are fitted to them. A few chains are followed to the end, because a wrong
turn of one camera may fit as well as the right one until the next camera is added.

Each camera by itself over the floor, from crown and feet of a person who stands upright (Lv, Zhao and Nevatia 2006).

The crown stands one stature above the feet, wherever they are on the floor. That shows the vertical and the height of
the camera, in statures, as far as the person changes place; priors of a usual camera hold back what it does not show.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from tracker.calibration.boards.camera_graph import MIN_SHARED
from tracker.calibration.self_calibration.frontier_points import frontier_points, plane_angles
from tracker.calibration.self_calibration.joint_adjustment import AdjustedJoints, Gauge, UnknownLenses, adjust_joints
from tracker.calibration.self_calibration.person_calibration import undetermined
from tracker.calibration.self_calibration.person_silhouettes import UprightRules
from tracker.calibration.self_calibration.seen_joints import SeenJoints
from tracker.errors import CalibrationError
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.geometry.cameras import Camera


class ChainEffort(NamedTuple):
    """Bounds of the search. With them, `fast_arms` is found, of whom the right turn was second of 72."""

    turns: int = 72
    """Turns about the vertical that are tried."""
    fitted: int = 4
    """Best of them that are fitted."""
    chains: int = 3
    """Chains that are followed."""
    rounds: int = 2
    """Number of times that frontier points are found again in each, and fitted."""
    frames: int = 20
    """Frames by which cameras are placed first: each fit takes half a second with them."""


EFFORT = ChainEffort()


@dataclass(frozen=True, eq=False)
class SeenSilhouettes:
    """Silhouettes of one person in the pictures of all cameras."""

    standing: SeenJoints
    """Crown and feet."""
    hulls_px: Sequence[Sequence[Array]]
    """Convex hulls by frame and camera, (n, 2), original pixels; none where unknown."""

    @property
    def counts(self) -> Array:
        """Whether a silhouette counts, (F, V)."""
        return np.array([[len(h) > 0 for h in hulls] for hulls in self.hulls_px])

    def on_frames(self, frames: IntArray) -> "SeenSilhouettes":
        """Return the silhouettes on some frames."""
        return SeenSilhouettes(self.standing.on_frames(frames), [self.hulls_px[int(k)] for k in frames])

    def of_cameras(self, cameras: Sequence[int]) -> "SeenSilhouettes":
        """Return the silhouettes in some cameras, which are numbered as they are given."""
        at, px = [*cameras], self.standing.px
        standing = replace(self.standing, px=px[:, at], is_seen=self.standing.is_seen[:, at])
        return SeenSilhouettes(standing, [[hulls[i] for i in at] for hulls in self.hulls_px])


class Chain(NamedTuple):
    """Cameras that were placed."""

    placed: dict[int, Camera]
    """By index."""
    sigma_px: float
    """Standard deviation of the points that they were fitted to."""


def silhouette_chains(seen: SeenSilhouettes, lenses: Sequence[Camera]) -> list[Chain]:
    """Return likely poses of all cameras, the best first, in the world of one of them, in statures.

    Args:
        seen: silhouettes on a few frames.
        lenses: the cameras with their lenses.

    Raises:
        CalibrationError: cameras do not see the person upright together.
    """
    own = cameras_over_floor(seen.standing.px, lenses)
    first = int(seen.standing.is_seen[:, :, 1].sum(axis=0).argmax())
    chains = [Chain({first: own[first]}, 0.0)]
    for _ in own[1:]:
        longer = sorted((c for chain in chains for c in _longer(chain, own, seen)), key=lambda c: c.sigma_px)
        refined = [_fitted(c.placed, seen, EFFORT.rounds) for c in longer[: EFFORT.chains]]
        chains = sorted((c for c in refined if c is not None), key=lambda c: c.sigma_px)
        if not chains:
            raise undetermined(len(own))
    return chains


def fitted_to_frontier(
    cameras: Sequence[Camera], seen: SeenSilhouettes, gauge: Gauge, rounds: int, lenses: UnknownLenses | None = None
) -> AdjustedJoints | None:
    """Fit cameras to crown, feet and frontier points, which are found again some times; None where that fails."""
    found = None
    for _ in range(rounds):
        joints = seen.standing.with_more(frontier_points(seen.hulls_px, cameras).seen)
        observations = joints.observations()
        try:
            found = adjust_joints(cameras, observations, joints.n_joints, gauge, lenses)
        except np.linalg.LinAlgError:
            return None
        if found is None or 2 * len(found.observed.px) < len(observations.px):
            return None  # rays to most points are parallel
        cameras = found.cameras
    return found


def _fitted(placed: dict[int, Camera], seen: SeenSilhouettes, rounds: int) -> Chain | None:
    found = fitted_to_frontier([*placed.values()], seen.of_cameras([*placed]), Gauge(0, len(placed) - 1), rounds)
    return None if found is None else Chain(dict(zip(placed, found.cameras, strict=True)), found.sigma_px)


def _longer(chain: Chain, own: Sequence[Camera], seen: SeenSilhouettes) -> list[Chain]:
    """Add the camera that shares most frames with those of a chain, in several ways."""
    feet = np.stack([on_floor(c, seen.standing.px[:, i, 1]) for i, c in enumerate(own)])
    ways = np.stack([on_floor(c, seen.standing.px[:, i, 1]) for i, c in chain.placed.items()])
    shared: Mask = np.asarray(np.isfinite(feet).all(axis=2) & np.isfinite(ways).all(axis=2).any(axis=0))
    added = max((i for i in range(len(own)) if i not in chain.placed), key=lambda i: shared[i].sum())
    at = shared[added]
    if at.sum() < MIN_SHARED:
        raise CalibrationError(
            f"expected the person upright in camera '{own[added].name}' and another one on at least {MIN_SHARED} "
            f"frames, found {at.sum()}; let the person walk where they see the same place"
        )
    turned = _turned(own[added], feet[added, at], np.nanmedian(ways[:, at], axis=0))
    scores = np.array([_contradiction({**chain.placed, added: c}, added, seen) + off for c, off in turned])
    minima = [i for i in np.argsort(scores) if scores[i] <= min(scores[i - 1], scores[(i + 1) % len(scores)])]
    # Of a pair, each way is followed to its end: a wrong one is the nearest at first.
    rounds = 1 if len(chain.placed) > 1 else EFFORT.rounds
    fits = [_fitted({**chain.placed, added: turned[i][0]}, seen, rounds) for i in minima[: EFFORT.fitted]]
    return [f for f in fits if f is not None]


def _turned(camera: Camera, feet: Array, way: Array) -> list[tuple[Camera, float]]:
    """Turn a camera about the vertical all round, each time moved so that its feet, (F, 2), lie on a way, (F, 2).

    Returns:
        Each turn, and the median angle by which feet and way differ in its picture, rad.
    """
    a, b = (w[:, 0] + 1j * w[:, 1] for w in (feet, way))
    out = []
    for angle in 2 * np.pi * np.arange(EFFORT.turns) / EFFORT.turns:
        apart = b - np.exp(1j * angle) * a
        shift = complex(np.median(apart.real), np.median(apart.imag))
        T = rigid.transform(rigid.so3_exp(np.array([0.0, 0.0, angle])), np.array([shift.real, shift.imag, 0.0]))
        moved = replace(camera, T_world_camera=T @ camera.T_world_camera)
        distance = np.linalg.norm(moved.center_world[:2] - way.mean(axis=0))
        out.append((moved, float(np.median(np.abs(apart - shift)) / distance)))
    return out


def _contradiction(placed: dict[int, Camera], added: int, seen: SeenSilhouettes) -> float:
    """Return the median angle by which a camera contradicts the others on frontier points, rad."""
    at, cameras = [*placed].index(added), [*placed.values()]
    hulls = seen.of_cameras([*placed]).hulls_px
    angles = np.concatenate([plane_angles(hulls, cameras, (i, at)) for i in range(len(cameras)) if i != at])
    known = np.isfinite(angles)
    # Nothing contradicts or confirms a turn if epipoles lie within the silhouettes.
    return float(np.median(np.where(known, angles, np.pi / 2))) if known.any() else np.pi / 2


class _UsualCamera(NamedTuple):
    """Standard deviations of usual cameras. They only begin an adjustment, from 30 degrees and twice the height off."""

    tilt_rad: float = 0.5
    """How far it looks down."""
    roll_rad: float = 0.1
    log_height: float = 0.7
    """Logarithm of its height over the floor in statures."""
    independent: int = 20
    """Number of coordinates of ends of silhouettes that are taken for independent: those of ten steps."""


def cameras_over_floor(upright_px: Array, lenses: Sequence[Camera]) -> tuple[Camera, ...]:
    """Return cameras above the origin of a floor at z = 0, in statures; nothing relates them to each other.

    Args:
        upright_px: crown and feet, (F, V, 2, 2), original pixels; NaN where unknown.
        lenses: the cameras with their lenses.

    Raises:
        CalibrationError: a camera does not show the person upright.
    """
    return tuple(_over_floor(upright_px[:, i], lens) for i, lens in enumerate(lenses))


def on_floor(camera: Camera, feet_px: Array) -> Array:
    """Return where feet, (F, 2), original pixels, stand on the floor, (F, 2); NaN beyond the horizon."""
    rays = camera.rays(feet_px)
    with np.errstate(divide="ignore", invalid="ignore"):
        points = camera.center_world + rays * (camera.center_world[2] / -rays[:, 2:])
        return np.where(rays[:, 2:] < 0, points[:, :2], np.nan)


def _over_floor(upright_px: Array, lens: Camera) -> Camera:
    seen = upright_px[np.isfinite(upright_px).all(axis=(1, 2))]
    if len(seen) < MIN_SHARED:
        raise CalibrationError(
            f"expected the person upright in camera '{lens.name}' on at least {MIN_SHARED} frames, found {len(seen)}; "
            "film the whole person, who also walks upright"
        )
    held = replace(lens, T_world_camera=np.eye(4))
    feet, usual = held.rays(seen[:, 1]), _UsualCamera()
    sigmas_px = UprightRules().end * np.linalg.norm(seen[:, 0] - seen[:, 1], axis=1, keepdims=True)

    def errors(x: Array) -> Array:
        up = _up(x)
        reach = np.exp(x[2]) / np.maximum(-feet @ up, np.finfo(np.float32).eps)
        off = held.project(feet * reach[:, None] + up) - seen[:, 0]
        off = np.where(np.isfinite(off), off, np.linalg.norm(lens.size)) / sigmas_px
        # Gross errors count by their logarithm. Of a person on one place, errors are alike from frame to frame.
        return np.concatenate(
            [np.arcsinh(off).ravel(), max(1.0, np.sqrt(off.size / usual.independent)) * x / usual[:3]]
        )

    starts = product((0.0, usual.tilt_rad), (-usual.log_height, 0.0, usual.log_height))
    best = min((least_squares(errors, (tilt, 0.0, height)) for tilt, height in starts), key=lambda fit: fit.cost)
    up = _up(best.x)
    forward = np.array([0.0, 0.0, 1.0]) - up[2] * up
    forward /= np.linalg.norm(forward)
    turn = np.stack([np.cross(forward, up), forward, up])
    return replace(lens, T_world_camera=rigid.transform(turn, np.array([0.0, 0.0, np.exp(best.x[2])])))


def _up(x: Array) -> Array:
    """Return the vertical in a camera that looks down by an angle and is rolled by another."""
    tilt, roll = x[:2]
    return np.array([np.sin(roll) * np.cos(tilt), -np.cos(roll) * np.cos(tilt), -np.sin(tilt)])
