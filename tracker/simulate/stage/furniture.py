"""The furniture of the simulated rooms: textured boxes, most of them along the walls."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np

from tracker.errors import TrackerError
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.simulate.people.textures import value_noise

Vector = tuple[float, float, float]
Pattern = Literal["plain", "planks", "tiles", "checks", "stripes", "books", "speckles", "poster"]

HALF_WIDTH_M = 2.6
"""Half the width of the square room, whose floor's centre is the world's origin."""
HEIGHT_M = 2.8

_STEEL: Vector = (0.55, 0.57, 0.60)
_WOOD: Vector = (0.56, 0.42, 0.29)
_DARK: Vector = (0.15, 0.15, 0.17)


@dataclass(frozen=True)
class Box:
    """A textured box, rotated about the vertical."""

    center: Vector
    """Metres, world."""
    half: Vector
    """Half-widths along the box's own axes, metres."""
    yaw: float
    """Rotation about z, rad."""
    pattern: Pattern
    colors: tuple[Vector, Vector]
    """The pattern's two colours, 0 to 1."""
    size: float = 0.1
    """Size of the pattern's features, metres."""

    def appearance(self, points_world: Array) -> tuple[Array, Array]:
        """Return colours (n, 3), 0 to 1, and outward normals (n, 3) at points of the surface, (n, 3)."""
        R_world_box = rigid.so3_exp(np.array([0.0, 0.0, self.yaw]))
        points = (points_world - self.center) @ R_world_box
        across = np.argmax(np.abs(points) - self.half, axis=1)
        rows = np.arange(len(points))
        normals = np.zeros_like(points)
        normals[rows, across] = np.sign(points[rows, across])
        # Each face is painted in its own two axes, the vertical one second.
        u = np.where(across == 0, points[:, 1], points[:, 0])
        v = np.where(across == 2, points[:, 1], points[:, 2])
        return self._painted(u, v, points_world), normals @ R_world_box.T

    def _painted(self, u: Array, v: Array, points_world: Array) -> Array:
        first, second = (np.array(c) for c in self.colors)
        share = _share(self.pattern, u / self.size, v / self.size)
        grain = 1.0 + 0.05 * value_noise(points_world, 0.25, 4)
        return np.clip((first + share[:, None] * (second - first)) * grain[:, None], 0.0, 1.0)


def furnished(seed: int, room: str) -> tuple[Box, ...]:
    """Furnish a room of a kind.

    Args:
        seed: of its furniture.
        room: one of `ROOMS`.

    Raises:
        TrackerError: there is no such kind.
    """
    if room not in ROOMS:
        raise TrackerError(f"expected one of the rooms {', '.join(ROOMS)}, found '{room}'")
    return tuple(ROOMS[room](np.random.default_rng([seed, 1])))


def _laboratory(rng: np.random.Generator) -> list[Box]:
    """Return racks full of things, wall bars, a desk, scaffold poles and posters. The corners are the cameras'."""
    a = HALF_WIDTH_M
    out = _shell(((0.70, 0.68, 0.63), (0.62, 0.60, 0.56)), ((0.47, 0.43, 0.38), (0.30, 0.27, 0.24)), "planks")
    out += _rack(rng, (-a + 0.22, -0.35), 1.9, 0.0)
    out += _rack(rng, (0.5, -a + 0.22), 2.2, np.pi / 2)
    out += _rack(rng, (a - 0.22, -0.6), 1.5, np.pi)
    out += _wall_bars((-0.3, a - 0.12), 1.9, -np.pi / 2)
    out += _scaffold((-a + 0.5, 1.1), 0.7, 0.0) + _scaffold((-1.1, -a + 0.5), 0.7, np.pi / 2)
    out += _desk(rng, (a - 0.4, 0.9), 1.1)
    return out + _posters(rng)


def _studio(rng: np.random.Generator) -> list[Box]:
    """Return an empty room, gray as clothes are: hardly an edge in it, and little contrast to a person."""
    tone = rng.uniform(0.3, 0.6)
    gray: tuple[Vector, Vector] = ((tone, tone, tone), (tone - 0.08, tone - 0.08, tone - 0.07))
    return _shell(gray, gray, "plain")


def _theater(rng: np.random.Generator) -> list[Box]:
    """Return a dark stage: black curtains in folds along three walls, black boards, and set pieces in front."""
    a = HALF_WIDTH_M
    black: tuple[Vector, Vector] = ((0.10, 0.09, 0.10), (0.17, 0.14, 0.15))
    out = _shell(black, black, "planks")
    for base, yaw in (((-a + 0.08, 0.0), 0.0), ((a - 0.08, 0.0), np.pi), ((0.0, a - 0.08), -np.pi / 2)):
        for y in np.arange(-1.7, 1.8, 0.2):
            place = _placed(base, yaw, rng.uniform(0.0, 0.05), float(y), 1.3)
            out.append(Box(place, (0.03, 0.075, 1.3), yaw + rng.uniform(-0.4, 0.4), "plain", black, 0.1))
    for side in (-1.0, 1.0):
        half = (rng.uniform(0.1, 0.2), rng.uniform(0.2, 0.4), rng.uniform(0.4, 0.9))
        where = (side * (a - 0.45), rng.uniform(-0.9, 0.9), half[2])
        out.append(Box(where, half, rng.uniform(-0.5, 0.5), "checks", (_color(rng), _color(rng)), 0.12))
    return out + _posters(rng)


def _share(pattern: Pattern, u: Array, v: Array) -> Array:
    """Return the share of the second colour at each point of a face, 0 to 1; u and v count features."""
    noise = value_noise(np.stack([u, v, np.zeros_like(u)], axis=-1), 1.0)
    if pattern == "planks":
        joint = (np.abs(v - np.round(v)) < 0.03) | ((u / 6.0 + 0.37 * np.floor(v)) % 1.0 < 0.01)
        tone = value_noise(np.stack([u / 5.0, np.floor(v) * 3.7, np.zeros_like(u)], axis=-1), 1.0, 1)
        return np.clip(0.3 + 0.25 * tone + 0.1 * noise + 0.5 * joint, 0.0, 1.0)
    if pattern == "tiles":
        joint = (np.abs(u - np.round(u)) < 0.025) | (np.abs(v - np.round(v)) < 0.025)
        return np.where(joint, 1.0, np.clip(0.15 + 0.15 * noise, 0.0, 1.0))
    if pattern == "checks":
        return np.asarray((np.floor(u) + np.floor(v)) % 2)
    if pattern == "stripes":
        return np.asarray(np.floor(v) % 2)
    if pattern == "books":
        return np.asarray((np.floor(u) * 0.618 + 0.13 * np.floor(u) ** 2) % 1.0)
    if pattern == "speckles":
        return np.asarray(noise > 0.25, dtype=np.float64)
    if pattern == "poster":
        return np.clip(0.5 + 1.2 * noise, 0.0, 1.0)
    return np.clip(0.1 + 0.1 * noise, 0.0, 1.0)


def _shell(wall: tuple[Vector, Vector], floor: tuple[Vector, Vector], boards: Pattern) -> list[Box]:
    """Return floor, ceiling, walls and skirting boards."""
    a, h = HALF_WIDTH_M, HEIGHT_M
    out = [
        Box((0, 0, -0.1), (a + 0.2, a + 0.2, 0.1), 0.0, boards, floor, 0.16),
        Box((0, 0, h + 0.1), (a + 0.2, a + 0.2, 0.1), 0.0, "tiles", ((0.85, 0.85, 0.83), (0.7, 0.7, 0.7)), 0.6),
    ]
    for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        thin = (0.1 if x else a + 0.2, 0.1 if y else a + 0.2, h / 2)
        out.append(Box((x * (a + 0.1), y * (a + 0.1), h / 2), thin, 0.0, "plain", wall, 0.8))
        skirting = (0.012 if x else a, 0.012 if y else a, 0.05)
        out.append(Box((x * (a - 0.012), y * (a - 0.012), 0.05), skirting, 0.0, "plain", (_WOOD, _DARK), 0.3))
    return out


def _placed(base: tuple[float, float], yaw: float, x: float, y: float, z: float) -> Vector:
    """Return the world position of a point given in a piece's own frame: x out of the wall, y along it."""
    c, s = np.cos(yaw), np.sin(yaw)
    return (float(base[0] + c * x - s * y), float(base[1] + s * x + c * y), z)


def _rack(rng: np.random.Generator, base: tuple[float, float], width: float, yaw: float) -> list[Box]:
    """Return a steel rack of four shelves with things on them."""
    depth, top = 0.19, 2.0
    steel = (_STEEL, _DARK)
    out = []
    for x in (-depth, depth):
        for y in np.linspace(-width / 2, width / 2, 3):
            place = _placed(base, yaw, x, float(y), top / 2)
            out.append(Box(place, (0.018, 0.018, top / 2), yaw, "stripes", steel, 0.05))
    for z in (0.12, 0.62, 1.12, 1.62):
        out.append(Box(_placed(base, yaw, 0, 0, z), (depth, width / 2, 0.015), yaw, "plain", steel))
        y = -width / 2 + 0.06
        while y < width / 2 - 0.2:
            half = (rng.uniform(0.08, 0.16), rng.uniform(0.05, 0.17), rng.uniform(0.07, 0.21))
            pattern: Pattern = rng.choice(["checks", "stripes", "books", "speckles", "poster", "plain"])
            place = _placed(base, yaw, rng.uniform(-0.03, 0.03), y + half[1], z + 0.015 + half[2])
            out.append(Box(place, half, yaw, pattern, (_color(rng), _color(rng)), rng.uniform(0.025, 0.07)))
            y += 2 * half[1] + rng.uniform(0.01, 0.12)
    return out


def _color(rng: np.random.Generator) -> Vector:
    """Return a random colour, muted as things in a laboratory are."""
    gray, hue = rng.uniform(0.12, 0.8), rng.normal(0.0, 0.07, 3)
    r, g, b = np.clip(gray + hue, 0.03, 0.95)
    return float(r), float(g), float(b)


def _wall_bars(base: tuple[float, float], width: float, yaw: float) -> list[Box]:
    """Return a ladder of round bars as gymnasiums have them."""
    wood = (_WOOD, (0.45, 0.33, 0.22))
    out = [
        Box(_placed(base, yaw, 0, y, 1.2), (0.05, 0.025, 1.2), yaw, "plain", wood) for y in (-width / 2, 0.0, width / 2)
    ]
    for z in np.arange(0.2, 2.35, 0.17):
        out.append(Box(_placed(base, yaw, 0.03, 0, float(z)), (0.017, width / 2, 0.017), yaw, "plain", wood))
    return out


def _scaffold(base: tuple[float, float], width: float, yaw: float) -> list[Box]:
    """Return poles with cross-bars, painted in bands."""
    paint: tuple[Vector, Vector] = ((0.78, 0.72, 0.25), _DARK)
    out = [
        Box(_placed(base, yaw, 0, y, 1.15), (0.022, 0.022, 1.15), yaw + 0.3, "stripes", paint, 0.23)
        for y in (-width / 2, width / 2)
    ]
    for z in (0.45, 1.25, 2.05):
        bar = (0.018, width / 2 + 0.08, 0.018)
        out.append(Box(_placed(base, yaw, 0.03, 0, z), bar, yaw, "plain", (_STEEL, _DARK)))
    return out


def _desk(rng: np.random.Generator, base: tuple[float, float], width: float) -> list[Box]:
    """Return a desk with a monitor and papers, and a chair before it."""
    x, y = base
    wood = (_WOOD, _DARK)
    out = [Box((x, y, 0.73), (0.33, width / 2, 0.018), 0.0, "plain", wood)]
    for side in (-1, 1):
        out.append(Box((x, y + side * (width / 2 - 0.04), 0.36), (0.30, 0.02, 0.36), 0.0, "plain", wood))
    out.append(
        Box((x + 0.15, y, 1.05), (0.02, 0.27, 0.17), 0.1, "poster", ((0.10, 0.13, 0.20), (0.35, 0.5, 0.6)), 0.05)
    )
    out.append(Box((x + 0.17, y, 0.82), (0.03, 0.05, 0.08), 0.0, "plain", (_DARK, _DARK)))
    for _ in range(4):
        place = (x + rng.uniform(-0.2, 0.1), y + rng.uniform(-0.5, 0.5), 0.76)
        paper: tuple[Vector, Vector] = ((0.85, 0.84, 0.80), _color(rng))
        out.append(Box(place, (0.10, 0.14, 0.015), rng.uniform(-1, 1), "stripes", paper, 0.02))
    chair = (_color(rng), _DARK)
    out.append(Box((x - 0.38, y + 0.1, 0.45), (0.20, 0.20, 0.03), 0.4, "plain", chair))
    out.append(Box((x - 0.56, y + 0.02, 0.75), (0.02, 0.19, 0.20), 0.4, "checks", chair, 0.05))
    out.append(Box((x - 0.38, y + 0.1, 0.22), (0.03, 0.03, 0.21), 0.4, "plain", (_STEEL, _DARK)))
    return out


def _posters(rng: np.random.Generator) -> list[Box]:
    """Return pictures and notices on the walls."""
    a = HALF_WIDTH_M
    out = []
    for y in (-1.9, -0.9, 0.75, 1.8):
        for x in (-a, a):
            half = (0.006, rng.uniform(0.18, 0.32), rng.uniform(0.2, 0.3))
            pattern: Pattern = rng.choice(["poster", "checks", "speckles"])
            where = (x, y + rng.uniform(-0.1, 0.1), rng.uniform(1.4, 2.3))
            out.append(Box(where, half, 0.0, pattern, (_color(rng), _color(rng)), rng.uniform(0.04, 0.1)))
    for x in (-2.1, 1.3, 2.0):
        half = (rng.uniform(0.2, 0.35), 0.006, rng.uniform(0.2, 0.35))
        out.append(Box((x, a, 1.5), half, 0.0, "poster", (_color(rng), _color(rng)), 0.08))
    return out


ROOMS: Mapping[str, Callable[[np.random.Generator], list[Box]]] = MappingProxyType(
    {"laboratory": _laboratory, "studio": _studio, "theater": _theater}
)
"""Kinds of rooms: full of things, empty and gray, and dark."""
