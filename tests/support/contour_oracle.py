"""Matching of contours and edges with plain numpy: the oracle of `tracker.estimation.fitting.contour_residuals`.

Matches are made once, at one pose. At another pose the matched surface points have moved with their parts, and
everything else is the same, so that the cost can be differentiated numerically. Only the pieces of contour come from
the tracker.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tracker.evidence.contours import occluding_contours
from tracker.evidence.view_evidence import SCENE_SPACING_PX


class Matches(NamedTuple):
    """Matched pieces of one view and one direction, frozen."""

    view: object
    parts: np.ndarray
    """Part of each, of the person's own, (N,)."""
    points_part: np.ndarray
    """Surface point in the frame of its part, (N, 3)."""
    at_px: np.ndarray
    """Matched point of the piece, (N, 2): its middle, or the point nearest to an edge point."""
    before_px: np.ndarray
    """Image of the surface point, (N, 2)."""
    normals: np.ndarray
    """Of the piece, (N, 2)."""
    edges_px: np.ndarray | None
    """The edge point of each, (N, 2); None where the distance image is read."""
    turns: np.ndarray
    """Squared distance that the turn between edge and piece adds, (N,)."""
    weights: np.ndarray
    """Information, (N,), 1/px^2."""


def without_ties(views, bodies, settings, theta_px):
    """Return the views without the edge points whose nearest piece depends on rounding."""
    out = []
    for view in views:
        seen = occluding_contours.trace(bodies, view.camera)
        squared = np.sort(squared_distances(view, seen.pieces_px[~seen.occluded].astype(float), settings, theta_px)[0])
        clear = squared[:, 1] - squared[:, 0] > 1e-3 if squared.shape[1] > 1 else np.ones(len(squared), bool)
        out.append(replace(view, points_px=view.points_px[clear], normals=view.normals[clear]))
    return out


def squared_distances(view, pieces_px, settings, theta_px):
    """From each edge point to each piece, with the turn between them, (n, k); the feet (n, k, 2); the turns (n, k)."""
    ends, u = pieces_px.reshape(-1, 2, 2), view.points_px.astype(float)
    steps = ends[:, 1] - ends[:, 0]
    lengths = np.linalg.norm(steps, axis=1)
    normals = np.stack([-steps[:, 1], steps[:, 0]], axis=1) / lengths[:, None]
    t = np.einsum("nkc,kc->nk", u[:, None] - ends[:, 0], steps) / lengths**2
    feet = ends[:, 0] + np.clip(t, 0, 1)[..., None] * steps
    turns = settings.turn * theta_px**2 * (1 - (view.normals.astype(float) @ normals.T) ** 2)
    return np.sum((feet - u[:, None]) ** 2, axis=2) + turns, feet, turns


class MatchOracle:
    """Frozen matches of one person at a pose. Views without edges have none."""

    def __init__(self, views, bodies, person, settings, theta_px):
        self.model, self.theta, self.s2 = bodies[person].model, theta_px, (settings.scale * theta_px) ** 2
        self.flat = 0.0  # the cost of edge points that are matched to nothing of this person
        self.matches = []
        T = self.model.kinematics(bodies[person].values).Ts_world_part
        first = sum(len(b.model.parts) for b in bodies[:person])
        for view in views:
            if not len(view.points_px):
                continue
            seen = occluding_contours.trace(bodies, view.camera)
            seen = occluding_contours.Contour(*(a[~seen.occluded].astype(float) for a in seen))
            own = (seen.parts >= first) & (seen.parts < first + len(T))
            ends = seen.pieces_px.reshape(-1, 2, 2)
            steps = ends[:, 1] - ends[:, 0]
            lengths = np.linalg.norm(steps, axis=1)
            normals = np.stack([-steps[:, 1], steps[:, 0]], axis=1) / lengths[:, None]
            parts = (seen.parts - first).astype(int)

            def frozen(pieces, at, edges, turns, weights, view=view, seen=seen, parts=parts, normals=normals):
                world, p = seen.points_world[pieces], parts[pieces]
                local = np.einsum("nji,nj->ni", T[p, :3, :3], world - T[p, :3, 3])
                before = view.camera.project(world)
                self.matches.append(Matches(view, p, local, at, before, normals[pieces], edges, turns, weights))

            middles = ends.mean(axis=1)
            inside = own & np.all((middles >= 0) & (middles <= np.array(view.camera.size) - 1), axis=1)
            information = settings.information_per_px
            if settings.model_to_image:
                w = information * settings.model_to_image * lengths[inside]
                frozen(np.flatnonzero(inside), middles[inside], None, np.zeros(len(w)), w)
            if settings.image_to_model:
                w = information * settings.image_to_model * SCENE_SPACING_PX
                squared, feet, turns = squared_distances(view, seen.pieces_px, settings, theta_px)
                u = view.points_px.astype(float)
                k, i = squared.argmin(axis=1), np.arange(len(u))
                matched = (squared[i, k] < theta_px**2) & own[k]
                rest = np.minimum(squared[i, k][~matched], theta_px**2)
                self.flat += np.sum(0.5 * w * self.s2 * rest / (self.s2 + rest))
                k, i = k[matched], i[matched]
                frozen(k, feet[i, k], u[i], turns[i, k], np.full(len(k), w))

    def cost(self, values):
        """Return the cost of the matches at a pose."""
        total = self.flat
        for m in self.matches:
            squared = np.minimum(self._distances(m, values) ** 2 + m.turns, self.theta**2)
            total += np.sum(0.5 * m.weights * self.s2 * squared / (self.s2 + squared))
        return total

    def rows(self, values, h=1e-6):
        """Weighted residuals (N,) and their numeric derivative (N, n_dofs), at the pose of the matches."""
        residuals, J = [], []
        steps = h * np.eye(self.model.n_dofs)
        for m in self.matches:
            d = self._distances(m, values)
            f = self.s2 / (self.s2 + d**2 + m.turns)
            weights = np.sqrt(m.weights) * f * (d**2 + m.turns < self.theta**2)
            toward = self._toward(m, d)
            moved = [
                self._at(m, self.model.retract(values, s)) - self._at(m, self.model.retract(values, -s)) for s in steps
            ]
            J.append(weights[:, None] * np.einsum("ni,kni->nk", toward, np.array(moved)) / (2 * h))
            residuals.append(weights * d)
        return np.concatenate(residuals), np.concatenate(J)

    def _at(self, m, values):
        """Return the matched points of the pieces at another pose, (N, 2), px."""
        T = self.model.kinematics(values).Ts_world_part[m.parts]
        world = np.einsum("nij,nj->ni", T[:, :3, :3], m.points_part) + T[:, :3, 3]
        moved = m.view.camera.project(world) - m.before_px
        if m.edges_px is None:  # along itself a contour does not move
            moved = np.sum(moved * m.normals, axis=1)[:, None] * m.normals
        return m.at_px + moved

    def _distances(self, m, values):
        at = self._at(m, values)
        return np.linalg.norm(at - m.edges_px, axis=1) if m.edges_px is not None else bilinear(m.view.distance, at)[0]

    def _toward(self, m, d):
        """Direction in the image in which each distance grows, (N, 2)."""
        if m.edges_px is None:
            slope = bilinear(m.view.distance, m.at_px)[1]
            return np.sum(slope * m.normals, axis=1)[:, None] * m.normals
        return np.where(d[:, None] < 1e-3, m.normals, (m.at_px - m.edges_px) / np.maximum(d, 1e-3)[:, None])


def bilinear(image, at):
    """Return value (N,) and slope (N, 2) of an image at points u, v; KRH08 Sect. 5.3, corrected."""
    c = np.minimum(at.astype(int), np.array(image.shape[::-1]) - 2)
    (a, b), (u, v) = (at - c).T, c.T
    d00, d01, d10, d11 = (image[v + j, u + i].astype(float) for j in (0, 1) for i in (0, 1))
    value = (1 - b) * ((1 - a) * d00 + a * d01) + b * ((1 - a) * d10 + a * d11)
    return value, np.stack([(1 - b) * (d01 - d00) + b * (d11 - d10), (1 - a) * (d10 - d00) + a * (d11 - d01)], axis=1)
