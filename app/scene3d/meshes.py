"""Meshes of the people in viser's 3-D scene."""

from collections.abc import Sequence

import numpy as np
import viser

from app.drawing.facing import nose
from app.drawing.joint_handles import Side, side_of
from app.drawing.overlay_colors import rgb
from app.state.view_3d import View3d
from tracker.body.model import BodyModel, PosedBody
from tracker.evidence.contours.occluding_contours import part_poses
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray
from tracker.session.session import Person

_DIMMED = 0.2
"""Opacity of dimmed people, as a share of that of the others."""
_LIGHTER, _DARKER = 0.45, 0.5
"""How far left limbs are lightened towards white, and the share of its brightness that a right limb keeps."""


class PeopleMeshes:
    """The body parts of all people as meshes."""

    def __init__(
        self,
        server: viser.ViserServer,
        root: str,
        people: Sequence[Person],
        color: tuple[int, int, int] | None = None,
        opacity: float | None = None,
    ) -> None:
        """Add the meshes below a node of the scene.

        Args:
            server: owns the scene.
            root: name of the node.
            people: who they are.
            color: of all meshes; by default each part has its own.
            opacity: of all meshes; opaque by default.
        """
        self._people = tuple(people)
        self.handles = [
            [
                server.scene.add_mesh_simple(
                    f"{root}/{person.name}/{part.name}",
                    *_mesh(person.model, index),
                    color=color or rgb(part.color),
                    opacity=opacity,
                    cast_shadow=False,
                    receive_shadow=False,
                )
                for index, part in enumerate(person.model.parts)
            ]
            for person in self._people
        ]
        """By person and part."""

    def pose(self, poses: Sequence[Array | None]) -> None:
        """Move each person to a pose, (n_values,); None leaves a person in place. Visibility does not change."""
        for person, handles, values in zip(self._people, self.handles, poses, strict=True):
            if values is not None:
                Ts = part_poses([PosedBody(person.model, values)])
                turns = rigid.quaternion_from_matrix(Ts[:, :3, :3])
                for handle, T, wxyz in zip(handles, Ts, turns, strict=True):
                    handle.position, handle.wxyz = T[:3, 3], wxyz

    def remove(self) -> None:
        """Remove the meshes from the scene."""
        for handles in self.handles:
            for handle in handles:
                handle.remove()

    def show_only(self, people: frozenset[int]) -> None:
        """Show some people, by index, and hide the others."""
        for index, handles in enumerate(self.handles):
            _set_visible(handles, index in people)

    def set_appearance(self, view: View3d, hidden: frozenset[int], dimmed: frozenset[int]) -> None:
        """Set visibility, colour and opacity.

        Args:
            view: what the 3-D view shows.
            hidden: indices of the people to hide.
            dimmed: indices of the people to dim.
        """
        for index, (person, handles) in enumerate(zip(self._people, self.handles, strict=True)):
            opacity = _DIMMED * view.opacity if index in dimmed else view.opacity
            for part, handle in zip(person.model.parts, handles, strict=True):
                handle.color = rgb(part.color) if view.colors == "parts" else shaded(person.color, side_of(part.name))
                handle.opacity = None if opacity >= 1 else opacity
            _set_visible(handles, view.bodies and index not in hidden)


def _mesh(model: BodyModel, part: int) -> tuple[Array, IntArray]:
    """Return the vertices, (n, 3), metres, and triangles, (m, 3), of a part; a head has a nose."""
    triangles = model.shapes[part].triangles()
    vertices, (extra, faces) = triangles.vertices + model.centers_part[part], nose(model, part)
    return np.vstack([vertices, extra]), np.vstack([triangles.faces, faces + len(vertices)])


def shaded(color: str, side: Side) -> tuple[int, int, int]:
    """Return a person's colour for a side of the body: lighter on the left, darker on the right."""
    red, green, blue = rgb(color)
    if side == "left":
        red, green, blue = (round(c + _LIGHTER * (255 - c)) for c in (red, green, blue))
    if side == "right":
        red, green, blue = (round(_DARKER * c) for c in (red, green, blue))
    return red, green, blue


def _set_visible(handles: Sequence[viser.MeshHandle], visible: bool) -> None:
    for handle in handles:
        if handle.visible != visible:
            handle.visible = visible
