"""Measure what each piece of the tracker contributes (docs/decisions/by_frame.md): `tests/benchmarks/ablation.py`.

Every variant tracks the same recordings from the pose fitted to the true joints of frame 0: simulated scenes that this
script makes itself (smooth-skinned people whose bones are not the model's, clutter, noise) and, with `--data DIR`, the
recordings there. Accuracy is the mean error of the 12 limb joints; a frame is lost when one of them is off by more than
150 mm. Times depend on the machine; compare them with each other.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from doc_tables import Conditions, benchmark_parser, measured, read_words, show, table, work_folder
from true_starts import Clip, read_simulated, start_of, track_from

from tracker.body.motion.pose_steps import PredictSettings
from tracker.estimation.chamfer.paper import PAPER_BODY, paper_settings
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.fitting.contour_residuals import MatchSettings
from tracker.evaluation.metrics import evaluate_joints, joints_of_poses
from tracker.evaluation.references import read_joints
from tracker.evidence.observer import open_observer
from tracker.formats.model_toml import load_model
from tracker.session.assemble import NewSession, assemble
from tracker.session.session import load_session
from tracker.simulate import Simulation, simulate

TABLES = ("ablation",)
DEFAULT = TrackSettings()
PAPER = "the paper's (`--paper`), with its body `gavrila22`"
VARIANTS: Mapping[str, TrackSettings] = {
    "as it is": DEFAULT,
    PAPER: paper_settings(),
    "without refinement: search in three passes": replace(DEFAULT, estimate="search"),
    "without the segment filter": replace(DEFAULT, segments=False),
    "without prediction": replace(DEFAULT, predict=PredictSettings(order=0)),
    "second-degree prediction": replace(DEFAULT, predict=PredictSettings(order=2, window=4)),
    "without search for lost limbs": replace(DEFAULT, recover=None),
    "edges only": replace(DEFAULT, match=MatchSettings(silhouette=0.0)),
    "silhouette only": replace(DEFAULT, match=MatchSettings(edges=0.0, model_to_image=0.0, silhouette=1.0)),
    "model to image only": replace(DEFAULT, match=MatchSettings(image_to_model=0.0)),
    "image to model only": replace(DEFAULT, match=MatchSettings(model_to_image=0.0)),
}
SCENES = (("exercise", 21), ("dance", 21), ("reach_and_cross", 21))


def simulated(folder: Path, n_frames: int) -> list[Clip]:
    """Make the scenes."""
    made = [simulate(folder / scene, Simulation(scene, n_frames=n_frames, seed=seed)) for scene, seed in SCENES]
    return [read_simulated(session.folder, n_frames) for session in made]


def recorded(data: Path, folder: Path) -> list[Clip]:
    """The single-person recordings of a folder laid out as `walk`, `balance_real` and `fast_arms` are."""
    clips = []
    for name, height in (("walk", 1.75), ("balance_real", 1.75), ("fast_arms", 1.55)):
        reference = next((data / name).glob("*.trc"))
        assemble(
            NewSession(
                folder / name,
                calibration=data / name / "Calib.toml",
                videos=sorted((data / name).glob("*.mp4")),
                background=data / name / "background",
                heights=height,
            )
        )
        session = load_session(folder / name)
        model, joints = session.people[0].model, read_joints(reference, session.fps)
        frames = range(session.n_frames)
        clips.append(Clip(name, session, (model,), (joints,), (start_of(model, joints),), frames))
    return clips


def measure(clip: Clip, settings: TrackSettings) -> tuple[float, int, float]:
    """Mean error in mm, lost frames, frames per second."""
    (model,), (reference,), cameras = clip.models, clip.references, clip.session.cameras
    if settings == VARIANTS[PAPER]:
        model = load_model(PAPER_BODY, model.height_m)
    with open_observer(cameras) as observer:
        start = start_of(model, reference)
        began = time.perf_counter()
        found = track_from(observer, [model], [start], clip.frames, settings)
        seconds = time.perf_counter() - began
    joints = joints_of_poses(model, {f.frame: f.poses[0] for f in found}, clip.session.fps)
    errors = evaluate_joints(joints, reference, clip.frames)
    return errors.mpjpe_mm, errors.lost_frames, len(found) / seconds


def conditions(clips: Sequence[Clip]) -> Conditions:
    """Return the conditions of the measurement."""
    frames = ", ".join(f"{c.name} {len(c.frames)}" for c in clips)
    return Conditions(
        footage="simulated scenes with clutter and noise, and recordings; four cameras with backgrounds. "
        f"Frames: {frames}",
        body="`gavrila34` of the true height",
        start="pose fitted to the reference joints of frame 0",
        settings="defaults but for what the row says, first pass alone. Each cell: mean "
        "error of the 12 limb joints in mm / lost frames (a limb joint off by more than 150 mm) / frames per second",
        chosen="those of evidence, fits, searches and tracking",
        command="python tests/benchmarks/ablation.py --data DIR --write docs/decisions/by_frame.md",
    )


def main() -> None:
    """Measure and write the table."""
    parser = benchmark_parser(__doc__, data="folder with walk, balance_real and fast_arms")
    parser.add_argument("--frames", type=int, default=90, help="frames of each simulated scene")
    parser.add_argument(
        "--only", nargs="+", default=[*VARIANTS], choices=[*VARIANTS], help="variants to print; the table stays"
    )
    words = read_words(parser, TABLES)
    with work_folder(None) as folder:
        clips = simulated(folder, words.frames) + (recorded(words.data, folder) if words.data else [])
        measure(clips[0]._replace(frames=range(4)), DEFAULT)  # compiles the kernels
        variants = {name: settings for name, settings in VARIANTS.items() if name in words.only}
        rows = measured(variants, clips, measure, lambda cell: "{:.1f} mm, {} lost, {:.1f} frames/s".format(*cell))
    cells = {name: [f"{mm:.0f} / {lost} / {fps:.2g}" for mm, lost, fps in row] for name, row in rows.items()}
    to = words.write if len(rows) == len(VARIANTS) else []
    show(to, TABLES[0], conditions(clips), table([c.name for c in clips], cells))


if __name__ == "__main__":
    main()
