"""The clothes of a simulated person: colours as a function of the position on the body."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracker.geometry.arrays import Array
from tracker.simulate.people.textures import value_noise

Color = tuple[float, float, float]


@dataclass(frozen=True)
class Outfit:
    """Colours of clothes, skin and hair, red, green, blue from 0 to 1."""

    shirt: Color = (0.17, 0.20, 0.27)
    left_sleeve: Color = (0.87, 0.80, 0.60)
    right_sleeve: Color = (0.80, 0.33, 0.22)
    trousers: Color = (0.40, 0.37, 0.33)
    """Similar to the floor and the racks, as real clothes are, so that subtraction finds no clean silhouette."""
    shoes: Color = (0.16, 0.13, 0.12)
    skin: Color = (0.80, 0.60, 0.48)
    hair: Color = (0.20, 0.13, 0.08)

    def colors(self, bones: NDArray[np.str_], points_bone: Array, points_torso: Array) -> Array:
        """Colour the skin.

        Args:
            bones: name of the bone that each point follows, (n,).
            points_bone: points of the rest pose in the frames of their bones, (n, 3), fraction of body height.
            points_torso: the same points in the torso's frame, (n, 3), fraction of body height.

        Returns:
            Colours, (n, 3), from 0 to 1.
        """
        out = np.empty((len(bones), 3))
        out[:] = self.shirt
        x, y, z = points_bone.T
        in_torso = bones == "torso"
        head, foot = bones == "head", np.char.endswith(bones, "_foot")
        leg = np.char.endswith(bones, "_thigh") | np.char.endswith(bones, "_calf")
        arm = np.char.endswith(bones, "_arm") | np.char.endswith(bones, "_forearm")
        hand = np.char.endswith(bones, "_forearm") & (z < -0.138)
        # The seam runs in a plane from the shoulder to the armpit, independent of the bone that the cloth follows.
        beyond_seam = (np.abs(points_torso[:, 1]) > 0.095) & (points_torso[:, 2] > 0.075)
        sleeve = (arm & ~hand & (np.abs(points_torso[:, 1]) > 0.095)) | (in_torso & beyond_seam)
        collar = in_torso & (z > 0.176) & (np.hypot(x + 0.004, y) < 0.040)
        waist = in_torso & (z < -0.082)
        out[sleeve & (points_torso[:, 1] > 0)] = self.left_sleeve
        out[sleeve & (points_torso[:, 1] < 0)] = self.right_sleeve
        out[leg | waist] = self.trousers
        out[waist & (z > -0.093)] = np.array(self.shoes) * 0.8  # belt
        out[foot] = self.shoes
        out[foot & (z < -0.034)] = (0.55, 0.53, 0.50)  # sole
        out[hand | head | collar] = self.skin
        self._paint_face(out, head, points_bone)
        folds = np.where(leg | arm | in_torso, 0.10, 0.03)
        shade = (
            1.0
            + folds * value_noise(points_bone, np.array([0.03, 0.03, 0.05]))
            + 0.03 * value_noise(points_bone, 0.006)
        )
        return np.clip(out * shade[:, None], 0.0, 1.0)

    def _paint_face(self, out: Array, head: NDArray[np.bool_], points: Array) -> None:
        """Paint hair, eyes, brows and mouth into `out`."""
        x, y, z = points.T
        hairline = np.where(x > 0.0, 0.108 + 0.45 * np.maximum(x - 0.03, 0.0), 0.108 + 1.5 * x)
        out[head & (z > np.maximum(hairline, 0.035))] = self.hair
        front = head & (x > 0.035)
        side = np.abs(np.abs(y) - 0.017)
        out[front & (np.hypot(side, z - 0.088) < 0.0055)] = (0.13, 0.10, 0.09)
        out[front & (side < 0.010) & (np.abs(z - 0.099) < 0.0025)] = self.hair
        out[front & (np.abs(y) < 0.013) & (np.abs(z - 0.053) < 0.0028)] = (0.58, 0.30, 0.27)


_SKIN_OF_HERS: Color = (0.76, 0.55, 0.43)
BLACK_AND_WHITE = Outfit(
    shirt=(0.20, 0.22, 0.26),
    left_sleeve=(0.82, 0.82, 0.80),
    right_sleeve=(0.82, 0.82, 0.80),
    trousers=(0.34, 0.32, 0.30),
)
RED = Outfit(
    shirt=(0.66, 0.14, 0.16),
    left_sleeve=_SKIN_OF_HERS,
    right_sleeve=_SKIN_OF_HERS,
    trousers=(0.22, 0.20, 0.24),
    shoes=(0.55, 0.12, 0.14),
    skin=_SKIN_OF_HERS,
    hair=(0.14, 0.09, 0.06),
)
GREEN = Outfit(
    shirt=(0.30, 0.42, 0.28),
    left_sleeve=(0.30, 0.42, 0.28),
    right_sleeve=(0.30, 0.42, 0.28),
    trousers=(0.52, 0.46, 0.36),
    hair=(0.45, 0.32, 0.18),
)
