"""Change poses without a drag: by values, by steps, or as a whole. Each change is one entry of the history."""

import time
from collections.abc import Generator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from app.control.session.activities import Activities
from app.control.session.session_state import SessionState
from tracker.body.limbs import display_name, limb_display_name
from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.estimation.fitting.retarget import retarget_pose
from tracker.estimation.posing import grab as grabbing
from tracker.estimation.posing.dof_series import move_dofs
from tracker.estimation.posing.drag import drag as drag_to
from tracker.estimation.posing.edits import copy_dofs, copy_joint_angles, limb_of, mirror_pose, poses_along
from tracker.estimation.posing.orient import orient
from tracker.geometry.arrays import Array
from tracker.session.locked_dofs import require_unlocked

_SAME_GESTURE_S = 1.0
"""Maximum time between changes of one slider, or steps of one joint, that make one entry of the history."""

_TURNED = 1e-6
"""A frame whose axes differ by less is not turned."""


class PoseEdits:
    """Changes the pose of a person on the frame that the user saw; locked degrees of freedom stay."""

    def __init__(self, session_state: SessionState, activities: Activities) -> None:
        """Change nothing yet.

        Args:
            session_state: holds the state.
            activities: ends jobs and gestures before an edit.
        """
        self._session_state, self._activities = session_state, activities
        self._dragged: tuple[object, Array] = None, np.empty(0)  # the last drag of `turn`, and the pose at its start

    def set_dof(self, person: int, dof: int, value: float, frame: int | None = None) -> None:
        """Set one degree of freedom, clipped to its limits.

        For a ball joint it is a component of the rotation vector from the neutral pose.

        Args:
            person: index of the person.
            dof: index of the degree of freedom.
            value: rad or metres.
            frame: the frame that the user saw, which a tracker may have left; None for the shown one.

        Raises:
            TrackerError: it is locked.
        """
        with self._on(person, frame) as (model, before, _):
            by = value - model.difference(before, model.neutral())[dof]
            self._move(person, [dof], by, before, f"set {display_name(model.dof_names[dof])}", ("dof", dof))

    def set_along(self, person: int, dofs: Sequence[int], values: Sequence[float]) -> None:
        """Set degrees of freedom to a place in a landscape or map of the cost, rad or metres, see `poses_along`.

        Raises:
            TrackerError: the person has no such degrees of freedom, one is locked, or a value is not finite.
        """
        models = self._session_state.models
        is_known = 0 <= person < len(models) and all(0 <= dof < models[person].n_dofs for dof in dofs)
        if not is_known or len(set(dofs)) < len(dofs) or not np.isfinite(values).all():
            raise TrackerError("expected finite values of the body's degrees of freedom, found others; reload the page")
        require_unlocked(models[person], self._session_state.state.locked[person], dofs)
        with self._on(person, None) as (model, before, _):
            (moved,) = poses_along(model, before, dofs, np.array([values]))
            names = " and ".join(display_name(model.dof_names[d]) for d in dofs)
            self._apply(person, model.clip(moved), f"set {names}")

    def set_values(self, person: int, values: Array, frame: int | None = None) -> None:
        """Set a whole pose, (n_values,), within the limits of the joints; locked degrees of freedom stay.

        Raises:
            TrackerError: it is not a pose of the person's body.
        """
        with self._on(person, frame) as (model, before, free):
            if values.shape != (len(model.value_names),) or not np.isfinite(values).all():
                found = values.shape if np.isfinite(values).all() else "numbers that are not finite"
                n = len(model.value_names)
                raise TrackerError(f"expected the {n} values of '{model.name}', found {found}; see its value_names")
            self._apply(person, copy_dofs(model, before, model.clip(values), free), "set pose")

    def turn(
        self, person: int, dofs: Sequence[int], by: Array | float, frame: int | None = None, drag: int | None = None
    ) -> None:
        """Change degrees of freedom by steps, each clipped to its limits; see `set_dof`.

        Args:
            person: index of the person.
            dofs: indices of the degrees of freedom.
            by: their steps, rad or metres, one for all or one for each.
            frame: as for `set_dof`.
            drag: number of the drag that the steps belong to. They count from the pose at its start, and its changes
                make one entry of the history however long it lasts; None for steps from the shown pose.

        Raises:
            TrackerError: one of them is locked.
        """
        with self._on(person, frame) as (model, before, _):
            state = self._session_state.state
            if self._dragged[0] != (drag, person, state.frame) or drag is None:
                self._dragged = (drag, person, state.frame), before
            name = display_name(model.dof_names[dofs[0]]) if len(dofs) == 1 else f"{len(dofs)} curves"
            label, gesture = f"{'nudge' if drag is None else 'drag'} {name}", ("dof", *dofs, drag)
            self._move(person, dofs, by, self._dragged[1], label, gesture, lasting=drag is not None)

    def cancel_drag(self, dofs: Sequence[int], drag: int) -> None:
        """Take a drag of degrees of freedom back, unless something else has been edited since; see `turn`."""
        with self._session_state.lock:
            owner = self._session_state.open_edit_owner
            if isinstance(owner, tuple) and owner[-1] == ("dof", *dofs, drag):
                self._session_state.revert(owner)

    def nudge(
        self, person: int, point: str | None, camera: int, right_m: float, up_m: float, frame: int | None = None
    ) -> None:
        """Move a point parallel to the image plane of a view; the chain follows as in a drag.

        Args:
            person: index of the person.
            point: name of the point; None for the whole body.
            camera: index of the view.
            right_m: to the right as the view shows it, metres.
            up_m: upwards as the view shows it, metres.
            frame: as for `set_dof`.

        Raises:
            TrackerError: the point is behind the camera, or all degrees of freedom that move it are locked.
        """
        with self._on(person, frame) as (model, values, _):
            view = self._session_state.session.cameras[camera].camera.pinhole
            name = model.point_names[0] if point is None else point
            place = model.points_world(values)[model.point_names.index(name)]
            step = view.T_world_camera[:3, :3] @ np.array([right_m, -up_m, 0.0])
            start, end = view.project(np.stack([place, place + step]))
            if not np.all(np.isfinite([start, end])):
                raise TrackerError(
                    f"expected {display_name(name)} before {view.name}, found it behind; choose another view"
                )
            hand = grabbing.grab(model, values, view, name, start, self._session_state.drag_constraints(person))
            self._apply(person, drag_to(hand, end, values), f"nudge {display_name(name)}", ("nudge", name, camera))

    def place_part(self, person: int, part: int, R_world: Array, position_world: Array | None, gesture: object) -> None:
        """Turn a part to an orientation, as far as its joint allows; the root also moves to a position.

        Args:
            person: index of the person.
            part: index of the part, and of the joint that moves it.
            R_world: orientation of the part's frame, (3, 3).
            position_world: target of the root, (3,), metres; None leaves it.
            gesture: changes of one gesture make one entry of the history.
        """
        with self._on(person, None) as (model, values, free):
            T = model.kinematics(values).Ts_world_part[part]
            if position_world is not None:
                step = np.zeros(model.n_dofs)
                step[:3] = position_world - T[:3, 3]
                values = model.retract(values, np.where(free, step, 0.0))
            if np.abs(R_world - T[:3, :3]).max() > _TURNED:
                values = orient(model, values, part, R_world, free)
            self._apply(person, values, f"place {display_name(model.joints[part].name)}", gesture, lasting=True)

    def mirror(self, person: int, frame: int | None = None) -> None:
        """Mirror the pose in the body's plane of symmetry."""
        with self._on(person, frame) as (model, values, free):
            self._apply(person, copy_dofs(model, values, mirror_pose(model, values), free), "mirror")

    def copy_from(self, person: int, other: int, frame: int | None = None) -> None:
        """Copy the stored pose of another frame.

        Raises:
            TrackerError: the person has no pose there.
        """
        with self._on(person, frame) as (model, values, free):
            stored = self._session_state.saver.pose(person, other)
            if stored is None:
                name = self._session_state.session.people[person].name
                raise TrackerError(
                    f"expected a pose of {name} on frame {other} to copy, found none; choose another frame"
                )
            assert stored.revision is not None
            copied = retarget_pose(stored.values, self._session_state.saver.revisions.body(stored.revision), model)
            self._apply(person, copy_dofs(model, values, copied, free), f"copy frame {other}")

    def copy_person(self, person: int, other: int, frame: int | None = None) -> None:
        """Copy the joint angles of another person on the same frame, by joint name; the root stays.

        Raises:
            TrackerError: there is no other person of that index.
        """
        if other == person or not 0 <= other < len(self._session_state.models):
            raise TrackerError(f"expected another person to copy the pose of, found number {other}; choose another")
        with self._on(person, frame) as (model, values, free):
            body, others = self._session_state.models[other], self._session_state.state.poses[other]
            bent = copy_joint_angles(model, values, body, others, free)
            self._apply(person, bent, f"copy the pose of {self._session_state.session.people[other].name}")

    def reset(self, person: int, point: str | None, frame: int | None = None) -> None:
        """Reset the limb of a point to the neutral pose; without a point, or for the root, all but the root."""
        with self._on(person, frame) as (model, values, free):
            limb, dofs = limb_of(model, point)
            neutral = copy_dofs(model, values, model.neutral(), dofs & free)
            self._apply(person, neutral, f"reset {limb_display_name(limb)}")

    @contextmanager
    def _on(self, person: int, frame: int | None) -> Generator[tuple[BodyModel, Array, NDArray[np.bool_]], None, None]:
        """Edit the frame that the user saw; yields the person's model, pose and unlocked degrees of freedom."""
        session_state = self._session_state
        with self._activities.editing():
            session_state.go_to(frame)
            yield session_state.models[person], session_state.state.poses[person], session_state.active_dofs(person)

    def _move(
        self, person: int, dofs: Sequence[int], by: Array | float, before: Array, label: str, gesture: object,
        lasting: bool = False,
    ) -> None:  # fmt: skip
        """Move degrees of freedom of a pose, (n_values,), and show and save it; see `_apply`."""
        model = self._session_state.models[person]
        require_unlocked(model, self._session_state.state.locked[person], dofs)
        self._apply(person, move_dofs(model, before[None], dofs, by)[0], label, gesture, lasting)

    def _apply(self, person: int, values: Array, label: str, gesture: object = None, lasting: bool = False) -> None:
        """Show and save a pose.

        Args:
            person: index of the person.
            values: pose, (n_values,).
            label: of the entry of the history.
            gesture: changes of one gesture in quick succession make one entry; None always makes a new one.
            lasting: whether the changes of the gesture make one entry even after a pause.
        """
        session_state = self._session_state
        session_state.show_pose(person, values)
        gesture = (label, person, session_state.state.frame, gesture) if gesture is not None else object()
        if gesture != session_state.open_edit_owner or (
            not lasting and time.monotonic() - session_state.last_save > _SAME_GESTURE_S
        ):
            session_state.open_edit_owner = None
        session_state.save(label, "manual", gesture, person)
