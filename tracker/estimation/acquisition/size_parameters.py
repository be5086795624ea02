"""The sizes of a body as a vector of parameters: lengths, girths, shapes, and where flesh and joints lie on a part.

All parameters are 0 for the body that they belong to. Scales are logarithms, so that no size can become negative.

The prior describes how people differ from a body of typical proportions for their height (`typical_body`). Lengths: the
segments of the ANSUR II survey (Gordon et al. 2014) differ from those of people of equal stature by 3 to 5%. Girths:
its breadths and depths differ by 7 to 15%, mostly together (`build`). Places: the centre of a joint is known to 1 to 2
cm from the skin around it (Leardini et al. 1999 for the hip). Shapes: GD96 Sect. 3 lists no ranges; ours are those of
the built-in bodies' parts.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.dimensions import dimensions_of, main_axis, mirror_part, stature_m, with_dimensions
from tracker.body.model import BodyModel
from tracker.estimation.fitting.gauss_newton import JOINT_SHARE
from tracker.formats.model_toml import PRESETS, has_preset_proportions, load_model
from tracker.geometry.arrays import Array

_COUNTS = {"length": 1, "girths": 2, "center": 3, "half": 3, "taper": 2, "exponents": 2, "joint": 3}
"""Numbers of the changes of a part. The logarithm of its length stretches flesh and joints along its main axis, and
those of its girths stretch it across. Shifts of the flesh's centre, of its half-axes and of its own joint on the parent
are fractions of the height."""
_N_COLUMNS = sum(_COUNTS.values())
_LENGTH, _GIRTHS, _CENTER, _HALF, _TAPER, _EXPONENTS, _JOINT = (
    slice(end - count, end) for count, end in zip(_COUNTS.values(), accumulate(_COUNTS.values()), strict=True)
)
"""Their columns."""
DIFFERENCE = 1e-4
"""Step of parameters or unit coordinates by which derivatives are taken as differences: far above rounding and far
below the spread of people. Halved and doubled: those of `gavrila34` change by 2e-5 at most."""
_EXPONENT_LIMITS, _TAPER_LIMIT = (0.15, 1.0), 0.8
"""Limits of shapes: convex, with finite derivatives."""
_LIMB_JOINTS, _LIMB_PARTS = ("shoulder", "elbow", "hip", "knee", "ankle"), ("upper_arm", "forearm", "thigh", "calf")
_OWN_PRIORS = {
    **{f"{joint}.joint_{a}": "limb_joint" for joint in _LIMB_JOINTS for a in "xyz"},
    **{f"{part}.side_{a}": "limb_side" for part in _LIMB_PARTS for a in "xy"},
    "calf.free_end": "sole",
    "foot.free_end": "end",
}
"""Parameters whose standard deviation is not that of their kind."""


_ANATOMICAL = 0.004
"""Standard deviation of a limb's joint as anatomy defines it, fraction of height; see `SizePriors.anatomical`."""


@dataclass(frozen=True)
class SizePriors:
    """Standard deviations of the sizes of people, from a body of typical proportions."""

    height: float = 0.15
    """Of the logarithm of the body's height."""
    build: float = 0.15
    """Of the logarithm of all girths together."""
    length: float = 0.05
    """Of the logarithm of a part's length."""
    girth: float = 0.12
    """Of the logarithm of a part's girth, front to back or side to side."""
    joint: float = JOINT_SHARE
    """Of the place of a joint on its parent along each axis, fraction of height."""
    limb_joint: float = JOINT_SHARE
    """Of the place of a joint of a limb on its parent along each axis, fraction of height."""
    side: float = JOINT_SHARE
    """Of the flesh across a part, fraction of height."""
    limb_side: float = JOINT_SHARE
    """Of the flesh across a part of a limb, fraction of height."""
    end: float = 0.015
    """Of an end of the flesh along a part, fraction of height."""
    free_end: float = 0.05
    """Of an end without a joint: hands and hair belong to the parts before them."""
    sole: float = free_end
    """Of the end of a calf whose foot has no joint, fraction of height."""
    taper: float = 0.10
    """Of a taper."""
    exponent: float = 0.12
    """Of an exponent."""

    def anatomical(self) -> "SizePriors":
        """Return the priors of joints as anatomy defines them, for a person without placed joints.

        Contours hardly show these sizes. Placed joints may have other definitions, so that their offsets are fitted.
        Elbows and knees are the midpoints between the epicondyles (Wu et al. 2002 and 2005), so that flesh lies evenly
        around them. Regressions predict a hip to 6 mm from the pelvic width (Seidel et al. 1995). They predict a
        shoulder to 3 mm from the scapula (Meskers et al. 1998). The height of the lateral malleolus varies by 6 mm
        (ANSUR II). Shoes and plantar flexion add 2 cm.
        """
        return replace(
            self,
            limb_joint=min(_ANATOMICAL, self.limb_joint),
            limb_side=min(_ANATOMICAL, self.limb_side),
            sole=min(self.end, self.sole),
        )


class SizeArrays(NamedTuple):
    """The sizes of a body as arrays, or their derivatives by the parameters, with a last axis of n_sizes."""

    joints: Array
    """Position of each joint in its parent's frame, (n_parts, 3), metres."""
    centers: Array
    """Centre of each shape in its part's frame, (n_parts, 3), metres."""
    half_axes: Array
    """Half-axes of each shape, (n_parts, 3), metres."""
    tapers: Array
    """k_x, k_y of each shape, (n_parts, 2)."""
    exponents: Array
    """e1, e2 of each shape, (n_parts, 2)."""
    landmarks: Array
    """Position of each landmark in its part's frame, (n_landmarks, 3), metres."""


@dataclass(frozen=True, eq=False)
class SizeParameters:
    """The sizes of a body as a vector, (n_sizes,), zero for the body itself."""

    base: BodyModel
    """The body that they belong to."""
    coupled: bool = True
    """Whether left and right have the same sizes, and the middle of the body is symmetric."""
    priors: SizePriors = SizePriors()

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each parameter: `height`, `build`, `forearm.length`; `left_forearm.length` if not coupled."""
        return self._layout[0]

    @cached_property
    def sigmas(self) -> Array:
        """Standard deviation of each parameter in the prior, (n_sizes,)."""
        sideless = [n.removeprefix("left_").removeprefix("right_") for n in self.names]
        return np.array([getattr(self.priors, _OWN_PRIORS.get(n) or kind_of(n)) for n in sideless])

    @cached_property
    def prior(self) -> Array:
        """Rows of the prior, (n_rows, n_sizes): their products with the parameters have a standard deviation of 1.

        A height that somebody has stated is the stature, which lengths change, too. It is fixed: errors of contours are
        alike on all frames, so they would outweigh any word. Its own variance stands for how tightly it is held.
        """
        rows, sigma = np.diag(1 / self.sigmas), self.base.height_sigma
        if sigma is None:
            return rows
        own, grown = stature_m(self.base), [stature_m(self.body(step)) for step in np.diag(self.sigmas)]
        return np.vstack([rows, np.log(np.array(grown) / own) / self.sigmas / sigma**2])

    def of_kinds(self, *kinds: str) -> NDArray[np.bool_]:
        """Return which parameters are of some kinds, the names of `SizePriors`, (n_sizes,)."""
        return np.array([kind_of(n) in kinds for n in self.names])

    def arrays(self, sizes: Array) -> SizeArrays:
        """Return the sizes of the body at a vector of parameters."""
        return self._both(sizes)[0]

    def derivatives(self, sizes: Array) -> SizeArrays:
        """Return the derivatives of the arrays by the parameters."""
        return self._both(sizes)[1]

    def body(self, sizes: Array) -> BodyModel:
        """Return the body at a vector of parameters."""
        found, base = self.arrays(sizes), self.base
        height_m = float(base.height_m * np.exp(sizes[0]))
        places = [[_triple(row) for row in a / height_m] for a in (found.joints, found.centers, found.half_axes)]
        return replace(
            base,
            height_m=height_m,
            joints=tuple(
                replace(j, position=p) if j.parent else j for j, p in zip(base.joints, places[0], strict=True)
            ),
            parts=tuple(
                replace(
                    p, center=c, half_axes=a, taper=(float(t[0]), float(t[1])), exponents=(float(e[0]), float(e[1]))
                )
                for p, c, a, t, e in zip(base.parts, *places[1:], found.tapers, found.exponents, strict=True)
            ),
            landmarks=tuple(
                replace(m, position=_triple(row / height_m))
                for m, row in zip(base.landmarks, found.landmarks, strict=True)
            ),
        )

    def _both(self, sizes: Array) -> tuple[SizeArrays, SizeArrays]:
        """Return the arrays and their derivatives."""
        base, C = self._base, self._layout[1]
        raw = (C @ sizes).reshape(len(self.base.parts), -1)
        C = C.reshape(*raw.shape, -1)
        height = self.base.height_m * np.exp(sizes[0])
        by_height, by_build = np.eye(len(sizes))[:2]
        along, across = self._axes  # (n_parts, 3), and which girth each axis across is

        def scaled(values: Array, logs: Array, logs_by: Array) -> tuple[Array, Array]:
            out = height * values * np.exp(logs)
            return out, out[..., None] * (by_height + logs_by)

        def shifted(
            values: Array, stretch: Array, stretch_by: Array, shift: Array, shift_by: Array
        ) -> tuple[Array, Array]:
            out, out_by = scaled(values, stretch, stretch_by)
            return out + height * shift, out_by + height * (shift_by + shift[..., None] * by_height)

        length, length_by = along * raw[:, _LENGTH], along[..., None] * C[:, _LENGTH]
        girth = np.take_along_axis(raw[:, _GIRTHS], across, axis=1) + sizes[1]
        girth_by = np.take_along_axis(C[:, _GIRTHS], across[..., None], axis=1) + by_build
        stretch = np.where(along, length, girth), np.where(along[..., None], length_by, girth_by)
        parents, carriers = np.array(self.base.parents), [self.base.part_index[m.part] for m in self.base.landmarks]
        found = [
            shifted(base.joints, length[parents], length_by[parents], raw[:, _JOINT], C[:, _JOINT]),
            shifted(base.centers, length, length_by, raw[:, _CENTER], C[:, _CENTER]),
            shifted(base.half_axes, *stretch, raw[:, _HALF], C[:, _HALF]),
            _limited(base.tapers + raw[:, _TAPER], C[:, _TAPER], -_TAPER_LIMIT, _TAPER_LIMIT),
            _limited(base.exponents + raw[:, _EXPONENTS], C[:, _EXPONENTS], *_EXPONENT_LIMITS),
            scaled(base.landmarks, length[carriers], length_by[carriers]),
        ]
        return SizeArrays(*(f[0] for f in found)), SizeArrays(*(f[1] for f in found))

    @cached_property
    def _base(self) -> SizeArrays:
        parts = self.base.parts
        return SizeArrays(
            np.array([j.position for j in self.base.joints]),
            np.array([p.center for p in parts]),
            np.array([p.half_axes for p in parts]),
            np.array([p.taper for p in parts]),
            np.array([p.exponents for p in parts]),
            np.array([m.position for m in self.base.landmarks]).reshape(-1, 3),
        )

    @cached_property
    def _axes(self) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        """Whether each axis of a part is its main one, and else which of the girths it is, (n_parts, 3) each."""
        main = np.array([main_axis(self.base, i) for i in range(len(self.base.parts))])
        along = np.arange(3) == main[:, None]
        return along, np.where(along, 0, np.cumsum(~along, axis=1) - 1)

    @cached_property
    def _layout(self) -> tuple[tuple[str, ...], Array]:
        """Names of the parameters, and the matrix from them to the columns of all parts, (n_parts * 16, n_sizes)."""
        index, entries = {"height": 0, "build": 1}, []
        for i, (part, joint) in enumerate(zip(self.base.parts, self.base.joints, strict=True)):
            effects = [(part.name, name, column, sign) for name, column, sign in self._effects(i)]
            if joint.parent:
                effects += [(joint.name, f"joint_{a}", _JOINT.start + k, 1.0) for k, a in enumerate("xyz")]
            for owner, name, column, sign in effects:
                mirrored = mirror_part(owner) is not None
                if self.coupled and name in ("side_y", "joint_y"):
                    if not mirrored:
                        continue  # the middle of the body is symmetric
                    sign = sign if owner.startswith("left") else -sign
                shared = owner.split("_", 1)[1] if self.coupled and mirrored else owner
                at = index.setdefault(f"{shared}.{name}", len(index))
                entries.append((i * _N_COLUMNS + column, at, sign))
        C = np.zeros((len(self.base.parts) * _N_COLUMNS, len(index)))
        for row, at, sign in entries:
            C[row, at] = sign
        return tuple(index), C

    def _effects(self, i: int) -> list[tuple[str, int, float]]:
        """Return the effects of the parameters of a part's flesh: name, column and factor."""
        part, main = self.base.parts[i], main_axis(self.base, i)
        outward = -1.0 if part.center[main] < 0 else 1.0  # from the joint to the far end
        is_leaf = i not in self.base.parents
        far = "free_end" if is_leaf else "end_far"
        out = [("length", _LENGTH.start, 1.0), ("girth_a", _GIRTHS.start, 1.0), ("girth_b", _GIRTHS.start + 1, 1.0)]
        for name, half in ((far, 0.5), ("end_near", -0.5)):
            out += [(name, _CENTER.start + main, 0.5 * outward), (name, _HALF.start + main, half)]
        out += [(f"side_{a}", _CENTER.start + k, 1.0) for k, a in enumerate("xyz") if k != main]
        if part.kind != "ellipsoid":  # one taper for both axes keeps a solid of revolution
            names = ("taper", "taper") if part.taper[0] == part.taper[1] else ("taper_x", "taper_y")
            out += [(n, _TAPER.start + k, 1.0) for k, n in enumerate(names)]
        if part.kind == "superquadric":
            out.append(("exponent_along", _EXPONENTS.start, 1.0))
            out += [("exponent_around", _EXPONENTS.start + 1, 1.0)] if part.exponents[1] != 1.0 else []
        return out


def kind_of(name: str) -> str:
    """Return the kind of a parameter, a name of `SizePriors`."""
    last = name.rsplit(".", 1)[-1]
    return last if last == "free_end" else last.split("_", 1)[0]


def _limited(values: Array, by: Array, low: float, high: float) -> tuple[Array, Array]:
    """Clip values; clipped ones have no derivative."""
    inside = (values >= low) & (values <= high)
    return np.clip(values, low, high), np.where(inside[..., None], by, 0.0)


def _triple(row: Array) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in row)
    return x, y, z


_LEG_SHARES = ((0.50, 0.348), (1.39, 0.475))
"""Statures, metres, and shares of them that are legs: stature without sitting height. Between newborns (0.50 m; WHO
Child Growth Standards 2006) and the beginning of puberty (1.45 m, 0.483; WHO growth reference 2007) the share rises
linearly, and it reaches that of adults at 1.39 m. Shares are those of the longitudinal study of 332 children in Arch.
Argent. Pediatr. 2013, 111:309: 0.652 of a newborn's length is sitting height, 0.517 at puberty, 0.525 of an adult's."""
_LEGS = ("left_thigh", "right_thigh", "left_calf", "right_calf")


def typical_body(body: BodyModel) -> BodyModel:
    """Return a body of the same preset and stature in typical proportions, whatever the sizes of the body are.

    Below 1.39 m these are a child's: shorter legs, and a head that makes up for them (Snyder et al. 1977). A body of no
    preset stays as it is, because its typical proportions are not known.
    """
    if body.name not in PRESETS:
        return body
    preset = replace(load_model(body.name, body.height_m), height_sigma=body.height_sigma)
    if preset.dof_names != body.dof_names or list(preset.part_index) != list(body.part_index):
        return body
    statures_m, shares = np.transpose(_LEG_SHARES)
    by = float(np.interp(stature_m(preset), statures_m, shares) / shares[-1])
    if by < 1 and {*_LEGS, "head"} <= set(preset.part_index):
        return _with_legs(preset, by)
    return body if has_preset_proportions(body) else preset


def _with_legs(body: BodyModel, by: float) -> BodyModel:
    """Return a body with legs that are longer by a factor, and a head of another size so that the stature stays."""
    with_legs, wanted_m = _scaled(body, {n: by for n in _LEGS}), stature_m(body)
    # The stature grows linearly with the head.
    missing_m = wanted_m - stature_m(with_legs)
    grown_m = stature_m(_scaled(with_legs, {"head": 2.0})) - stature_m(with_legs)
    return _scaled(with_legs, {"head": 1 + missing_m / grown_m})


def _scaled(body: BodyModel, factors: dict[str, float]) -> BodyModel:
    """Return a body with parts that are longer by a factor; the girths of a head change with its length."""
    sizes = dimensions_of(body)
    parts = dict(sizes.parts)
    for name, by in factors.items():
        length_m, (a_m, b_m) = parts[name]
        across = by if name == "head" else 1.0
        parts[name] = parts[name]._replace(length_m=by * length_m, girths_m=(across * a_m, across * b_m))
    return with_dimensions(body, sizes._replace(parts=parts))
