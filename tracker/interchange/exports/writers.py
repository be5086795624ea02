"""Write a motion to files, one function for each format. `app.export` lists them for the command line and the page."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tracker.body.model import PosedBody
from tracker.footage.camera_source import CameraSource
from tracker.footage.chapters import chapter_files
from tracker.footage.image_folder import ImageFolder
from tracker.formats.bvh import UPRIGHT_Y, BvhFrame, write_bvh
from tracker.formats.file_names import identifier
from tracker.formats.keypoints.coco import (
    CocoAnnotation,
    CocoCategory,
    CocoImage,
    body_category,
    keypoint_triples,
    person_category,
    write_coco,
)
from tracker.formats.motion_csv import MotionRow, write_motion_csv
from tracker.formats.opensim_model import write_osim
from tracker.formats.opensim_mot import write_mot
from tracker.formats.pose_csv import value_units
from tracker.formats.trc import write_trc
from tracker.formats.write_only.gltf import AnimatedBody, write_glb
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import up_rotation
from tracker.interchange.exports.keypoints import Keypoints, keypoints_in_views
from tracker.interchange.exports.motion import ExportedMotion, PersonMotion
from tracker.interchange.exports.options import ExportOptions, file_from_world, up_in_file
from tracker.session.store.records import PoseRecord

Tick = Callable[[], None]
"""Called after each frame of each file; it may raise to stop the export."""


def write_person_trc(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the points of one person as TRC; a frame without a pose is a row of empty cells."""
    (person,) = motion.exported
    names = list(dict.fromkeys(name for model in person.models for name in model.point_names))
    points = np.full((len(motion.frames), len(names), 3), np.nan)
    T_file_world = file_from_world(motion.session, options.axes)
    for i, frame in enumerate(motion.frames):
        if frame in person.poses:
            body = person.poses[frame].body
            points[i, [names.index(n) for n in body.model.point_names]] = rigid.apply(
                T_file_world, body.joint_centers_world
            )
        tick()
    write_trc(paths[0], names, points, motion.session.fps, frames=motion.frames, units=options.units)


def write_tables(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the points of all people to the first CSV file, and the values of their poses to the second."""
    cameras = [c.camera.name for c in motion.session.cameras]
    T_file_world, per_metre = file_from_world(motion.session, options.axes), options.per_metre
    models = [model for person in motion.exported for model in person.models]
    points = list(dict.fromkeys(name for model in models for name in model.point_names))
    units = {v: _unit(unit, options) for m in models for v, unit in zip(m.value_names, value_units(m), strict=True)}
    joints: list[MotionRow] = []
    angles: list[MotionRow] = []
    for person in motion.exported:
        for frame in motion.frames:
            row, stored = _row(motion, person, frame), person.poses.get(frame)
            joint_values: list[float] = []
            angle_values: list[float] = []
            if stored is not None:
                model, body = stored.body.model, stored.body
                places = (per_metre * rigid.apply(T_file_world, body.joint_centers_world)).tolist()
                by_point = dict(zip(model.point_names, places, strict=True))
                errors = _errors(stored.record) * per_metre
                of_errors = dict(zip(model.point_names, errors.tolist(), strict=False))
                joint_values = [
                    x for name in points for x in (*by_point.get(name, (np.nan,) * 3), of_errors.get(name, np.nan))
                ]
                by_value = dict(zip(model.value_names, body.values.tolist(), strict=True))
                angle_values = [by_value.get(v, np.nan) * factor for v, (_, factor) in units.items()]
            joints.append(replace(row, values=joint_values))
            angles.append(replace(row, values=angle_values))
            if person is motion.exported[0]:
                tick()
    columns = [f"{name}.{what}_{options.units}" for name in points for what in ("x", "y", "z", "error")]
    write_motion_csv(paths[0], cameras, columns, joints)
    write_motion_csv(paths[1], cameras, [v + suffix for v, (suffix, _) in units.items()], angles)


def write_person_opensim(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the poses of one person as an OpenSim motion, and the body as the model that the motion moves."""
    (person,) = motion.exported
    poses = person.in_one_body()
    frames = sorted(poses)
    values = np.array([poses[f] for f in frames])
    times = np.array([motion.time_s(f) for f in frames])
    title = identifier(f"{motion.session.name}_{person.person.name}")
    write_mot(paths[0], person.model, values, times, title, motion.calibration_note)
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
    bodies = []
    for person in motion.exported:
        poses = person.in_one_body()
        frames = sorted(poses)
        times = np.array([motion.time_s(f) for f in frames])
        bodies.append(AnimatedBody(person.person.name, person.model, np.array([poses[f] for f in frames]), times))
    write_glb(paths[0], motion.session.name, bodies, file_from_world(motion.session, options.axes))
    for _ in motion.frames:
        tick()


def write_keypoints(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the keypoints of people in all views as COCO."""
    categories = coco_categories(motion, options)
    cameras = [c.camera for c in motion.session.cameras]
    names = [_FileNames(source) for source in motion.session.cameras]
    images: list[CocoImage] = []
    annotations: list[CocoAnnotation] = []
    for frame in motion.frames:
        people = motion.bodies(frame)
        times = [c.clock.ahead(frame) for c in motion.session.cameras]
        views = keypoints_in_views([body for _, body in people], cameras, times) if people else [[] for _ in cameras]
        for name, found in zip(names, views, strict=True):
            image = name.image(len(images) + 1, frame)
            images.append(image)
            for (person, body), seen in zip(people, found, strict=True):
                if motion.is_exported(person, frame) and seen.box_px is not None:
                    annotations += coco_annotations(motion, categories, person, body, seen, image, len(annotations))
        tick()
    description = f"{motion.session.name}, exported by Quadrille, {motion.calibration_note}"
    write_coco(paths[0], description, motion.calibrations.present, categories, images, annotations)


def coco_categories(motion: ExportedMotion, options: ExportOptions) -> list[CocoCategory]:
    """Return the sets of keypoints of an export."""
    categories: list[CocoCategory] = []
    if options.keypoints != "body":
        categories.append(person_category(1))
    if options.keypoints != "coco17":
        for model in {m.name: m for p in motion.exported for m in p.models}.values():
            categories.append(body_category(len(categories) + 1, model))
    return categories


def coco_annotations(
    motion: ExportedMotion,
    categories: Sequence[CocoCategory],
    person: PersonMotion,
    body: PosedBody,
    seen: Keypoints,
    image: CocoImage,
    n_before: int,
) -> list[CocoAnnotation]:
    """Return the annotations of a person in an image, one for each category that the body has."""
    out: list[CocoAnnotation] = []
    status = person.poses[image.frame].record.status
    calibration = motion.calibration_of(person, image.frame)
    is_earlier = calibration != motion.calibrations.present
    for category in categories:
        if category.name not in ("person", body.model.name):
            continue
        triples = keypoint_triples(body.model.point_names, seen.points_px, seen.visibility, category.keypoints)
        n = sum(v > 0 for v in triples[2::3])
        assert seen.box_px is not None
        out.append(
            CocoAnnotation(
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

    def image(self, id: int, frame: int) -> CocoImage:
        """Return the entry of a frame."""
        camera, at = self._source.camera, frame + self._source.offset
        name = f"{at:06d}.jpg" if self._names is None else self._names[at]
        return CocoImage(id, f"{camera.name}/{name}", *camera.size, camera.name, frame, self._source.footage.name, at)


def _row(motion: ExportedMotion, person: PersonMotion, frame: int) -> MotionRow:
    """Return the row of a person in a frame, without values."""
    row = MotionRow(person.person.name, frame, motion.time_s(frame))
    stored = person.poses.get(frame)
    if stored is None:
        return row
    record = stored.record
    costs = (record.cost_px, *record.view_costs_px)
    calibration = motion.calibration_of(person, frame)
    return replace(
        row, status=record.status, source=stored.source, is_keyframe=record.keyframe, calibration=calibration,
        is_earlier=calibration != motion.calibrations.present, costs_px=costs,
    )  # fmt: skip


def _errors(record: PoseRecord) -> Array:
    """Return the root mean square error of each point of a pose, (n_points,), metres; empty where it is not known."""
    return np.zeros(0) if record.errors is None else np.sqrt(np.trace(record.errors, axis1=1, axis2=2))


def _unit(unit: str, options: ExportOptions) -> tuple[str, float]:
    """Return the unit of a value in the file as suffix, and the factor to it."""
    if unit == "_m":
        return f"_{options.units}", options.per_metre
    return (unit, float(np.degrees(1.0))) if unit == "_deg" else (unit, 1.0)
