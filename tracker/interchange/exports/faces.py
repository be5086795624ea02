"""Blur faces in the pictures of an export: footage of people is personal data.

The head of each person with a pose is known in every view; between two poses it is interpolated, beyond them it stays.
Bystanders are known by their imported key points and joints: by their heads, or whole where no point of the head is
known. One whom masks alone show is blurred whole; one whose mask touches that of a tracked person is not seen.
"""

from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from tracker.body.model import PosedBody
from tracker.body.motion.interpolation import interpolate_pose
from tracker.errors import SessionError
from tracker.footage.recording import Recording, read_mask
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, Image
from tracker.interchange.exports.keypoints import project_through_lens
from tracker.interchange.exports.motion import ExportedMotion, FacesName, PersonMotion, read_motion
from tracker.interchange.observations.observed import ObservationSet
from tracker.interchange.observations.stored import list_observations, load_observations
from tracker.session.session import Session

_MARGIN = 1.5
"""Radius that is blurred, head radii: it leaves half a radius, some 5 cm, for hair and for the error of the pose."""
_HEAD_SHARE = 0.13
"""Height of the head, body heights (Winter 2009, Fig. 4.1)."""
_GRAINS = 4
"""Number of grains across a blurred head; a face needs some 16 to be recognized (Harmon & Julesz 1973)."""
_FACE = ("nose", "eye", "ear", "head", "face", "mouth", "chin", "brow", "vertex", "fhd", "bhd")
"""Parts of names of points of a head; the last two are of markers around it."""


class Circle(NamedTuple):
    """A part of a picture that is blurred."""

    center_px: Array
    """(2,), px of the footage."""
    radius_px: float


class BlurredRecording(Recording):
    """The footage of a session, in which every head that is known is blurred."""

    def __init__(self, session: Session, indices: Path | None = None) -> None:
        """Open the footage.

        Args:
            session: with its stored poses and imported observations.
            indices: as of a `Recording`.

        Raises:
            SessionError: a body has no head, or observations are damaged.
            RecordingError: the footage cannot be read.
        """
        self._heads = Heads(session)
        super().__init__(session.cameras, indices=indices)

    def _read_one(self, camera: int, k: int) -> Image | None:
        image = super()._read_one(camera, k)
        return None if image is None else blurred(image, self._heads.circles(camera, k))


def recording_of(motion: ExportedMotion, faces: FacesName, indices: Path | None = None) -> Recording:
    """Open the footage of a motion, with faces shown or blurred.

    Raises:
        SessionError: a body has no head, or observations are damaged.
        RecordingError: the footage cannot be read.
    """
    if faces == "blurred":
        return BlurredRecording(motion.session, indices)
    return Recording(motion.session.cameras, indices=indices)


def _stored_people(session: Session) -> Sequence[PersonMotion]:
    """Return the people of a session with all their stored poses; nobody if there is no pose."""
    try:
        return read_motion(session, range(len(session.people))).people
    except SessionError:
        return ()


class Heads:
    """The heads of all people who are known in the views of a session."""

    def __init__(self, session: Session) -> None:
        self._session, self._people = session, _stored_people(session)
        for person in self._people:
            for model in person.models:
                if "head" not in model.part_index:
                    raise SessionError(
                        f"expected a body with a head to blur, found '{model.name}' of {person.person.name}; leave the "
                        "faces as they are, or choose another body"
                    )

    @cached_property
    def _observations(self) -> list[ObservationSet]:
        return [load_observations(self._session, name) for name in list_observations(self._session)]

    def circles(self, view: int, frame: int) -> list[Circle]:
        """Return what hides the heads in a view on a frame; the view's own clock counts."""
        source = self._session.cameras[view]
        at = frame + source.clock.offset_frames(frame)
        bodies = [body for person in self._people if (body := _body_at(person, at)) is not None]
        found = list[Circle]()
        for body in bodies:
            px = project_through_lens(source.camera, head_surface(body))
            if (seen := np.isfinite(px).all(axis=1)).any():
                found.append(around(px[seen]))
        largest = max((circle.radius_px / _MARGIN for circle in found), default=0.0)
        for names, points_px in self._observed(view, frame, at):
            found += _by_points(names, points_px, largest)
        return found + self._masked(view, frame, [b for p in self._people if (b := _body_at(p, at, beyond=False))])

    def _observed(self, view: int, frame: int, at: float) -> Iterator[tuple[Sequence[str], Array]]:
        """Yield the names and positions, px, (n, 2), of the points of everybody who was observed; NaN where absent."""
        camera = self._session.cameras[view].camera
        for observed in self._observations:
            points, joints = observed.points, observed.joints
            if points is not None and frame < points.n_frames:
                known = points.is_known[frame, view][..., None]
                yield from ((points.names, px) for px in np.where(known, points.points_px[frame, view], np.nan))
            if joints is not None and round(at) < joints.n_frames:
                yield from ((joints.names, project_through_lens(camera, p)) for p in joints.joints_world[round(at)])

    def _masked(self, view: int, frame: int, bodies: Sequence[PosedBody]) -> list[Circle]:
        """Return circles around the pieces of a mask in which no body is."""
        source = self._session.cameras[view]
        mask = read_mask(source, frame)
        if mask is None:
            return []
        n, labels, boxes, centers = cv2.connectedComponentsWithStats((mask > 0).astype(np.uint8))
        of_people = {0}
        for body in bodies:
            px = project_through_lens(source.camera, body.joint_centers_world)
            at = np.rint(px[np.isfinite(px).all(axis=1)]).astype(int)
            inside = at[((at >= 0) & (at < mask.shape[::-1])).all(axis=1)]
            of_people |= set(labels[inside[:, 1], inside[:, 0]].tolist())
        return [Circle(centers[i], float(np.hypot(*boxes[i, 2:4]))) for i in range(n) if i not in of_people]


def _body_at(person: PersonMotion, at: float, beyond: bool = True) -> PosedBody | None:
    """Return the body of a person at a time in frames: between two poses, in between; of two bodies, the nearer one.

    Args:
        person: with all stored poses.
        at: the time.
        beyond: whether it stays as at the nearest pose beyond the first and the last one.
    """
    before, after = (
        max((k for k in person.poses if k <= at), default=None),
        min((k for k in person.poses if k >= at), default=None),
    )
    if before is None or after is None:
        nearest = after if before is None else before
        return person.poses[nearest].body if beyond and nearest is not None else None
    a, b = person.poses[before].body, person.poses[after].body
    share = (at - before) / (after - before) if after > before else 0.0
    if a.model.value_names != b.model.value_names:
        return a if share < 0.5 else b
    return PosedBody(a.model, interpolate_pose(a.model, a.values, b.values, np.array([share]))[0])


def head_surface(body: PosedBody) -> Array:
    """Return points on the surface of a head, (n, 3), world, metres."""
    part = body.model.part_index["head"]
    points = body.model.shapes[part].triangles().vertices + body.model.centers_part[part]
    return rigid.apply(body.kinematics.Ts_world_part[part], points)


def _by_points(names: Sequence[str], points_px: Array, head_px: float) -> list[Circle]:
    """Return the circle of the head of one person by his points, (n, 2), px; of him whole if none is of the head.

    Args:
        names: of the points.
        points_px: NaN where absent.
        head_px: radius of the largest head of a body in the view, px; 0 without any.
    """
    known = np.isfinite(points_px).all(axis=1)
    if not known.any():
        return []
    is_face = np.array([any(word in name.lower().replace("forearm", "") for word in _FACE) for name in names])
    if not (known & is_face).any():
        return [around(points_px[known], head_px)]
    is_whole = any("ankle" in name.lower() for name in np.array(names)[known])
    extent = float(np.hypot(*np.ptp(points_px[known], axis=0)))
    # The extent of a person who is seen in part says nothing of the size of the head; a smaller face is none.
    least = _HEAD_SHARE * extent if is_whole else max(head_px, _HEAD_SHARE * extent, _GRAINS**2)
    return [around(points_px[known & is_face], least)]


def around(points_px: Array, least_px: float = 0.0) -> Circle:
    """Return a circle around points of a head, (n, 2), px, of at least a radius before the margin."""
    center = (points_px.min(axis=0) + points_px.max(axis=0)) / 2
    radius = max(least_px, float(np.linalg.norm(points_px - center, axis=1).max()))
    return Circle(center, _MARGIN * radius)


def blurred(image: Image, circles: Sequence[Circle]) -> Image:
    """Return an image, (H, W, 3), with some circles reduced to a few grains."""
    if not circles:
        return image
    out, (height, width) = image.copy(), image.shape[:2]
    for (u, v), radius in circles:
        low = np.clip(np.floor([u - radius, v - radius]).astype(int), 0, (width, height))
        high = np.clip(np.ceil([u + radius, v + radius]).astype(int) + 1, 0, (width, height))
        patch = out[low[1] : high[1], low[0] : high[0]]
        if patch.size:
            grains = cv2.resize(patch, (_GRAINS, _GRAINS), interpolation=cv2.INTER_AREA)
            smooth = cv2.resize(grains, patch.shape[1::-1], interpolation=cv2.INTER_LINEAR)
            y, x = np.ogrid[low[1] : high[1], low[0] : high[0]]
            inside = (x - u) ** 2 + (y - v) ** 2 <= radius**2
            patch[inside] = smooth[inside]
    return out
