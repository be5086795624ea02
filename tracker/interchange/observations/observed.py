"""Points of people that another program found, in pictures or in space, and their joints by triangulation."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Annotated

import msgspec
import numpy as np
from numpy.typing import NDArray

from tracker.formats.joint_maps import JointMap
from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.geometry.cameras import Camera
from tracker.geometry.robust_triangulation import Views, triangulate_points
from tracker.interchange.observations.identities import gather, match_people
from tracker.interchange.observations.sides import exchanged_sides, with_sides_exchanged


@dataclass(frozen=True, eq=False)
class ObservedPoints:
    """Key points of people in the pictures of all cameras.

    A detection is one person in one picture. The detections of a picture have the order of the file, so that one person
    may have different numbers in different pictures; `identities` says who is who.
    """

    names: tuple[str, ...]
    """Names of the points in the file, (n_points,)."""
    cameras: tuple[str, ...]
    """Names of the session's cameras, in its order, (n_views,); one without a file has no points."""
    points_px: Array
    """Positions in original pixels, (n_frames, n_views, n_detections, n_points, 2); NaN where absent."""
    confidence: Array
    """Confidence of each point, 0 to 1, (n_frames, n_views, n_detections, n_points); 0 where absent."""
    tracks: NDArray[np.str_] | None = None
    """Name that the file of a camera gives each detection, (n_frames, n_views, n_detections); empty without one. It may
    differ between cameras. None for stored observations."""
    colors: Array | None = None
    """Colors of the clothes of each detection, (n_frames, n_views, n_detections, n_colors); NaN where unknown. None if
    nothing is known of them."""

    def __post_init__(self) -> None:
        n_frames, n_views, n_detections, n_points = self.confidence.shape
        assert (n_views, n_points) == (len(self.cameras), len(self.names)), self.confidence.shape
        assert self.points_px.shape == (n_frames, n_views, n_detections, n_points, 2), self.points_px.shape
        assert self.colors is None or self.colors.shape[:-1] == self.confidence.shape[:-1]

    @cached_property
    def is_known(self) -> Mask:
        """Whether each point was found, (n_frames, n_views, n_detections, n_points)."""
        return np.isfinite(self.points_px).all(axis=-1) & (self.confidence > 0)

    @property
    def n_frames(self) -> int:
        """Number of frames of the session."""
        return len(self.points_px)


@dataclass(frozen=True, eq=False)
class ObservedJoints:
    """Points of people in space."""

    names: tuple[str, ...]
    """Names of the points in the file, (n_points,)."""
    people: tuple[str, ...]
    """People of the session, (n_people,)."""
    joints_world: Array
    """Positions in the world of the session, (n_frames, n_people, n_points, 3), metres; NaN where absent."""
    covariances: Array | None = None
    """Covariance of each position, (n_frames, n_people, n_points, 3, 3), m^2; NaN where absent, None if unknown."""

    def __post_init__(self) -> None:
        shape = (len(self.joints_world), len(self.people), len(self.names), 3)
        assert self.joints_world.shape == shape, self.joints_world.shape
        assert self.covariances is None or self.covariances.shape == (*shape, 3)

    @property
    def n_frames(self) -> int:
        """Number of frames of the session."""
        return len(self.joints_world)


def checksum(data: bytes) -> str:
    """Return the SHA-256 of the bytes of a file, 64 hexadecimal digits."""
    return hashlib.sha256(data).hexdigest()


class SourceFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A file that was imported, kept as it came."""

    path: Annotated[str, msgspec.Meta(min_length=1, max_length=1000, description="the path of a file")]
    """Path among the files of its observations, with slashes."""
    sha256: Annotated[str, msgspec.Meta(pattern=r"^[0-9a-f]{64}\Z", description="64 hexadecimal digits")]
    """Checksum of its bytes."""
    camera: str = ""
    """Camera of the session that it is of; empty for a file of several cameras or of points in space."""


@dataclass(frozen=True, eq=False)
class ObservationSet:
    """The content of imported files, at the frames of a session."""

    name: str
    """Name within the session."""
    format: str
    """Name of the format of the files, one of `tracker.interchange.observations.readers.FORMATS`."""
    people: tuple[str, ...]
    """People of the session of whom they are."""
    joint_map: JointMap
    """The body's points for the points of the file."""
    points: ObservedPoints | None
    """Key points in pictures; None for points in space."""
    joints: ObservedJoints | None
    """Points in space; None for key points, whose joints `observed_joints` triangulates."""
    row_frames: tuple[Array, ...]
    """Frame of the session of each row, (n_rows,), fractional where the rate differs: for each file of points in space,
    or once for the pictures of all files."""
    sources: tuple[SourceFile, ...] = ()
    """The files."""
    notes: tuple[str, ...] = ()
    """Sentences on what was remarkable in the files."""
    options: tuple[tuple[str, str], ...] = ()
    """Names and values of the choices by which the files were read, such as their unit."""

    @property
    def point_names(self) -> tuple[str, ...]:
        """Names of the points in the file, (n_points,)."""
        found = self.points or self.joints
        assert found is not None
        return found.names

    @property
    def counterparts(self) -> dict[str, tuple[str, ...]]:
        """Points of the body whose mean each point of the file is, by name; empty for one without a counterpart."""
        return self.joint_map.counterparts(self.point_names)


def columns_of(names: tuple[str, ...], joint_map: JointMap, points: tuple[str, ...]) -> IntArray:
    """Return the column of each point of the body among the points of a file, (n,); -1 for one that the file lacks."""
    at = {name: i for i, name in enumerate(names)}
    return np.array([at.get(joint_map.markers.get(point, ""), -1) for point in points], dtype=np.int64)


_GROUPS = (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle", "heel", "toe"))
"""Joints whose sides a detector exchanges together: those of the arms, and those of the legs."""


@dataclass(frozen=True, eq=False)
class TriangulatedObservations:
    """Key points of people, matched across the views and triangulated."""

    joints: ObservedJoints
    identities: IntArray
    """Person of each detection, (n_frames, n_views, n_detections); -1 for one of nobody."""
    detections: IntArray
    """Detection of each person, (n_frames, n_people, n_views); -1 where a view shows none."""
    is_exchanged: Mask
    """Whether left and right were exchanged in a view, and mended, (n_frames, n_people, n_views, 2): arms, legs."""
    positions_px: Array
    """Each observation with its sides mended, (n_frames, n_people, n_views, n_points, 2), undistorted px; NaN where
    absent."""
    confidence: Array
    """Its confidence, (n_frames, n_people, n_views, n_points), 0 to 1; 0 where absent."""


def observed_joints(observations: ObservationSet, cameras: Sequence[Camera]) -> ObservedJoints:
    """Return the joints of observations in space; key points are triangulated with the present calibration.

    Args:
        observations: of any kind.
        cameras: of the session, in its order.
    """
    if observations.joints is not None:
        return observations.joints
    return triangulate_observations(observations, cameras).joints


def triangulate_observations(
    observations: ObservationSet, cameras: Sequence[Camera], mend_sides: bool = True
) -> TriangulatedObservations:
    """Match the people of key points across views and frames, and triangulate their points.

    Args:
        observations: with key points.
        cameras: of the session, in its order.
        mend_sides: exchange left and right in views that contradict the others.
    """
    points = observations.points
    assert points is not None
    views = Views(cameras)
    px = views.undistorted(points.points_px)
    people = observations.people
    identities = match_people(views, px, points.confidence, len(people), bones_of(observations), points.colors)
    detections = np.stack([_detections_of(identities, p) for p in range(len(people))], axis=1)
    groups = side_pairs(observations)
    found = []
    for person in range(len(people)):
        own_px, own_confidence = gather(px, points.confidence, detections[:, person])
        flags = np.zeros((*own_confidence.shape[:2], len(groups)), dtype=bool)
        for g, pairs in enumerate(groups if mend_sides else ()):
            flags[..., g] = exchanged_sides(views, own_px, own_confidence, pairs)
            own_px = with_sides_exchanged(own_px, pairs, flags[..., g])
            own_confidence = with_sides_exchanged(own_confidence, pairs, flags[..., g])
        points_world, covariances, *_ = triangulate_points(views, own_px, own_confidence)
        found.append((flags, own_px, own_confidence, points_world, covariances))
    flags, own_px, own_confidence, *of_joints = (np.stack(part, axis=1) for part in zip(*found, strict=True))
    joints = ObservedJoints(points.names, people, *of_joints)
    return TriangulatedObservations(joints, identities, detections, flags, own_px, own_confidence)


def side_pairs(observations: ObservationSet) -> list[list[tuple[int, int]]]:
    """Return the columns of the left and the right point of each pair, for the arms and for the legs."""
    at = {points[0]: i for i, points in enumerate(observations.counterparts.values()) if len(points) == 1}
    return [
        [(at[f"left_{j}"], at[f"right_{j}"]) for j in joints if f"left_{j}" in at and f"right_{j}" in at]
        for joints in _GROUPS
    ]


def bones_of(observations: ObservationSet) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Return the columns of both sides of each bone of the arms and legs, and from the shoulders to the hips."""
    groups = side_pairs(observations)
    return [*pairwise(g[0] for g in groups if g), *(bone for g in groups for bone in pairwise(g))]


def _detections_of(identities: IntArray, person: int) -> IntArray:
    """Return the detection of a person in each frame and view, (n_frames, n_views); -1 where there is none."""
    own = identities == person
    return np.where(own.any(axis=-1), own.argmax(axis=-1), -1)
