"""The command line: `quadrille COMMAND ...`; without a command, the page on the bundled sample."""

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from rich.console import Console

from app.cli import actions
from app.cli.arguments import common_or_pairs, pairs
from app.runtime import process_exit
from app.runtime.malloc_trim import give_back_freed_memory
from app.runtime.progress import Reporter
from tracker.errors import TrackerError

SessionArg = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="SESSION", help="session folder")]
_app = tyro.extras.SubcommandApp()


@_app.command(name="open")
def open_(
    session: Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="SESSION")] = None,
    /,
    host: str = "127.0.0.1",
    port: int = 8080,
    allow_host: tuple[str, ...] = (),
    browser: bool = True,
    sample: str | None = None,
    start_again: bool = False,
) -> None:
    """Open a session in the page; without SESSION, a working copy of a bundled sample.

    Args:
        session: session folder.
        host: address to listen at; anything but loopback needs --allow-host.
        port: port to listen at; 0 takes a free one.
        allow_host: names by which browsers may call this machine.
        browser: open the page in the default browser.
        sample: which sample: tango, two people to be placed by hand (the default), or elbow_rotation, one person.
        start_again: throw away the working copy of the sample and make a new one.
    """
    from app.server.workbench import Serving, open_session
    from app.session.samples import DEFAULT_SAMPLE, sample_copy

    if session is not None and (sample is not None or start_again):
        raise TrackerError(
            f"expected a session or a sample, found {session} and {'--sample' if sample else '--start-again'}; "
            "leave one of them out"
        )
    folder = sample_copy(sample or DEFAULT_SAMPLE, start_again) if session is None else session
    open_session(folder, Serving(host, port, allow_host, browser), lambda line: print(line, flush=True))


@_app.command
def new(
    session: SessionArg,
    /,
    calibration: Path,
    videos: tuple[Path, ...] = (),
    camera: tuple[str, ...] = (),
    background: Path | None = None,
    masks: Path | None = None,
    offset: tuple[str, ...] = (),
    people: tuple[str, ...] = ("person",),
    model: tuple[str, ...] = (),
    height: tuple[str, ...] = (),
    fps: float | None = None,
    up: Literal["x", "y", "z", "-x", "-y", "-z"] = "z",
    units: Literal["m", "mm"] = "m",
) -> None:
    """Make a session from videos and a calibration.

    Args:
        session: folder to make.
        calibration: TOML file in the anipose / Pose2Sim layout.
        videos: video files or image folders, each named after its camera.
        camera: NAME=PATH: footage of a camera, whatever the file is called.
        background: folder of CAM.png or CAM.mp4 of the empty scene.
        masks: folder of CAM/%06d.png by video frame; 0 is background.
        offset: CAM=N: frame k of the session is frame k + N of this camera.
        people: names of the people.
        model: body model of everybody, or NAME=MODEL.
        height: body height in metres of everybody, or NAME=METRES.
        fps: frame rate, where all footage is folders of images.
        up: world axis that points up.
        units: unit of the calibration's translations.
    """
    from tracker.session.assemble import DEFAULT_MODEL, assemble

    made = assemble(
        session,
        calibration=calibration,
        videos=videos,
        camera_paths=pairs(camera, "--camera", str),
        background=background,
        masks=masks,
        offsets=pairs(offset, "--offset", int),
        people=people,
        models=common_or_pairs(model, "--model", str) or DEFAULT_MODEL,
        heights=common_or_pairs(height, "--height", float),
        fps=fps,
        up=up,
        units=units,
    )
    print(f"made {made.folder}: {len(made.cameras)} cameras, {made.n_frames} frames at {made.fps:g} per second")


@_app.command
def info(session: SessionArg, /, json: bool = False) -> None:
    """Say what a session holds.

    Args:
        session: session folder.
        json: print one JSON object.
    """
    from tracker.session.session import load_session

    found = actions.info(load_session(session))
    if json:
        print(actions.as_json(found))
        return
    print(f"{found['name']}: {found['frames']} frames at {found['fps']:g} per second, up is {found['up']}")
    for c in found["cameras"]:
        extras = "".join(f", {name}" for name in ("background", "masks") if c[name])
        shift = f", offset {c['offset']}" if c["offset"] else ""
        print(f"  camera {c['name']}: {c['size'][0]}x{c['size'][1]}, {c['footage']}{extras}{shift}")
    for p in found["people"]:
        body = f"{p['model']} of {p['height_m']:.2f} m, {p['dofs']} degrees of freedom"
        print(f"  person {p['name']}: {body}, {p['poses']} poses, {p['keyframes']} keyframes")


@_app.command
def index(session: SessionArg, /, json: bool = False) -> None:
    """Make pictures of all frames of the videos, so that the page shows any of them at once.

    They go into the session's folder, some 50 KB for each frame of 640x480 pixels. Stopped with Ctrl+C, the same call
    goes on where it was. Searching and tracking go on to use the videos.

    Args:
        session: session folder.
        json: print one JSON object.
    """
    from app.session.proxies import index as make
    from tracker.session.session import load_session

    found = make(load_session(session), Reporter(silent=json))
    if json:
        print(actions.as_json(found))
    else:
        frames = ", ".join(f"{name} {n}" for name, n in found["frames"].items())
        print(f"{found['folder']}: {frames} frames, {found['bytes'] / 1e6:.0f} MB" if frames else "no videos to index")
    if found["stopped"]:
        print("stopped; the same call goes on from here", file=sys.stderr)
        sys.exit(1)


@_app.command
def init(
    session: SessionArg,
    /,
    joints: Path | None = None,
    poses: Path | None = None,
    method: Literal["joints", "poses"] = "joints",
    frame: int = 0,
    person: str | None = None,
    fit_sizes: bool = False,
    joint_map: Path | None = None,
    axes: str = "x,y,z",
    json: bool = False,
) -> None:
    """Set a first pose.

    Args:
        session: session folder.
        joints: TRC file of 3-D joints.
        poses: table of poses (CSV), as `simulate` writes it.
        method: joints fits the pose to known joints; poses takes it from a table as it is.
        frame: frame to set.
        person: name; needed where there are several.
        fit_sizes: take the body's segment lengths from the joints of all frames too.
        joint_map: TOML file that maps the file's joint names to the body's.
        axes: the file's axes in the session's order, such as x,-z,y.
        json: print one JSON object.
    """
    from tracker.evaluation.references import read_joints
    from tracker.formats.pose_csv import read_pose_table

    at = actions.target(session, person, several=False)
    actions.frame_range(f"{frame}:{frame + 1}", at.session)
    given = {"joints": joints, "poses": poses}[method]
    if given is None:
        raise TrackerError(f"expected --{method} FILE, found none; say where the {method} are")

    if method == "poses":
        found = actions.init_from_poses(at, frame, read_pose_table(given))
        print(actions.as_json(found) if json else f"{found['person']}, frame {frame}: set from {given}")
        return
    found = actions.init_from_joints(at, frame, read_joints(given, at.session.fps, joint_map, axes), fit_sizes)
    residual = f"{found['mean_mm']:.1f} mm from {len(found['residual_mm'])} joints on average"
    print(actions.as_json(found) if json else f"{found['person']}, frame {frame}: {residual}")


@_app.command
def track(
    session: SessionArg,
    /,
    method: Literal["chamfer"] = "chamfer",
    frames: str | None = None,
    person: str | None = None,
    backward: bool = False,
    theta: float | None = None,
    order: int = 1,
    window: int = 3,
    paper: bool = False,
    second_pass: bool = True,
    json: bool = False,
) -> None:
    """Track people through a range of frames and store the poses.

    Stopped with Ctrl+C it keeps what is done; the same command again goes on from there.

    Args:
        session: session folder.
        method: chamfer: edges; predicted, refined by Gauss-Newton, and searched where that does not suffice.
        frames: A:B, half open; all by default.
        person: whom; everybody by default.
        backward: from the last frame of the range to the first.
        theta: outlier distance in pixels; 3% of the longer side of the image by default.
        order: degree of the motion model: 0 stays, 1 constant velocity, 2 constant acceleration.
        window: past frames that the motion is taken from.
        paper: as Gavrila and Davis 1996: best-first search alone, in one pass, outliers rejected.
        second_pass: at the end, follow whoever was lost back from the first trusted poses after it.
        json: print one JSON object.
    """
    from app.cli import track as headless
    from tracker.motion.prediction import PredictSettings
    from tracker.search.best_first import SearchSettings
    from tracker.tracking.chamfer.settings import TrackSettings

    at = actions.target(session, person, several=True)
    wanted: Sequence[int] = actions.frame_range(frames, at.session)
    passes = (1.0,) if paper else SearchSettings().passes
    settings = TrackSettings(
        estimate="search" if paper else "refine",
        predict=PredictSettings(order, window),
        search=SearchSettings(passes=passes),
        theta_px=theta,
        outliers="paper" if paper else "truncated",
        second_pass=second_pass and not paper,
    )
    found = headless.track(at, wanted[::-1] if backward else wanted, settings, Reporter(silent=json))
    print(actions.as_json(found) if json else _track_summary(found))
    if found["stopped_at"] is not None:
        sys.exit(130)


@_app.command
def evaluate(
    session: SessionArg,
    /,
    reference: Path,
    frames: str | None = None,
    person: str | None = None,
    joint_map: Path | None = None,
    axes: str = "x,y,z",
    align: Literal["none", "rigid-all"] = "none",
    json: bool = False,
) -> None:
    """Compare stored poses with a reference: mean errors of the limb joints, lost frames, angles.

    Joints and parts are compared by name, so that the reference may be of another body model.

    Args:
        session: session folder.
        reference: TRC file, pose table (CSV; its body in NAME_model.toml beside it) or session folder.
        frames: A:B, half open; from the first to the last pose by default.
        person: name; needed where there are several.
        joint_map: TOML file that maps the file's joint names to the body's.
        axes: the file's axes in the session's order, such as x,-z,y.
        align: rigid-all moves the whole reference onto the estimate first.
        json: print one JSON object.
    """
    from tracker.evaluation.references import read_reference

    at = actions.target(session, person, several=False)
    found = actions.evaluate(at, read_reference(reference, at.session, at.people[0], joint_map, axes), frames, align)
    if json:
        print(actions.as_json(found))
        return
    print(
        f"{found['person']}: {found['frames']} frames, {found['missing_frames']} missing, {found['lost_frames']} lost"
    )
    print(f"  MPJPE {found['mpjpe_mm']:.1f} mm, median {found['median_mm']:.1f}, 95% {found['p95_mm']:.1f}")
    for joint, error in found["per_joint_mm"].items():
        print(f"  {joint.replace('_', ' '):16} {error:6.1f} mm")
    if found["axis_error_deg"] is not None:
        worst = f"{found['worst_axis_error_deg']:.2f} in frame {found['worst_axis_frame']}"
        print(f"  part axes {found['axis_error_deg']:.2f} deg, worst frame's mean {worst}")
        print(f"  without twist {found['long_axis_error_deg']:.2f} deg")
        for part, error in found["per_part_axis_deg"].items():
            print(f"  {part.replace('_', ' '):16} {error:6.2f} deg")


@_app.command
def simulate(
    out: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="OUT")],
    /,
    scene: str = "elbow_rotation",
    cameras: int = 4,
    frames: int = 50,
    seed: int = 0,
    masks: bool = False,
    body: Literal["skinned", "model"] = "skinned",
) -> None:
    """Make a session of a simulated recording with known truth.

    Args:
        out: folder to make.
        scene: what the person does.
        cameras: number of cameras.
        frames: number of frames.
        seed: of all that is random.
        masks: write true masks too.
        body: skinned, a smooth body unlike the model; model, the very shapes that are fitted.
    """
    from tracker.simulate import simulate as run

    reporter = Reporter()
    with reporter.over(frames * cameras, "rendering") as tick:  # one tick per image
        run(
            out, scene=scene, n_cameras=cameras, n_frames=frames, seed=seed, body=body, masks=masks,
            progress=lambda *_: tick(),
        )  # fmt: skip
    print(f"made {out}")


@_app.command
def bench(json: bool = False, baseline: Path | None = None, save: Path | None = None, tolerance: float = 0.4) -> None:
    """Measure how fast the tracker is on this machine, and compare with what is kept; status 1 where it became slower.

    Args:
        json: print one JSON object.
        baseline: file to compare with; that of the program by default.
        save: keep the ratios in this file instead of comparing them.
        tolerance: with --save, the share by which a ratio may later be worse.
    """
    from app.bench import report as measuring

    kept = {"tolerance": tolerance, "ratios": {}} if save else measuring.read_baseline(baseline or measuring.BASELINE)
    rows = []
    with Reporter(silent=json).over(measuring.N_ROWS, "measuring") as tick:
        for row in measuring.measure():
            rows.append(row)
            tick()
    if save:
        measuring.save_baseline(rows, save, tolerance)
    found = measuring.report(rows, kept)
    if json:
        print(actions.as_json(found))
    else:
        measuring.show(found, Console())
    if found["slower"]:
        sys.exit(1)


def _track_summary(found: Mapping[str, Any]) -> str:
    again = "" if found["resumed_at"] is None else f", going on from frame {found['resumed_at']}"
    lines = [f"tracked {', '.join(found['people'])} over {found['frames']} frames{again}"]
    if found["mean_cost_px"] is not None:
        lines[0] += f", mean cost {found['mean_cost_px']:.2f} px"
    for name, statuses in found["statuses"].items():
        odd = [f"{statuses[s]} {s}" for s in ("good", "doubtful", "lost") if statuses.get(s)]
        lines.append(f"{name}: {', '.join(odd)}")
    if found["followed_back"]:
        lines.append(f"{found['followed_back']} poses of frames in which somebody was lost are from the second pass")
    if found["stopped_at"] is not None:
        lines.append(f"stopped before frame {found['stopped_at']}; the same command again goes on from there")
    return "\n".join(lines)


def main() -> None:
    """Run the command line; what users and files get wrong is one sentence on standard error and status 1."""
    words = sys.argv[1:]
    if not words or (words[0] not in _app._subcommands and words[0] not in ("-h", "--help")):
        words = ["open", *words]
    try:
        _app.cli(prog="quadrille", args=words)
        sys.stdout.flush()
    except TrackerError as error:
        Console(stderr=True).print(
            f"quadrille: {error}", style="bold red", markup=False, highlight=False, soft_wrap=True
        )
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
    except BrokenPipeError:  # as in `quadrille evaluate S | head -1`: who read has read enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is still held back goes nowhere
        sys.exit(141)


def program() -> None:
    """`main` as a process of its own."""
    give_back_freed_memory()
    process_exit.run(main)


if __name__ == "__main__":
    program()
