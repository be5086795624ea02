"""Write a motion to files of one format: one function for each, `formats` lists them."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tracker.body.model import PosedBody
from tracker.footage.camera_source import CameraSource
from tracker.footage.chapters import chapter_files
from tracker.footage.image_folder import ImageFolder
from tracker.formats.bvh import UPRIGHT_Y, BvhFrame, write_bvh
from tracker.formats.file_names import identifier
from tracker.formats.keypoints import coco
from tracker.formats.model_toml import format_model
from tracker.formats.motion_csv import MotionRow, write_motion_csv
from tracker.formats.pose_csv import value_units
from tracker.formats.trc import write_trc
from tracker.formats.write_only.c3d import write_c3d
from tracker.formats.write_only.gltf import AnimatedBody, write_glb
from tracker.formats.write_only.movement_netcdf import PER_POINT, PER_POSE, Variable, write_dataset
from tracker.formats.write_only.opensim_model import write_mot, write_osim
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera
from tracker.geometry.ground_plane import up_rotation
from tracker.interchange.exports.formats import Tick
from tracker.interchange.exports.keypoints import Keypoints
from tracker.interchange.exports.label_writers import write_views
from tracker.interchange.exports.motion import ExportedMotion, ExportOptions, PersonMotion, file_from_world, up_in_file
from tracker.interchange.exports.provenance import pose_arrays, pose_provenance, pose_values
from tracker.interchange.exports.views import FrameViews, exported_cameras, view_arrays


def write_person_trc(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the points of one person as TRC; a frame without a pose is a row of empty cells."""
    found, rate = pose_arrays(motion, options, tick), motion.session.fps
    write_trc(paths[0], found.points, found.joints[:, 0], rate, frames=motion.frames, units=options.units)


def write_tables(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the points of all people to the first CSV file, and the values of their poses to the second."""
    found, (names, poses) = pose_arrays(motion, options, tick), pose_values(motion)
    models = [model for person in motion.exported for model in person.models]
    units = {v: _unit(unit, options) for m in models for v, unit in zip(m.value_names, value_units(m), strict=True)}
    places = options.per_metre * np.concatenate([found.joints, found.errors_m[..., None]], axis=-1)
    columns = [f"{name}.{what}_{options.units}" for name in found.points for what in ("x", "y", "z", "error")]
    angles = poses * [units[name][1] for name in names]
    of_values = [name + units[name][0] for name in names]
    rows = [_row(motion, person, frame) for person in motion.exported for frame in motion.frames]
    tables = (columns, places.reshape(*places.shape[:2], -1)), (of_values, angles)
    for path, (titles, values) in zip(paths, tables, strict=True):
        by_person = np.concatenate(np.swapaxes(values, 0, 1)).tolist()
        filled = [replace(row, values=own) for row, own in zip(rows, by_person, strict=True)]
        write_motion_csv(path, motion.session.camera_names, titles, filled)


def write_person_opensim(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the poses of one person as an OpenSim motion, and the body as the model that the motion moves."""
    (person,) = motion.exported
    title = identifier(f"{motion.session.name}_{person.person.name}")
    write_mot(paths[0], person.model, *_poses_and_times(motion, person), title, motion.calibration_note)
    T_ground_world = file_from_world(motion.session, options.axes)
    write_osim(paths[1], person.model, title, T_ground_world, up_in_file(motion.session, options.axes).tolist())
    for _ in motion.frames:
        tick()


def write_person_bvh(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the motion of one person as BVH, without gaps."""
    (person,) = motion.exported
    session = motion.session
    upright = UPRIGHT_Y if options.axes == "y-up" else up_rotation(session.up, session.floor)
    frame = BvhFrame(file_from_world(session, options.axes), upright, options.per_metre)
    write_bvh(paths[0], person.model, person.without_gaps(motion.frames), session.fps, frame, tick)


def write_animation(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the motion of all people as glTF, with the shapes of their parts. Viewers interpolate frames between."""
    bodies = [AnimatedBody(p.person.name, p.model, *_poses_and_times(motion, p)) for p in motion.exported]
    write_glb(paths[0], motion.session.name, bodies, file_from_world(motion.session, options.axes))
    for _ in motion.frames:
        tick()


def _poses_and_times(motion: ExportedMotion, person: PersonMotion) -> tuple[Array, Array]:
    """Return the poses of a person in one body, (n, n_values), and their times, (n,), s."""
    poses = person.in_one_body()
    return np.array([poses[f] for f in sorted(poses)]), np.array([motion.time_s(f) for f in sorted(poses)])


def write_keypoints(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the keypoints of people in all views as COCO."""
    categories = coco_categories(motion, options)
    names = [_FileNames(source) for source in motion.session.cameras]
    images, annotations = list[coco.CocoImage](), list[coco.CocoAnnotation]()

    def write(views: FrameViews, view: int, frame: int) -> None:
        images.append(names[view].image(len(images) + 1, frame))
        for person, body, seen in views.seen(view):
            annotations.extend(coco_annotations(motion, categories, person, body, seen, images[-1], len(annotations)))

    write_views(motion, [c.camera for c in motion.session.cameras], None, write, tick)
    description = f"{motion.session.name}, exported by Quadrille, {motion.calibration_note}"
    coco.write_coco(paths[0], description, motion.calibrations.present, categories, images, annotations)


def coco_categories(motion: ExportedMotion, options: ExportOptions) -> list[coco.CocoCategory]:
    """Return the sets of keypoints of an export."""
    categories: list[coco.CocoCategory] = []
    if options.keypoints != "body":
        categories.append(coco.person_category(1))
    if options.keypoints != "coco17":
        for model in {m.name: m for p in motion.exported for m in p.models}.values():
            categories.append(coco.body_category(len(categories) + 1, model))
    return categories


def coco_annotations(
    motion: ExportedMotion,
    categories: Sequence[coco.CocoCategory],
    person: PersonMotion,
    body: PosedBody,
    seen: Keypoints,
    image: coco.CocoImage,
    n_before: int,
) -> list[coco.CocoAnnotation]:
    """Return the annotations of a person in an image, one for each category that the body has."""
    out: list[coco.CocoAnnotation] = []
    status = person.poses[image.frame].record.status
    calibration = motion.calibration_of(person, image.frame)
    is_earlier = calibration != motion.calibrations.present
    for category in categories:
        if category.name not in ("person", body.model.name):
            continue
        triples = coco.keypoint_triples(body.model.point_names, seen.points_px, seen.visibility, category.keypoints)
        n = sum(v > 0 for v in triples[2::3])
        assert seen.box_px is not None
        out.append(
            coco.CocoAnnotation(
                n_before + len(out) + 1, image.id, category.id, triples, n, seen.box_px, seen.area_px,
                person.person.name, person.index, status, calibration, is_earlier,
            )
        )  # fmt: skip
    return out


class _FileNames:
    """Names of the images of a camera."""

    def __init__(self, source: CameraSource) -> None:
        """List the images of a folder."""
        self._source = source
        is_folder = source.footage.is_dir() and not chapter_files(source.footage)
        self._names = [p.name for p in ImageFolder(source.footage, source.camera.name).files] if is_folder else None

    def image(self, id: int, frame: int) -> coco.CocoImage:
        """Return the entry of a frame."""
        camera, at = self._source.camera, frame + self._source.offset
        name = f"{at:06d}.jpg" if self._names is None else self._names[at]
        return coco.CocoImage(
            id, f"{camera.name}/{name}", *camera.size, camera.name, frame, self._source.footage.name, at
        )


def _row(motion: ExportedMotion, person: PersonMotion, frame: int) -> MotionRow:
    """Return the row of a person in a frame, without values."""
    row = MotionRow(person.person.name, frame, motion.time_s(frame))
    if frame not in person.poses:
        return row
    found = pose_provenance(motion, person, frame)
    return replace(row, provenance=found.fields, costs_px=(found.record.cost_px, *found.record.view_costs_px))


def _unit(unit: str, options: ExportOptions) -> tuple[str, float]:
    """Return the unit of a value in the file as suffix, and the factor to it."""
    if unit == "_m":
        return f"_{options.units}", options.per_metre
    return (unit, float(np.degrees(1.0))) if unit == "_deg" else (unit, 1.0)


def write_person_c3d(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the points of one person as C3D; residuals are the errors that the run expects."""
    found = pose_arrays(motion, options, tick)
    write_c3d(
        paths[0], found.points, found.joints[:, 0], motion.session.fps,
        first_frame=motion.frames[0], residuals=found.errors_m[:, 0], units=options.units,
    )  # fmt: skip


def write_npz(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write poses, joint centers, covariances, provenance and cameras as arrays; docs/log/export.md lists them."""
    found, (names, poses) = pose_arrays(motion, options, tick), pose_values(motion)
    bodies = {p.record.model_revision: p.body.model for one in motion.exported for p in one.poses.values()}
    arrays: dict[str, Any] = {
        "format_version": 1,
        "session": motion.session.name,
        "fps": motion.session.fps,
        "axes": options.axes,
        "T_file_world": file_from_world(motion.session, options.axes),
        "frames": found.frames,
        "times_s": found.times_s,
        "people": found.people,
        "points": found.points,
        "bones": np.array(found.bones),
        "joints": found.joints,
        "covariance": found.covariances,
        "point_source": found.point_sources,
        "point_lost": found.point_lost,
        **found.by_pose,
        "values": names,
        "poses": poses,
        "bodies": sorted(bodies),
        "body_models": [format_model(bodies[r]) for r in sorted(bodies)],
        **_cameras(motion.session.cameras, exported_cameras(motion, options)),
    }
    plain = {name: np.asarray(values) for name, values in arrays.items()}
    assert not any(values.dtype.hasobject for values in plain.values()), "readers refuse pickled objects"
    np.savez_compressed(paths[0], **plain)  # pyrefly: ignore[bad-argument-type]


def _cameras(sources: Sequence[CameraSource], cameras: Sequence[Camera]) -> dict[str, Any]:
    """Return the cameras as arrays; distortion coefficients that a lens lacks are 0."""
    lost = [(i, *own) for i, source in enumerate(sources) for own in source.clock.lost]
    n_coefficients = max(camera.distortion.size for camera in cameras)
    distortion: list[Array] = [np.pad(c.distortion, (0, n_coefficients - c.distortion.size)) for c in cameras]
    return {
        "cameras": [camera.name for camera in cameras],
        "camera_size": [camera.size for camera in cameras],
        "camera_K": [camera.K for camera in cameras],
        "camera_distortion": distortion,
        "camera_fisheye": [camera.fisheye for camera in cameras],
        "camera_T_world_camera": [camera.T_world_camera for camera in cameras],
        "camera_offset": [source.offset for source in sources],
        "camera_clock": [(source.clock.ahead_frames, source.clock.rate) for source in sources],
        "camera_lost_frames": np.array(lost, dtype=np.int64).reshape(-1, 3),
        "camera_footage": [source.footage.name for source in sources],
    }


def write_movement(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write a dataset of `movement` with the joint centers in space, and another one with the points in all views.

    Raises:
        FormatError: a package is missing.
    """
    found = pose_arrays(motion, options)
    seen = view_arrays(motion, options, found.points, tick)
    attributes = {"fps": motion.session.fps, "session": motion.session.name}
    names = {"time": found.times_s, "keypoints": list(found.points), "individuals": list(found.people)}
    frame: Variable = (("time",), found.frames)
    in_space: dict[str, Variable] = {
        "position": ((*PER_POINT, "space"), found.joints),
        "confidence": (PER_POINT, found.confidence),
        "covariance": ((*PER_POINT, "space", "space_of"), found.covariances),
        "point_source": (PER_POINT, found.point_sources),
        "point_lost": (PER_POINT, found.point_lost),
        "frame": frame,
        **{name: (PER_POSE, values) for name, values in found.by_pose.items()},
    }
    metres = attributes | {"space_unit": "metres", "axes": options.axes}
    write_dataset(paths[0], in_space, names | {"space": list("xyz")}, metres)
    in_views: dict[str, Variable] = {
        "position": (("view", *PER_POINT, "space"), seen.points_px),
        "confidence": (("view", *PER_POINT), np.where(np.isnan(seen.points_px[..., 0]), np.nan, found.confidence)),
        "visibility": (("view", *PER_POINT), seen.visibility),
        "frame": frame,
    }
    views = [source.camera.name for source in motion.session.cameras]
    pixels = attributes | {"space_unit": "pixels", "pixels": options.pixels}
    write_dataset(paths[1], in_views, names | {"space": list("xy"), "view": views}, pixels)
