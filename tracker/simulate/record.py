"""Make a session folder of a simulated recording, with the truth about it."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path
from typing import Literal, get_args

import cv2
import numpy as np

from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.files import write_text_atomic
from tracker.footage.camera_source import CameraSource
from tracker.footage.video import open_footage
from tracker.footage.video_writer import VideoWriter
from tracker.formats.model_toml import format_model, load_model
from tracker.formats.pose_csv import write_pose_table
from tracker.formats.trc import write_trc
from tracker.geometry.arrays import Array, Image
from tracker.geometry.cameras import Camera
from tracker.session.folder import appearing, require_free
from tracker.session.session import PALETTE, Person, Session, load_session, save_session
from tracker.session.store.records import derived_uid
from tracker.simulate.motion.postures import Role, solve_posture
from tracker.simulate.motion.scenes import cast_of
from tracker.simulate.people.model_figure import ModelFigure
from tracker.simulate.people.skeleton import altered_model
from tracker.simulate.people.skin import make_skin
from tracker.simulate.stage.camera_rig import make_cameras
from tracker.simulate.stage.film import exposed, film, freeze
from tracker.simulate.stage.rasterizer import Figure
from tracker.simulate.stage.room import Backdrop, see_room

BodyKind = Literal["skinned", "model"]
Progress = Callable[[int, int], None]

PRESET = "gavrila22"
BACKGROUND_FRAMES = 3
"""Frames filmed of the empty room. The last one is stored, because the codec has settled by then."""


@dataclass(frozen=True)
class Simulation:
    """The parameters of a simulated recording. Equal parameters give equal footage."""

    scene: str = "elbow_rotation"
    """One of `scenes.SCENES`."""
    n_cameras: int = 4
    """Number of cameras; 4 are FRONT, RIGHT, BACK and LEFT in the corners, others are spread around the room."""
    n_frames: int = 50
    """Number of frames."""
    seed: int = 0
    """Seed of the room, the differences of the cameras, the noise, and the motion of scenes that vary."""
    size: tuple[int, int] = (640, 480)
    """Image width and height, px, both even."""
    fps: float = 25.0
    """Frame rate, 1/s."""
    body: BodyKind = "skinned"
    """`skinned`: a smooth-skinned person with other bones than the preset's; `model`: the preset's own parts."""
    person: str = ""
    """Who plays a scene of one person, see `population.POPULATION`; the usual adult if empty."""
    masks: bool = False
    """Whether to write true masks too, `masks/CAM/%06d.png`: 0 background, k person k."""
    fisheyes: tuple[str, ...] = ()
    """Names of the cameras with a fisheye lens, or `all`."""
    room: str = "laboratory"
    """One of `furniture.ROOMS`."""


_DEFAULT = Simulation()


def simulate(out: str | Path, simulation: Simulation = _DEFAULT, progress: Progress | None = None) -> Session:
    """Make a session folder of a simulated recording; it appears complete or not at all.

    Besides the session it has `truth.trc` (joint centres, metres), `truth.csv` (poses of the true skeleton) and
    `truth_model.toml` (that skeleton). With several people there is one of each per person: `truth_NAME.trc`,
    `truth_NAME.csv` and `truth_NAME_model.toml`. The session's people have the preset at the true body height.

    Args:
        out: the folder; must not exist, or be empty.
        simulation: parameters of the recording.
        progress: called with the number of images made and their total.

    Raises:
        TrackerError: a parameter is impossible.
        SessionError: the folder is in use or cannot be written.
    """
    n_frames, fps, seed, body = simulation.n_frames, simulation.fps, simulation.seed, simulation.body
    out = Path(out).absolute()
    _check(out, n_frames, fps, body)
    cast = cast_of(simulation.scene, seed, simulation.person)
    cameras = make_cameras(simulation.n_cameras, simulation.size, seed, simulation.fisheyes)
    presets = [load_model(PRESET, role.height_m) for role in cast]
    models = [
        altered_model(m, r.build.bone_factors) if body == "skinned" else m for r, m in zip(cast, presets, strict=True)
    ]
    poses = [solve_posture(role, model, n_frames, fps) for role, model in zip(cast, models, strict=True)]
    with appearing(out) as temporary:
        sources = [_source(temporary, c, simulation.masks) for c in cameras]
        figures = [_figure(role, model, body) for role, model in zip(cast, models, strict=True)]
        backdrops = [see_room(c, seed, simulation.room) for c in cameras]
        _shoot(sources, backdrops, figures, poses, simulation, progress)
        _write_truth(temporary, cast, models, poses, fps)
        people = [Person(r.name, m, color) for r, m, color in zip(cast, presets, cycle(PALETTE), strict=False)]
        uid = derived_uid(repr(simulation))  # the same arguments, the same recording
        save_session(Session(temporary, out.name, float(fps), n_frames, tuple(sources), tuple(people), uid=uid))
    return load_session(out)


def _check(out: Path, n_frames: int, fps: float, body: str) -> None:
    require_free(out)
    if n_frames < 1 or not 0 < fps <= 1000:
        raise TrackerError(
            f"expected at least one frame and a rate of 1 to 1000 frames a second, found {n_frames} and {fps:g}"
        )
    if body not in get_args(BodyKind):
        raise TrackerError(f"expected a body that is one of {', '.join(get_args(BodyKind))}, found '{body}'")


def _figure(role: Role, model: BodyModel, body: BodyKind) -> Figure:
    return make_skin(model, role.outfit, role.build) if body == "skinned" else ModelFigure(model)


def _source(folder: Path, camera: Camera, masks: bool) -> CameraSource:
    return CameraSource(
        camera,
        folder / f"{camera.name}.mp4",
        folder / "background" / f"{camera.name}.png",
        folder / "masks" / camera.name if masks else None,
    )


def _shoot(
    sources: Sequence[CameraSource],
    backdrops: Sequence[Backdrop],
    figures: Sequence[Figure],
    poses: Sequence[Array],
    simulation: Simulation,
    progress: Progress | None,
) -> None:
    """Film the empty room, then the people, with all cameras."""
    fps, rngs = simulation.fps, [np.random.default_rng([simulation.seed, 3, i]) for i in range(len(sources))]
    for source, backdrop, rng in zip(sources, backdrops, rngs, strict=True):
        _shoot_background(source, backdrop, fps, rng)
    done, total = 0, len(poses[0]) * len(sources)
    with ExitStack() as stack:
        writers = [stack.enter_context(VideoWriter(s.footage, s.camera.size, fps)) for s in sources]
        for k, values in enumerate(zip(*poses, strict=True)):
            moment = freeze(figures, values)
            for source, backdrop, rng, writer in zip(sources, backdrops, rngs, writers, strict=True):
                image, mask = film(backdrop, moment)
                writer.write(exposed(image, rng))
                if source.masks is not None:
                    source.masks.mkdir(parents=True, exist_ok=True)
                    _write_png(source.masks / f"{k:06d}.png", mask)
                done += 1
                if progress is not None:
                    progress(done, total)


def _shoot_background(source: CameraSource, backdrop: Backdrop, fps: float, rng: np.random.Generator) -> None:
    """Write the empty room as the same camera and codec record it, with independent noise."""
    assert source.background is not None
    source.background.parent.mkdir(exist_ok=True)
    clip = source.background.with_suffix(".mp4")
    with VideoWriter(clip, source.camera.size, fps) as writer:
        for _ in range(BACKGROUND_FRAMES):
            writer.write(exposed(backdrop.image, rng))
    footage = open_footage(clip, source.camera.name)
    image = footage.read(BACKGROUND_FRAMES - 1)
    footage.close()
    assert image is not None
    _write_png(source.background, np.ascontiguousarray(image[..., ::-1]))
    clip.unlink()


def _write_png(path: Path, image: Image) -> None:
    """Write a gray (H, W) or BGR (H, W, 3) image."""
    done, data = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 9])
    assert done
    path.write_bytes(data.tobytes())


def _write_truth(
    folder: Path, cast: Sequence[Role], models: Sequence[BodyModel], poses: Sequence[Array], fps: float
) -> None:
    for role, model, values in zip(cast, models, poses, strict=True):
        suffix = "" if len(cast) == 1 else f"_{role.name}"
        # The root lies within the trunk; no marker set has it.
        marked = [i for i, name in enumerate(model.point_names) if name != model.joints[0].name]
        points = np.array([model.points_world(v)[marked] for v in values])
        write_trc(folder / f"truth{suffix}.trc", [model.point_names[i] for i in marked], points, fps)
        write_pose_table(folder / f"truth{suffix}.csv", model, values)
        write_text_atomic(folder / f"truth{suffix}_model.toml", format_model(model))
