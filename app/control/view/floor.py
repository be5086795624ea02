"""Set the floor from three clicked points, or from the feet of the people.

It is stored in session.toml, and the former floor can be restored.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from app.control.session.activities import Activities
from app.control.session.session_state import SessionState
from app.state.floor_picking import FloorState, Picking, with_mark, with_next, without_last
from tracker.body.motion.floor_from_feet import floor_from_feet
from tracker.errors import TrackerError
from tracker.geometry.cameras import Camera
from tracker.geometry.ground_plane import GroundPlane, nearest_axis
from tracker.session.session import save_floor
from tracker.session.session_file import UPS
from tracker.session.store.stored_poses import read_stored_poses

_KEY = "former_floor"
"""Setting of the session: the floor before the one that is set."""


class FloorEditing:
    """The floor of the session, and the clicks that set another."""

    def __init__(self, session_state: SessionState, activities: Activities) -> None:
        """Show the session's floor.

        Args:
            session_state: holds the state.
            activities: ends jobs and gestures before an edit.
        """
        self._session_state, self._activities = session_state, activities
        floor = FloorState(session_state.session.up, session_state.session.floor, former=self._former() is not None)
        session_state.set(floor=floor)

    @property
    def _cameras(self) -> list[Camera]:
        return [c.camera for c in self._session_state.session.cameras]

    def begin(self) -> None:
        """Begin to click points; earlier clicks are discarded."""
        self._pick(Picking())

    def cancel(self) -> None:
        """Discard the clicked points; the floor is unchanged."""
        self._pick(None)

    def mark(self, camera: int, position_px: tuple[float, float]) -> None:
        """Mark the current point in a view, undistorted px."""
        with self._session_state.lock:
            picking = self._session_state.state.floor.picking
            if picking is not None and 0 <= camera < len(self._cameras):
                self._pick(with_mark(picking, self._cameras, camera, *position_px))

    def next_point(self) -> None:
        """Begin the next point.

        Raises:
            TrackerError: the current point is not triangulated yet.
        """
        with self._session_state.lock:
            picking = self._session_state.state.floor.picking
            if picking is None:
                return
            if picking.picks[-1].point_world is None:
                raise TrackerError(f"this point of the floor is not known yet: {picking.picks[-1].why}")
            self._pick(with_next(picking))

    def take_back(self) -> None:
        """Remove the last mark."""
        with self._session_state.lock:
            picking = self._session_state.state.floor.picking
            if picking is not None:
                self._pick(without_last(picking, self._cameras))

    def apply(self) -> None:
        """Set the floor to the plane through the points; it is on disk when this returns.

        Raises:
            TrackerError: the points give no plane, or it cannot be written.
        """
        with self._activities.editing():
            picking = self._session_state.state.floor.picking
            if picking is None:
                return
            if picking.plane is None:
                raise TrackerError(picking.why or "expected three points of the floor; click each in two views or more")
            self._change(nearest_axis(picking.plane.normal), picking.plane, "three points")

    def set_from_feet(self) -> None:
        """Set the floor to the plane under the feet in all stored poses; it is on disk when this returns.

        Raises:
            TrackerError: the poses show no plane, or it cannot be written.
        """
        session = self._session_state.session
        stored = [read_stored_poses(session.annotations_path, p.name, p.model) for p in session.people]
        found = floor_from_feet([{k: pose.body for k, pose in own.items()} for own in stored])
        words = f"feet at {found.n_places} places, within {1000 * found.spread_m:.0f} mm"
        with self._activities.editing():  # not before: others work meanwhile
            origin = f"{words}, tilt known to {found.tilt_deg:.1f}°"
            self._change(nearest_axis(found.plane.normal), found.plane, origin)

    def revert(self) -> None:
        """Restore the floor before the last change; twice restores the present one.

        Raises:
            TrackerError: there is none, or it cannot be written.
        """
        with self._activities.editing():
            former = self._former()
            if former is None:
                raise TrackerError("there is no former floor to go back to: this one is the calibration's")
            self._change(*former)

    def _change(self, up: str, plane: GroundPlane | None, origin: str = "") -> None:
        before = self._session_state.state.floor
        self._session_state.session = save_floor(self._session_state.session, up, plane)
        self._session_state.saver.store_setting(_KEY, _plane_setting(before.up, before.plane))
        self._session_state.frame_poses.place(self._session_state.session)
        self._session_state.set(floor=FloorState(up, plane, origin=origin, former=True))

    def _pick(self, picking: Picking | None) -> None:
        with self._session_state.lock:
            self._session_state.set(floor=replace(self._session_state.state.floor, picking=picking))

    def _former(self) -> tuple[str, GroundPlane | None] | None:
        data = self._session_state.saver.setting(_KEY)
        if not isinstance(data, dict) or data.get("up") not in UPS:
            return None
        normal = data.get("normal")
        return data["up"], None if normal is None else GroundPlane(np.array(normal), float(data["offset_m"]))


def _plane_setting(up: str, plane: GroundPlane | None) -> dict[str, Any]:
    if plane is None:
        return {"up": up}
    return {"up": up, "normal": plane.normal.tolist(), "offset_m": plane.offset_m}
