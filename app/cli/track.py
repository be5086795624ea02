"""`quadrille track`: track people and store the poses; the same command resumes an interrupted run."""

import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from app.cli.arguments import Names, OptionalName, OptionalNumber, OptionalRange, OptionalWhole, SessionArg
from app.cli.json_output import format_json
from app.cli.target import Target, check_stride, load_target, parse_frames
from app.runtime.progress import Reporter
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.pipeline.track_session import TrackSession
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
    at = load_target(arguments.session, arguments.person, several=True)
    ascending = parse_frames(arguments.frames, at.session)[:: check_stride(arguments.stride)]
    frames = ascending[::-1] if arguments.backward else ascending
    _check_chain(arguments)
    settings = _SETTINGS[arguments.method](arguments)
    if arguments.paper:
        _require_paper_body(at, arguments.method)
    progress = Reporter(silent=arguments.json)
    if arguments.init is None:
        found = track(at, frames, settings, progress, arguments.cameras)
    else:
        from app.cli.track_found import track_found

        try:
            found = track_found(
                at, ascending, arguments.acquire, progress,
                lambda people, own: track(people, own, settings, progress, arguments.cameras),
            )  # fmt: skip
        except KeyboardInterrupt:
            print("stopped before anybody was found; nothing was stored", file=sys.stderr)
            sys.exit(130)
    print(format_json(found) if arguments.json else _format(found))
    if found["stopped_at"] is not None:
        sys.exit(130)


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
    at: Target,
    frames: Sequence[int],
    settings: "TrackerSettings",
    progress: Reporter,
    cameras: Sequence[str] = (),
) -> dict[str, Any]:
    """Track people and store their poses as one entry of the history.

    Keyframes and locked degrees of freedom keep their values. An interrupted run keeps its poses; run it again
    to resume.

    Args:
        at: the session and the people to track.
        frames: in the order of tracking.
        settings: of the tracker, which name its method.
        progress: shows how far it is.
        cameras: names of those to track with; all if empty.

    Returns:
        A summary. `stopped_at` is the frame where it was interrupted, else None; `improved_backward` is the number of
        poses that the backward pass improved. `normal_matrices` has rank and conditioning by person, for methods that
        compute them.

    Raises:
        SessionError: a person has no pose at or before the first frame, or a camera is unknown.
    """
    import numpy as np

    from tracker.compute.kernel_cache import compiled_mark
    from tracker.evidence.observer import Observer
    from tracker.footage.recording import Recording
    from tracker.pipeline.stored_run import TrackTask, stored_run
    from tracker.session.lock import SessionLock
    from tracker.session.matching import check_names
    from tracker.session.relink import require_files
    from tracker.store.annotation_store import AnnotationStore

    session, stopped = at.session, False
    used = check_names(cameras, [c.camera.name for c in session.cameras], "camera", "--cameras")
    task = TrackTask(frames, at.people, settings, tuple(used))
    sources = task.sources(session)
    require_files(session)
    with (
        SessionLock(session.folder),
        closing(AnnotationStore(session.annotations_path)) as store,
        Recording(sources) as recording,
        stored_run(session, store, Observer(sources, recording), task) as run,
    ):
        if store.backup_error is not None:
            progress.say(store.backup_error)
        if not compiled_mark().exists():
            progress.say("kernels that are not compiled yet are compiled first, once: it may take a minute or two")
        try:
            _work(run, progress)
        except KeyboardInterrupt:
            stopped = True
    left, stopped_at = run.run.frames, run.next_frame
    if stopped_at is None:
        stopped_at = frames[-1] if run.visited is None else run.visited
    statuses, costs = run.status_counts(), [c for c in run.costs_px.values() if np.isfinite(c)]
    return {
        "frames": len(run.costs_px),
        "resumed_at": None if len(left) == len(frames) else left[0] if left else frames[-1],
        "stopped_at": stopped_at if stopped else None,
        "improved_backward": run.n_improved,
        "people": [session.people[i].name for i in at.people],
        "mean_cost_px": float(np.mean(costs)) if costs else None,
        "statuses": {session.people[i].name: dict(statuses[i]) for i in at.people},
        "normal_matrices": _summarize_matrices(at, run),
    }


def _summarize_matrices(at: Target, run: "TrackSession") -> dict[str, Any]:
    """Return the lowest rank of the normal matrix and its median condition number, by person (KRH08 Sect. 5.4)."""
    import numpy as np

    out = dict[str, Any]()
    for i in at.people:
        found = [m for of_frame in run.normal_matrices.values() if (m := of_frame[i]) is not None]
        if found:
            lowest = min(found, key=lambda m: m.rank - m.n_dofs)
            condition = float(np.median([m.condition for m in found]))
            out[at.session.people[i].name] = {
                "lowest_rank": lowest.rank,
                "n_dofs": lowest.n_dofs,
                "median_condition": condition if np.isfinite(condition) else None,
            }
    return out


def _work(run: "TrackSession", progress: Reporter) -> None:
    """Do both passes, show the progress of each, and smooth the poses."""
    if run.run.frames:
        with progress.over(len(run.run.frames), "tracking") as tick:
            for estimate in run.first_pass():
                run.take(estimate)
                tick()
    run.save()
    steps = run.backward_pass()
    first = next(steps, None)
    if first is not None:
        with progress.over(first.total, "tracking back") as tick:
            run.take(first)
            tick()
            for step in steps:
                run.take(step)
                tick()
    for smoothed in run.smoothing():
        run.take(smoothed)


def _format(found: dict[str, Any]) -> str:
    resumed = "" if found["resumed_at"] is None else f", resumed at frame {found['resumed_at']}"
    lines = [f"tracked {', '.join(found['people'])} over {found['frames']} frames{resumed}"]
    if found["mean_cost_px"] is not None:
        lines[0] += f", mean cost {found['mean_cost_px']:.2f} px"
    for name, statuses in found["statuses"].items():
        counts = [f"{statuses[s]} {s}" for s in ("good", "doubtful", "lost") if statuses.get(s)]
        lines.append(f"{name}: {', '.join(counts)}")
    for name, matrix in found["normal_matrices"].items():
        condition = "unbounded" if matrix["median_condition"] is None else f"{matrix['median_condition']:.1e}"
        lines.append(
            f"{name}: normal matrix of rank {matrix['lowest_rank']} of {matrix['n_dofs']} or more, "
            f"condition number {condition} in the median"
        )
    if found["improved_backward"]:
        lines.append(f"the backward pass replaced {found['improved_backward']} poses of frames with lost people")
    if found["stopped_at"] is not None:
        lines.append(f"stopped before frame {found['stopped_at']}; run it again to resume")
    return "\n".join(lines)
