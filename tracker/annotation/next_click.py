"""Propose the frame, limb and view where a person's action lowers the expected error of a recording most.

An action corrects one limb on one frame, by its joints in two views. There its error becomes that of the hand. Errors
persist (`expected_error`): on a frame k frames away the action lowers the variance by the share r^(2k), with the
persistence r of the recording, up to the nearest keyframe on either side. The gain is the sum over these frames. An
action gains nothing where the expected error is below that of the hand.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from tracker.annotation.expected_error import expected_errors, mean_errors
from tracker.body.limbs import limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.errors import SessionError, TrackerError
from tracker.evidence.contours import occluding_contours
from tracker.evidence.images.working_view import working_scale
from tracker.geometry.arrays import TINY, Array, IntArray
from tracker.geometry.cameras import Camera
from tracker.session.session import Session
from tracker.session.store.stored_poses import StoredPose


@dataclass(frozen=True)
class HandSettings:
    """Expectations of a person who corrects a limb."""

    sigma_px: float = 3.0
    """Standard deviation of a placed joint along each axis of a view, px of the footage: that of the scripted user of
    `tests/support`."""
    reach_m: float = 1.0
    """Standard deviation of a joint that is placed in no view, metres: any pose of the limb."""
    carried: float = 0.01
    """Smallest share of an action's effect on a neighbouring frame that is counted."""
    tolerance: float = 0.2
    """With nobody lost, no action pays once the expected error is within this share of the best achievable one."""


class Click(NamedTuple):
    """An action that is proposed."""

    frame: int
    person: int
    """Index of the person."""
    limb: str
    """For display: "right arm"; or "trunk", for shoulders and hips."""
    views: tuple[str, ...]
    """The views in which the limb is to be corrected, the one that shows it best first."""
    gain_mm: float
    """By how much it lowers the expected error of the recording, mm."""
    frames: tuple[int, int]
    """First and last frame on which it has at least half of its effect."""
    now_mm: float
    """Expected error of the limb's joints on the frame, mm."""
    after_mm: float
    """The same after the action."""
    lost: float
    """Probability that the limb is lost there."""

    @property
    def reason(self) -> str:
        """The proposal in words."""
        first, last = self.frames
        where = f"frame {first}" if first == last else f"frames {first} to {last}"
        odds = f", {100 * self.lost:.0f}% chance that it is lost" if self.lost >= 0.5 else ""
        error = f"{self.now_mm:.0f} mm expected, {self.after_mm:.0f} mm after the correction"
        return f"{self.limb}, {where}, seen best in {self.views[0]}: {error}{odds}"


class Proposals(NamedTuple):
    """The best next actions, and what is known of the recording."""

    clicks: tuple[Click, ...]
    """Each gains most after those before it; empty where none pays."""
    error_mm: float
    """Expected mean error over the limb joints of all people and frames, mm."""
    interval_mm: tuple[float, float]
    """90% interval of that mean, mm."""
    best_mm: float
    """Expected error if every limb were corrected on every frame where that pays, mm."""


def propose(
    session: Session,
    poses: Sequence[Mapping[int, StoredPose]],
    n: int = 1,
    hand: HandSettings | None = None,
    contradicted: Sequence[Collection[int]] = (),
) -> Proposals:
    """Propose the next actions. Reads no picture.

    Args:
        session: gives people and cameras.
        poses: of each person by frame.
        n: largest number of proposals.
        hand: what is expected of the person who acts.
        contradicted: for each person the keyframes that an assessment contradicts; none by default. The other ones are
            as good as a hand.

    Raises:
        SessionError: nobody has a pose.
    """
    hand = hand or HandSettings()
    cameras = [s.camera.pinhole for s in session.cameras]
    working = [c.scaled(working_scale(s.camera)) for c, s in zip(cameras, session.cameras, strict=True)]
    doubted = contradicted or [()] * len(poses)
    people = {i: _Person(session.people[i].model, own, doubted[i], cameras, hand) for i, own in enumerate(poses) if own}
    if not people:
        raise SessionError("expected poses to improve, found none; place the body and track first")
    total = sum(p.errors.errors_m.size for p in people.values())
    error_mm = 1000 * sum(p.errors.errors_m.sum() for p in people.values()) / total
    best_mm = 1000 * sum(p.best_m.sum() for p in people.values()) / total
    variance = sum(p.errors.mean_variance * (p.errors.errors_m.size / total) ** 2 for p in people.values())
    half_mm = 1000 * 1.645 * float(np.sqrt(variance))
    clicks, now_mm = list[Click](), error_mm
    while len(clicks) < n and (
        now_mm > (1 + hand.tolerance) * best_mm or any(p.errors.is_lost.any() for p in people.values())
    ):
        click = _best(people, poses, working, total)
        if click is None:
            break
        clicks.append(click)
        now_mm -= click.gain_mm
    return Proposals(tuple(clicks), float(error_mm), (max(0.0, float(error_mm) - half_mm), float(error_mm) + half_mm),
                     float(best_mm))  # fmt: skip


def _best(
    people: Mapping[int, "_Person"], poses: Sequence[Mapping[int, StoredPose]], cameras: Sequence[Camera], total: int
) -> Click | None:
    """Return the best action, and count its effect; None if none gains anything.

    Gains without occlusion are upper bounds: the best one is looked at with occlusion until it stays the best.
    """
    while True:
        i = max(people, key=lambda i: float(people[i].gains_m.max()))
        person = people[i]
        t, unit = (int(x) for x in np.unravel_index(int(person.gains_m.argmax()), person.gains_m.shape))
        if person.gains_m[t, unit] <= 0:
            return None
        frame = int(person.errors.frames[t])
        if t not in person.looked_at:
            others = [of_one[frame].body for k, of_one in enumerate(poses) if k != i and frame in of_one]
            person.look_at(t, [poses[i][frame].body, *others], cameras)
            continue
        views, gain_mm = person.views_of(t, unit), 1000 * float(person.gains_m[t, unit]) / total
        at = person.errors.unit_of == unit
        now_mm, lost = 1000 * float(person.errors.errors_m[t, at].mean()), float(person.errors.lost[t, at].max())
        frames = person.take(t, unit)
        return Click(
            frame, i, person.errors.units[unit], tuple(cameras[v].name for v in views), gain_mm, frames, now_mm,
            1000 * float(person.errors.errors_m[t, at].mean()), lost,
        )  # fmt: skip


class _Person:
    """Expected errors of one person, and the gain of an action on each frame and limb."""

    def __init__(
        self,
        model: BodyModel,
        poses: Mapping[int, StoredPose],
        contradicted: Collection[int],
        cameras: Sequence[Camera],
        hand: HandSettings,
    ) -> None:
        self.errors = expected_errors(model, poses, contradicted)
        if not len(self.errors.frames):
            raise TrackerError("expected poses of the present body, found those of another; track again")
        self._model, self._hand = model, hand
        n_frames, n_joints = self.errors.lost.shape
        points = self.errors.points_world.reshape(-1, 3)
        self._information = np.empty((len(cameras), n_frames, n_joints, 3, 3))
        for v, camera in enumerate(cameras):
            px, J = camera.project_with_jacobian(points)
            inside = np.all((px >= 0) & (px <= np.array(camera.size) - 1), axis=1) & (camera.depths(points) > 0)
            information = np.einsum("nki,nkj->nij", J, J) * inside[:, None, None] / hand.sigma_px**2
            self._information[v] = information.reshape(n_frames, n_joints, 3, 3)
        self._pairs = [*combinations(range(len(cameras)), min(2, len(cameras)))]
        by_hand = self._by_hand(slice(None))
        self._variances = np.empty((n_frames, n_joints))  # of a joint that is corrected, in the best views of its unit
        self._pair_of = np.empty((n_frames, len(self.errors.units)), dtype=np.int64)
        self._choose(slice(None), by_hand)
        by_hand_only = self.errors.keyframes & ~np.isin(self.errors.frames, [*contradicted])
        covariances = self.errors.covariances.copy()
        covariances[by_hand_only] = self._variances[by_hand_only][..., None, None] * np.eye(3)
        self.errors = replace(self.errors, covariances=covariances)
        self._persistence = self.errors.persistence  # of what is stored, whatever actions are counted
        self.looked_at = set[int]()
        """Indices of the frames whose occlusion is known."""
        self.gains_m = np.zeros((n_frames, len(self.errors.units)))
        """Sum of the errors of all joints and frames that an action lowers, (T, n_units), metres."""
        self._update(range(n_frames))

    @property
    def best_m(self) -> Array:
        """Expected errors if every joint is corrected where that pays, (T, J), metres."""
        errors = self.errors
        return np.minimum(errors.errors_m, mean_errors(np.minimum(errors.variances, self._variances), 0.0))

    def views_of(self, t: int, unit: int) -> list[int]:
        """Return the views in which a limb is to be corrected, the best one first."""
        at = self.errors.unit_of == unit
        strength = [float(np.trace(self._information[v, t, at], axis1=1, axis2=2).sum()) for v in self._pair(t, unit)]
        return [v for _, v in sorted(zip(strength, self._pair(t, unit), strict=True), key=lambda x: -x[0])]

    def look_at(self, t: int, bodies: Sequence[PosedBody], cameras: Sequence[Camera]) -> None:
        """Take into account on a frame that views hide limbs: a view counts by the share of a limb that it shows.

        Args:
            t: index of the frame.
            bodies: all people on it, the person first.
            cameras: the views, in working pixels.
        """
        self.looked_at.add(t)
        shown = np.array([_shown(bodies, self._model, c) for c in cameras])  # (V, n_parts)
        for u in range(len(self.errors.units)):
            at, parts = self.errors.unit_of == u, self._parts(u)
            self._information[:, t, at] *= shown[:, parts].mean(axis=1)[:, None, None, None]
        before = self._variances[t].copy()
        self._choose(slice(t, t + 1), self._by_hand(slice(t, t + 1)))
        self._variances[t] = np.maximum(before, self._variances[t])
        self._update(range(t, t + 1))

    def take(self, t: int, unit: int) -> tuple[int, int]:
        """Count the effect of an action; return the first and last frame on which it has half of its effect."""
        variances, lost = self.errors.variances.copy(), self.errors.lost.copy()
        at = self.errors.unit_of == unit
        before_m, (to, share) = self.errors.errors_m[:, at].sum(axis=1), self._carried(t)
        variances[to, at], lost[to, at] = self._after(t, to, share, at)
        scale = variances / self.errors.variances
        keyframes = self.errors.keyframes.copy()
        keyframes[t] = True
        self.errors = replace(
            self.errors, covariances=self.errors.covariances * scale[..., None, None], lost=lost, keyframes=keyframes
        )
        effect = before_m - self.errors.errors_m[:, at].sum(axis=1)
        first = last = t
        while first > to.start and effect[first - 1] >= effect[t] / 2:
            first -= 1
        while last + 1 < to.stop and effect[last + 1] >= effect[t] / 2:
            last += 1
        self._update(range(len(effect)))  # the frame is a keyframe now, up to which others carry
        return int(self.errors.frames[first]), int(self.errors.frames[last])

    def _by_hand(self, some: slice) -> Array:
        """Return the variance of each joint that is placed in each pair of views, (n_pairs, T, J), m^2."""
        prior = np.eye(3) / self._hand.reach_m**2
        information = [sum(self._information[v, some] for v in pair) + prior for pair in self._pairs]
        return np.array([np.trace(np.linalg.inv(i), axis1=-2, axis2=-1) / 3 for i in information])

    def _choose(self, some: slice, by_hand: Array) -> None:
        """Choose the pair of views of each unit on some frames."""
        for u in range(len(self.errors.units)):
            at = self.errors.unit_of == u
            chosen = by_hand[:, :, at].sum(axis=2).argmin(axis=0)
            self._pair_of[some, u] = chosen
            self._variances[some, at] = np.take_along_axis(by_hand[:, :, at], chosen[None, :, None], axis=0)[0]

    def _pair(self, t: int, unit: int) -> tuple[int, ...]:
        return self._pairs[int(self._pair_of[t, unit])]

    def _parts(self, unit: int) -> IntArray:
        """Return the indices of the parts of a unit."""
        at = [self._model.point_names.index(n) for n, u in zip(self.errors.joints, self.errors.unit_of, strict=True)
              if u == unit]  # fmt: skip
        parts = {int(p) for p in self._model.proximal_parts[at]}
        whole = [x.parts for x in limbs(self._model) if parts & {*x.parts.tolist()}]
        return np.unique(np.concatenate(whole)) if whole else np.array(sorted(parts))

    def _carried(self, t: int) -> tuple[slice, Array]:
        """Return the frames to which an action is carried, within the keyframes around it, and its share on each."""
        r, keyframes = self._persistence, np.flatnonzero(self.errors.keyframes)
        longest = int(np.log(self._hand.carried) / (2 * np.log(r))) if r > 0 else 0
        before, after = keyframes[keyframes < t], keyframes[keyframes > t]
        first = max(t - longest, int(before[-1]) + 1 if len(before) else 0)
        stop = min(t + longest + 1, int(after[0]) if len(after) else len(self.errors.frames))
        to = slice(first, stop)
        return to, r ** (2.0 * np.abs(self.errors.frames[to] - self.errors.frames[t]))

    def _after(self, t: int, to: slice, share: Array, at: Array) -> tuple[Array, Array]:
        """Return variances and odds of loss on frames to which an action is carried, (n, n_joints) each."""
        variances, lost, w = self.errors.variances[to][:, at], self.errors.lost[to][:, at], share[:, None]
        better = np.minimum(self._variances[t, at], variances)
        return (1 - w) * variances + w * better, (1 - w) * lost

    def _update(self, frames: range) -> None:
        """Compute the gains of actions on some frames.

        Where an action does not help its own frame, as where it was done already, it helps no other.
        """
        helps_m = self.errors.errors_m - mean_errors(np.minimum(self._variances, self.errors.variances), 0.0)
        for u in range(len(self.errors.units)):
            at = self.errors.unit_of == u
            for t in frames:
                self.gains_m[t, u] = 0.0
                if helps_m[t, at].sum() > TINY:  # rounding
                    to, share = self._carried(t)
                    left = mean_errors(*self._after(t, to, share, at))
                    self.gains_m[t, u] = np.maximum(self.errors.errors_m[to][:, at] - left, 0).sum()


def _shown(bodies: Sequence[PosedBody], model: BodyModel, camera: Camera) -> Array:
    """Return the share of the contour of each part of the first body that a view shows, (n_parts,)."""
    seen, n = occluding_contours.trace(bodies, camera), len(model.parts)
    ends = seen.pieces_px.astype(np.float64).reshape(-1, 2, 2)
    lengths, middles = np.linalg.norm(np.diff(ends, axis=1)[:, 0], axis=1), ends.mean(axis=1)
    inside = np.all((middles >= 0) & (middles <= np.array(camera.size) - 1), axis=1)
    is_of_body = seen.parts < n
    shown = np.bincount(seen.parts[is_of_body], (lengths * (~seen.occluded & inside))[is_of_body], n)
    return np.asarray(shown / np.maximum(np.bincount(seen.parts[is_of_body], lengths[is_of_body], n), TINY))
