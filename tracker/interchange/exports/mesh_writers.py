"""Write bodies, visual hulls and scenes as triangle meshes, by trimesh."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from pathlib import Path

import cv2
import numpy as np
import trimesh
from PIL import Image as PillowImage
from trimesh.path import Path3D
from trimesh.path.entities import Line
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from tracker.body.model import PosedBody
from tracker.errors import RecordingError, TrackerError
from tracker.evidence.silhouettes import SilhouetteFinder
from tracker.evidence.voxels.shadows import recover_from_shadows
from tracker.evidence.voxels.visual_hull import carve_people
from tracker.evidence.voxels.voxel_grid import VOXEL_M
from tracker.footage.recording import Recording
from tracker.footage.video_writer import MAX_WIDTH_PX
from tracker.formats.file_names import identifiers
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, Image
from tracker.geometry.cameras import Camera
from tracker.geometry.ground_plane import floor_plane
from tracker.geometry.surface_nets import surface_nets
from tracker.interchange.exports.faces import recording_of
from tracker.interchange.exports.formats import Tick
from tracker.interchange.exports.motion import ExportedMotion, ExportOptions, file_from_world

_DEPTH_M = 0.5
"""Distance of the picture from its camera in a scene, metres: less than that of anybody whom a camera films whole."""


def write_bodies(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the body of each exported person on each frame, `ANN_000012.ply`: its parts in their colours."""
    names = identifiers([p.person.name for p in motion.exported])

    def meshes(frame: int) -> Iterator[tuple[str, trimesh.Trimesh]]:
        for name, person in zip(names, motion.exported, strict=True):
            if frame in person.poses:
                yield name, trimesh.Scene(list(part_meshes(person.body(frame)).values())).to_mesh()

    _write_frames(motion, options, paths[0], tick, meshes)


def write_hulls(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the visual hull of each figure on each frame, `hull1_000012.ply`, from the silhouettes of the footage.

    A frame on which silhouettes do not agree or show nobody has none.

    Raises:
        TrackerError: no frame has a hull; the reason is that of the first one.
    """
    session, errors = motion.session, list[TrackerError]()
    floor = floor_plane(session.up, session.floor)
    with Recording(session.cameras) as recording, closing(SilhouetteFinder(session.cameras, recording)) as finder:

        def meshes(frame: int) -> Iterator[tuple[str, trimesh.Trimesh]]:
            try:
                hull = carve_people(recover_from_shadows(finder.silhouettes(frame), floor, VOXEL_M), VOXEL_M)
            except RecordingError:
                raise
            except TrackerError as error:
                errors.append(error)
                return
            for number, figure in enumerate(hull.figures, 1):
                field = np.where(np.pad(figure.occupied, 1), np.float32(-1), np.float32(1))
                corner = figure.grid.origin - figure.grid.size_m
                yield f"hull{number}", trimesh.Trimesh(*surface_nets(field, corner, figure.grid.size_m), process=False)

        _write_frames(motion, options, paths[0], tick, meshes)
    if len(errors) == len(motion.frames):
        raise errors[0]


def _write_frames(
    motion: ExportedMotion,
    options: ExportOptions,
    folder: Path,
    tick: Tick,
    meshes: Callable[[int], Iterator[tuple[str, trimesh.Trimesh]]],
) -> None:
    """Write the named meshes of all frames, given in metres and in the world."""
    T_file_world = options.per_metre * file_from_world(motion.session, options.axes)
    T_file_world[3, 3] = 1.0
    folder.mkdir()
    for frame in motion.frames:
        for name, mesh in meshes(frame):
            mesh.apply_transform(T_file_world).export(folder / f"{name}_{frame:06d}.{options.mesh}")
        tick()


def part_meshes(body: PosedBody) -> dict[str, trimesh.Trimesh]:
    """Return the closed surfaces of a body's parts by name, in the world, metres, in their colours."""
    model, out = body.model, {}
    for part, shape, center, T in zip(
        model.parts, model.shapes, model.centers_part, body.kinematics.Ts_world_part, strict=True
    ):
        vertices, faces = shape.triangles()
        colors = np.tile([*bytes.fromhex(part.color[1:]), 255], (len(vertices), 1)).astype(np.uint8)
        points = rigid.apply(T, vertices + center)
        out[part.name] = trimesh.Trimesh(points, faces, vertex_colors=colors, process=False)
    return out


def write_scene(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the bodies on one frame, and the cameras as frusta with their pictures, as glTF; y points up.

    Pictures are undistorted. That of a damaged frame is left out.

    Raises:
        TrackerError: there are several frames.
        RecordingError: the footage cannot be read.
    """
    if len(motion.frames) != 1:
        raise TrackerError(f"expected one frame for a scene, found {len(motion.frames)}; choose one of them")
    frame, scene = motion.frames[0], trimesh.Scene()
    for name, person in zip(identifiers([p.person.name for p in motion.exported]), motion.exported, strict=True):
        if frame in person.poses:
            for part, mesh in part_meshes(person.body(frame)).items():
                scene.add_geometry(mesh, node_name=f"{name}_{part}", geom_name=f"{name}_{part}")
    with recording_of(motion, options.faces) as recording:
        for index, source in enumerate(motion.session.cameras):
            picture, camera = recording.read_view(index, frame), source.camera.pinhole
            corners = _corners(camera)
            frustum = Path3D([Line([0, i]) for i in range(1, 5)], corners)
            scene.add_geometry(frustum, node_name=f"{camera.name}_frustum")  # pyrefly: ignore[bad-argument-type]
            if picture is not None:
                surface = _picture_surface(corners[1:], source.camera.undistort_image(picture))
                scene.add_geometry(surface, node_name=f"{camera.name}_picture")
    scene.apply_transform(file_from_world(motion.session, options.axes))
    paths[0].write_bytes(scene.export(file_type="glb"))
    tick()


def _corners(camera: Camera) -> Array:
    """Return the centre of a camera without distortion and the corners of its picture in a scene, (5, 3), world."""
    width, height = camera.size
    px = np.array([(0, 0), (width, 0), (width, height), (0, height)]) - 0.5
    rays = np.column_stack([px, np.ones(4)]) @ np.linalg.inv(camera.K).T
    return rigid.apply(camera.T_world_camera, _DEPTH_M * np.vstack([np.zeros(3), rays]))


def _picture_surface(corners: Array, picture: Image) -> trimesh.Trimesh:
    """Return a rectangle that shows a picture on both sides; its corners from the upper left one, clockwise."""
    share = min(1.0, 2 * MAX_WIDTH_PX / picture.shape[1])  # sharp over half of a screen
    if share < 1:
        size = (round(share * picture.shape[1]), round(share * picture.shape[0]))
        picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    material = PBRMaterial(
        baseColorTexture=PillowImage.fromarray(picture), metallicFactor=0.0, roughnessFactor=1.0, doubleSided=True
    )
    shown = TextureVisuals(uv=np.array([(0, 1), (1, 1), (1, 0), (0, 0)]), material=material)
    return trimesh.Trimesh(corners, [(0, 2, 1), (0, 3, 2)], visual=shown, process=False)
