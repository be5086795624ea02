"""`quadrille track`: track people and store the poses; the same command resumes an interrupted run."""

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from app.cli.arguments import Names, OptionalName, OptionalNumber, OptionalRange, OptionalWhole, SessionArg
from app.cli.json_output import format_json
from app.cli.target import Target, check_stride, load_target, parse_frames
from app.cli.track_report import format_summary, summarize
from app.runtime.progress import Reporter
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.pipeline.find_people import FindSettings
    from tracker.pipeline.stored_run import TrackPlan
    from tracker.session.session import Session
    from tracker.tracking.estimation.settings import EstimationSettings
    from tracker.tracking.tracker import TrackerSettings


@dataclass(frozen=True)
class TrackArguments:
    """Arguments of `quadrille track`."""

    session: SessionArg
    """session folder."""
    method: Literal["chamfer", "contour", "voxel"] = "chamfer"
    """chamfer: edges; predicted, refined by Gauss-Newton, and searched if that does not suffice. contour: extremal
    contours, refined by Gauss-Newton until it converges, without a search of whole bodies. voxel: a Kalman filter on
    the parts of the body, measured by the voxels of the silhouettes."""
    init: Literal["auto"] | None = None
    """auto finds people who have no pose first, on the frame where they track best, and tracks from there in both
    directions."""
    acquire: bool = False
    """with --init auto: acquire the sizes of those people from the contours before tracking."""
    frames: OptionalRange = None
    """A:B, half open; all by default."""
    stride: int = 1
    """track every Nth frame alone; the frames between get no pose, and the page can interpolate them."""
    cameras: Names = ()
    """names of the cameras to track with; all by default."""
    person: OptionalName = None
    """name of the person to track; all people by default."""
    backward: bool = False
    """from the last frame of the range to the first."""
    theta: OptionalNumber = None
    """outlier distance in pixels; 3% of the longer side of the image by default."""
    order: OptionalWhole = None
    """degree of the motion model: 0 stays, 1 constant velocity (default), 2 constant acceleration (with --paper)."""
    window: OptionalWhole = None
    """past frames that the motion is estimated from; 3 by default, 8 with --paper."""
    paper: bool = False
    """as the method's paper: chamfer as Gavrila and Davis 1996, in a session made with --model gavrila22; contour as
    Knossow, Ronfard and Horaud 2008; voxel as Mikic and others 2001, in a session made with --model mikic10. See
    docs/trackers.md."""
    image_contours: Literal["edges", "silhouettes"] | None = None
    """contour: what the model's contours are compared with; edges by default, silhouettes with --paper."""
    sliding: bool = True
    """contour: whether the Jacobian has the term of contours that slide on the surface."""
    voxel_size: OptionalNumber = None
    """voxel: edge of a voxel, mm; 30 by default, 50 with --paper."""
    sizes: Literal["frozen", "first", "always"] | None = None
    """voxel: when part sizes are estimated: never, on the first frame (default), or on all frames (with --paper)."""
    backward_pass: bool = True
    """at the end, track lost people backward from the first trusted poses after the loss."""
    smooth: bool = True
    """at the end, smooth the poses over time; keyframes stay."""
    json: bool = False
    """print one JSON object."""


def command(arguments: Annotated[TrackArguments, tyro.conf.arg(name="")]) -> None:
    """Track people through a range of frames and store the poses.

    Ctrl+C stops it and keeps the poses found so far; run it again to resume.
    """
    from tracker.pipeline.stored_run import TrackPlan
    from tracker.session.matching import check_names

    at = load_target(arguments.session, arguments.person, several=True)
    ascending = parse_frames(arguments.frames, at.session)[:: check_stride(arguments.stride)]
    frames = ascending[::-1] if arguments.backward else ascending
    _check_chain(arguments)
    settings = _SETTINGS[arguments.method](arguments)
    if arguments.paper:
        _require_paper_body(at, arguments.method)
    used = check_names(arguments.cameras, [c.camera.name for c in at.session.cameras], "camera", "--cameras")
    plan = TrackPlan(frames, at.people, settings, tuple(used))
    found = track(at.session, plan, Reporter(silent=arguments.json), _found_by(arguments))
    print(format_json(found) if arguments.json else format_summary(found))
    if found["stopped_at"] is not None:
        sys.exit(130)


def _found_by(arguments: TrackArguments) -> "FindSettings | None":
    """Return how people without a pose are found; None where nobody is looked for."""
    from tracker.pipeline.find_people import FindSettings

    return None if arguments.init is None else FindSettings(acquire=arguments.acquire)


def _check_chain(arguments: TrackArguments) -> None:
    """Raise a `TrackerError` where options contradict `--init`."""
    if arguments.init is not None and arguments.backward:
        raise TrackerError("expected --init without --backward, found both; it tracks in both directions by itself")
    if arguments.acquire and arguments.init is None:
        raise TrackerError(
            "expected --acquire with --init auto, found it alone; add --init auto, or run quadrille acquire first"
        )


def _chamfer_settings(arguments: TrackArguments) -> "TrackerSettings":
    from tracker.tracking.chamfer.paper import paper_settings
    from tracker.tracking.chamfer.settings import TrackSettings

    if arguments.image_contours is not None or not arguments.sliding:
        raise TrackerError(
            "expected --image-contours and --no-sliding with the contour method, found the method 'chamfer'; "
            "add --method contour, or leave them out"
        )
    _reject(arguments, "chamfer", voxel_size=arguments.voxel_size, sizes=arguments.sizes)
    settings = paper_settings() if arguments.paper else TrackSettings(backward_pass=arguments.backward_pass)
    return _shared_settings(settings, arguments)


def _contour_settings(arguments: TrackArguments) -> "TrackerSettings":
    from tracker.tracking.contour.paper import paper_settings
    from tracker.tracking.contour.settings import ContourSettings, with_sliding

    _reject(arguments, "contour", voxel_size=arguments.voxel_size, sizes=arguments.sizes)
    wanted = arguments.image_contours
    if arguments.paper:
        return _shared_settings(paper_settings(wanted or "silhouettes", arguments.sliding), arguments)
    settings = ContourSettings(backward_pass=arguments.backward_pass, image_contours=wanted or "edges")
    return _shared_settings(with_sliding(settings, arguments.sliding), arguments)


def _shared_settings(settings: "EstimationSettings", arguments: TrackArguments) -> "TrackerSettings":
    from tracker.tracking.estimation.settings import at_stride

    motion, order, window = settings.predict, arguments.order, arguments.window
    motion = replace(
        motion, order=motion.order if order is None else order, window=motion.window if window is None else window
    )
    chosen = replace(
        settings, predict=motion, theta_px=arguments.theta, smooth=arguments.smooth and not arguments.paper
    )
    return at_stride(chosen, arguments.stride)


def _voxel_settings(arguments: TrackArguments) -> "TrackerSettings":
    from tracker.tracking.voxel.paper import paper_settings
    from tracker.tracking.voxel.settings import VoxelSettings

    _reject(arguments, "voxel", theta=arguments.theta, order=arguments.order, window=arguments.window)
    settings = paper_settings() if arguments.paper else VoxelSettings(smooth=arguments.smooth)
    if arguments.voxel_size is not None:
        settings = replace(settings, voxel_m=arguments.voxel_size / 1000)
    return settings if arguments.sizes is None else replace(settings, sizes=arguments.sizes)


def _reject(arguments: TrackArguments, method: str, **values: object) -> None:
    """Refuse options that a method does not have.

    Raises:
        TrackerError: one of them is given.
    """
    given = ", ".join(f"--{name.replace('_', '-')}" for name, value in values.items() if value is not None)
    if given:
        raise TrackerError(
            f"expected options of the method '{method}', found {given}; leave them out, or choose another --method"
        )


def _require_paper_body(at: Target, method: str) -> None:
    from tracker.tracking.chamfer import paper as chamfer
    from tracker.tracking.voxel import paper as voxel

    bodies = {p.name: p.model for p in (at.session.people[i] for i in at.people)}
    if method == "chamfer":
        chamfer.require_paper_body(bodies)
    elif method == "voxel":
        voxel.require_paper_body(bodies)


_SETTINGS: Mapping[str, "Callable[[TrackArguments], TrackerSettings]"] = {
    "chamfer": _chamfer_settings,
    "contour": _contour_settings,
    "voxel": _voxel_settings,
}
"""Makes the settings of each method (`METHODS`) from the arguments."""


def track(
    session: "Session", plan: "TrackPlan", progress: Reporter, find: "FindSettings | None" = None
) -> dict[str, Any]:
    """Track people and store their poses as one entry of the history.

    Keyframes and locked degrees of freedom keep their values. An interrupted run keeps its poses; run it again
    to resume.

    Args:
        session: the session.
        plan: what to track.
        progress: shows how far it is.
        find: how people without a pose are found, from whom the run goes out in both directions; None: a run from the
            first frame of the plan to its last.

    Returns:
        See `track_report.summarize`.

    Raises:
        SessionError: a person has no pose at or before the first frame.
    """
    from app.cli.chain_progress import ChainProgress
    from tracker.compute.kernel_cache import compiled_mark
    from tracker.pipeline.chain import open_stored_session, run_chain

    is_stopped = False
    with open_stored_session(session) as opened, ChainProgress(progress) as sink:
        if opened.backup_error is not None:
            progress.say(opened.backup_error)
        if not compiled_mark().exists():
            progress.say("kernels that are not compiled yet are compiled first, once: it may take a minute or two")
        try:
            plan = opened.track(plan, sink) if find is None else run_chain(plan, find, opened, sink)
        except KeyboardInterrupt:
            is_stopped = True
    if opened.run is None or opened.plan is None:
        print("stopped before anybody was found; nothing was stored", file=sys.stderr)
        sys.exit(130)
    return summarize(opened.session, opened.plan, opened.run, is_stopped)
