"""Draw the people over the footage of one view or of all, as a video."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from app.drawing import overlay_colors, overlays
from app.drawing.pictures import draw_lines, placeholder
from app.export.characters import Characters, draw_bodies
from app.session.footage_indices import footage_indices
from app.state.page_view import View
from app.state.people import ShownPose
from app.state.state import State
from tracker.footage.video_writer import AnimationWriter, VideoWriter
from tracker.geometry.arrays import Array, FloatArray, Image
from tracker.geometry.cameras import Camera
from tracker.interchange.exports.faces import recording_of
from tracker.interchange.exports.motion import ExportedMotion, ExportOptions, load_character
from tracker.session.session import Session

_LAYERS = frozenset(("contours", "hidden"))
_GRID_PX = (1920, 1080)
"""Largest width and height of a grid of views."""
_HIDDEN_SHARE = 0.35
"""Opacity of occluded contours."""
_FAR_PX = 30_000.0
"""Pixels farther out are not drawn: OpenCV counts in 32 bits."""


def write_overlay_video(
    motion: ExportedMotion, options: ExportOptions, path: Path, tick: Callable[[], None] = lambda: None
) -> None:
    """Write a video of the footage with the contours of the exported people, in original pixels.

    Args:
        motion: the poses; people who are not exported occlude, but are not drawn.
        options: `view` names one camera; without it, all views are tiles of a grid. `character` is a body that moves as
            the people do, beside each view.
        path: the file, whose end names its kind.
        tick: called after each frame.

    Raises:
        RecordingError: the footage cannot be read.
    """
    session = motion.session
    shown = [i for i, c in enumerate(session.cameras) if options.view in (None, c.camera.name)]
    cameras = [session.cameras[i].camera for i in shown]
    cast = None if options.character is None else Characters(motion, load_character(options.character))
    sizes = [(c.width * (1 if cast is None else 2), c.height) for c in cameras]
    tile = _tile_size(sizes)
    columns, rows = _grid(sizes)
    size = (columns * tile[0], rows * tile[1])
    even = (size[0] + size[0] % 2, size[1] + size[1] % 2)  # as H.264 requires
    with ExitStack() as stack:
        recording = stack.enter_context(recording_of(motion, options.faces, footage_indices()))
        writer = stack.enter_context(
            VideoWriter(path, even, session.fps, motion.calibration_note)
            if path.suffix == ".mp4"
            else AnimationWriter(path, session.fps)
        )
        for frame in motion.frames:
            picture = np.zeros((even[1], even[0], 3), np.uint8)
            drawn = drawn_paths(motion, frame, shown)
            for k, (index, camera) in enumerate(zip(shown, cameras, strict=True)):
                image = recording.read_view(index, frame)
                view = placeholder(camera.size, "frame damaged") if image is None else image.copy()
                _draw(view, camera, [p for p in drawn if p.camera == index])
                if cast is not None:
                    view = np.hstack([view, draw_bodies(cast.bodies(frame), camera)])
                _label(view, f"{camera.name}  {frame}" if len(shown) > 1 else str(frame))
                _place(picture, view, (k % columns * tile[0], k // columns * tile[1]), tile)
            writer.write(picture)
            tick()


def drawn_paths(motion: ExportedMotion, frame: int, shown: Sequence[int]) -> list[overlays.Path]:
    """Return the contours of the exported people who have a pose in a frame, in the views shown.

    Their `person` is the index into `motion.bodies(frame)`.
    """
    people = motion.bodies(frame)
    if not people:
        return []
    session = replace(motion.session, people=tuple(replace(p.person, model=body.model) for p, body in people))
    velocities = tuple(body.velocity for _, body in people)
    state = State(frame=frame, people=tuple(ShownPose(body.values, "") for _, body in people), velocities=velocities)
    view = View(_LAYERS, tuple(float(i in shown) for i in range(len(session.cameras))))
    exported = [motion.is_exported(p, frame) for p, _ in people]
    return [path for path in overlays.paths(session, state, view, None) if exported[path.person]]


def draw_people(session: Session, state: State, index: int, image: Image | None) -> Image:
    """Return the picture of one camera as filmed with the people of a state drawn over it, (h, w, 3), RGB.

    Args:
        session: with each person in the body that the state shows.
        state: the poses.
        index: of the camera.
        image: as filmed, (h, w, 3), RGB; None for a damaged frame.
    """
    camera = session.cameras[index].camera
    picture = placeholder(camera.size, "frame damaged") if image is None else image.copy()
    view = View(_LAYERS, tuple(float(i == index) for i in range(len(session.cameras))))
    _draw(picture, camera, [p for p in overlays.paths(session, state, view, None) if p.camera == index])
    return picture


def _draw(image: Image, camera: Camera, paths: Sequence[overlays.Path]) -> None:
    """Draw contours into an image as filmed: occluded ones faintly below the visible ones."""
    width = max(2, round(max(camera.size) / 640))
    for kind, share in (("hidden", _HIDDEN_SHARE), ("model", 1.0)):
        found = [p for p in paths if p.kind == kind and len(p.segments_px)]
        if not found:
            continue
        layer = image if share == 1.0 else image.copy()
        for path in found:
            draw_lines(layer, _as_filmed(camera, path.segments_px), overlay_colors.rgb(path.color), width)
        if layer is not image:
            cv2.addWeighted(layer, share, image, 1 - share, 0, dst=image)


def _as_filmed(camera: Camera, segments_px: FloatArray) -> Array:
    """Map segments x0, y0, x1, y1 in undistorted px, (N, 4), to original px, (n, 2, 2), where the lens shows them."""
    ends = segments_px.reshape(-1, 2, 2).astype(np.float64)
    near = (np.abs(ends) < _FAR_PX).all(axis=(1, 2)) & camera.within_lens(ends).all(axis=1)
    return camera.distort_points(ends[near])


def _label(image: Image, text: str) -> None:
    """Write a line into the upper left corner, legible on any ground."""
    scale = max(image.shape[:2]) / 960
    at = (round(16 * scale), round(36 * scale))
    for color, width in (((0, 0, 0), 7), ((255, 255, 255), 2)):
        cv2.putText(image, text, at, cv2.FONT_HERSHEY_SIMPLEX, scale, color, max(1, round(width * scale)), cv2.LINE_AA)


def _grid(sizes: Sequence[tuple[int, int]]) -> tuple[int, int]:
    """Return the number of columns and rows in which the views are largest, with as few empty tiles as possible."""
    grids = [(columns, -(-len(sizes) // columns)) for columns in range(1, len(sizes) + 1)]
    return min(
        grids, key=lambda grid: (-round(_share(sizes, grid), 6), grid[0] * grid[1], abs(grid[0] - grid[1]), -grid[0])
    )


def _share(sizes: Sequence[tuple[int, int]], grid: tuple[int, int]) -> float:
    """Return the scale, at most 1, at which views of some widths and heights fit into a grid of columns and rows."""
    width, height = np.max(sizes, axis=0)
    return float(min(1.0, _GRID_PX[0] / (grid[0] * width), _GRID_PX[1] / (grid[1] * height)))


def _tile_size(sizes: Sequence[tuple[int, int]]) -> tuple[int, int]:
    """Return the width and height of each view in the video: its own, or what a grid has room for."""
    width, height = (int(n) for n in np.max(sizes, axis=0))
    if len(sizes) == 1:
        return width, height
    share = _share(sizes, _grid(sizes))
    return round(width * share) // 2 * 2, round(height * share) // 2 * 2


def _place(picture: Image, image: Image, at: tuple[int, int], tile: tuple[int, int]) -> None:
    """Copy an image into a tile of a picture, reduced to fit and centred."""
    share = min(tile[0] / image.shape[1], tile[1] / image.shape[0])
    if share != 1.0:
        size = (max(1, int(image.shape[1] * share)), max(1, int(image.shape[0] * share)))
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    x, y = at[0] + (tile[0] - image.shape[1]) // 2, at[1] + (tile[1] - image.shape[0]) // 2
    picture[y : y + image.shape[0], x : x + image.shape[1]] = image
