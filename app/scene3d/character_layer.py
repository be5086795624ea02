"""Draw another body that moves as each person does, beside them in the 3-D view (KRH08 Sect. 6.1)."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import viser

from app.control.controller import Controller
from app.scene3d.meshes import PeopleMeshes
from app.state.floor_picking import FloorState
from app.state.identity import ObjectIdentity
from app.state.state import State
from tracker.body.model import BodyModel
from tracker.estimation.posing.character import drive_character
from tracker.formats.model_toml import load_model
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera, viewed_point
from tracker.geometry.ground_plane import GroundPlane, up_rotation

_BESIDE_M = 0.8
"""Distance between a person and the character, for each person of the session, metres."""


class CharacterLayer:
    """The characters of the shown frame: one for each person, as tall as the person."""

    def __init__(self, server: viser.ViserServer, controller: Controller) -> None:
        """Add no mesh before a character is chosen."""
        self._server, self._controller = server, controller
        self._meshes: PeopleMeshes | None = None
        self._built: tuple[object, ...] = ()
        self._drawn: tuple[object, ...] = ()
        self._characters: list[BodyModel] = []

    def show(self, state: State) -> None:
        """Draw the characters of a state."""
        if state.view_3d.character or self._meshes is not None:
            self._build(state)
            self._pose(state)

    def _build(self, state: State) -> None:
        """Replace the meshes if the character or the size of a body changed."""
        name, people = state.view_3d.character, self._controller.session_of(state).people
        wanted = (name, *(p.model.height_m for p in people))
        if wanted == self._built:
            return
        self._built, self._drawn = wanted, ()
        if self._meshes is not None:
            self._meshes.remove()
            self._meshes = None
        if name:
            self._characters = [load_model(name, p.model.height_m) for p in people]
            cast = [replace(p, model=model) for p, model in zip(people, self._characters, strict=True)]
            self._meshes = PeopleMeshes(self._server, "/characters", cast)

    def _pose(self, state: State) -> None:
        wanted = (*map(ObjectIdentity, state.poses), state.models, state.floor, state.view_3d, state.people_not_drawn)
        if self._meshes is None or wanted == self._drawn:
            return
        self._drawn = wanted
        cameras = [c.camera for c in self._controller.session.cameras]
        poses = driven(state.models, state.poses, self._characters, state.floor, cameras)
        self._meshes.pose(poses)
        absent = frozenset(i for i, pose in enumerate(poses) if pose is None)
        self._meshes.set_appearance(replace(state.view_3d, bodies=True), state.people_not_drawn | absent, frozenset())


def driven(
    models: Sequence[BodyModel], poses: Sequence[Array | None], characters: Sequence[BodyModel], floor: FloorState,
    cameras: Sequence[Camera],
) -> list[Array | None]:  # fmt: skip
    """Return the pose of each character, (n_values,), to the right of its person as the first camera sees them.

    Args:
        models: the body of each person.
        poses: of each person, (n_values,); None for a person without a pose, whose character has none either.
        characters: the body that moves as each person does.
        floor: what all stand on. Without a plane, a character's lowest point is as high as the person's.
        cameras: of the session.
    """
    up = up_rotation(floor.up, floor.plane)[:, 2]
    right = np.cross(viewed_point(list(cameras)) - cameras[0].center_world, up)
    beside_m = _BESIDE_M * len(models) * right / max(float(np.linalg.norm(right)), 1e-9)
    out: list[Array | None] = []
    for model, pose, character in zip(models, poses, characters, strict=True):
        if pose is None:
            out.append(None)
            continue
        plane = floor.plane or GroundPlane(up, float((model.points_world(pose) @ up).min()))
        values, step = drive_character(pose, model, character, plane), np.zeros(character.n_dofs)
        step[np.flatnonzero(character.dof_is_length)[:3]] = beside_m
        out.append(np.asarray(character.retract(values, step)))
    return out
