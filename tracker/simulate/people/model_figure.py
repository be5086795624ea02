"""Film the fitted body model itself, by its part shapes, for recordings without shape mismatch."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tracker.body.model import BodyModel
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray


@dataclass(frozen=True, eq=False)
class ModelFigure:
    """A body model drawn with the shapes and colours of its own parts."""

    model: BodyModel

    @cached_property
    def _meshes(self) -> tuple[list[Array], IntArray]:
        """Vertices of each part in its frame, and the triangles over all of them."""
        vertices, faces, first = [], [], 0
        for shape, center in zip(self.model.shapes, self.model.centers_part, strict=True):
            own, corners = shape.triangles()
            vertices.append(own + center)
            faces.append(corners + first)
            first += len(own)
        return vertices, np.concatenate(faces)

    @property
    def faces(self) -> IntArray:
        """Triangles, counter-clockwise seen from outside, (M, 3)."""
        return self._meshes[1]

    def posed(self, values: Array) -> Array:
        """Return the vertices in a pose, (N, 3), metres, world."""
        Ts = self.model.kinematics(values).Ts_world_part
        return np.concatenate([rigid.apply(T, v) for T, v in zip(Ts, self._meshes[0], strict=True)])

    def colors(self, faces: IntArray, corner_weights: Array) -> Array:
        """Return the colours of the parts, (n, 3), 0 to 1, at points on triangles `(n,)`."""
        part_colors = [[int(p.color[i : i + 2], 16) / 255 for i in (1, 3, 5)] for p in self.model.parts]
        part_of_vertex = np.repeat(np.arange(len(self._meshes[0])), [len(v) for v in self._meshes[0]])
        return np.array(part_colors)[part_of_vertex[self.faces[faces, 0]]]
