"""`quadrille acquire`: acquire the sizes of a person's body from the footage."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from app.cli.arguments import OptionalName, OptionalPath, OptionalRange, SessionArg
from app.cli.target import Target, load_target, parse_frames
from app.runtime.json_output import format_json
from app.runtime.progress import Reporter
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.estimation.acquisition.from_contours import AcquisitionSettings
    from tracker.estimation.acquisition.two_views import TwoViewSettings

_SHOWN = 12
"""Number of sizes that are listed."""

OptionalViews = Annotated[tuple[str, ...], tyro.conf.arg(metavar="FRONT SIDE", help_behavior_hint="")]


@dataclass(frozen=True)
class AcquireArguments:
    """Arguments of `quadrille acquire`."""

    session: SessionArg
    """session folder."""
    method: Literal["contours", "voxels"] = "contours"
    """contours fits all sizes to the contours of several frames in all views. voxels fits lengths and girths to the
    labelled voxels of the same frames first, and starts the fit to contours there."""
    voxels_only: bool = False
    """with --method voxels: leave out the fit to contours."""
    person: OptionalName = None
    """name; needed in a session of several people."""
    frames: OptionalRange = None
    """A:B, half open: the frames that may be used; all by default."""
    n_frames: int = 6
    """number of frames that the sizes are fitted to; they are chosen by what their poses show."""
    uncoupled: bool = False
    """let left and right differ."""
    paper: bool = False
    """as Gavrila and Davis 1996: the shapes of the parts alone, from a frontal and a side view of one frame."""
    views: OptionalViews = ()
    """with --paper: names of the frontal and the side view; chosen by the person's heading by default."""
    out: OptionalPath = None
    """write the body to this .toml file too, for new --person-model FILE or --model NAME=FILE in another session."""
    dry_run: bool = False
    """show the sizes, but change nothing in the session."""
    json: bool = False
    """print one JSON object; docs/log/acquisition.md lists its keys."""


def command(arguments: Annotated[AcquireArguments, tyro.conf.arg(name="")]) -> None:
    """Acquire the sizes of a person's body from the footage.

    The person needs a pose on one frame. Ctrl+C stops it and changes nothing; the page undoes it.
    """
    at = load_target(arguments.session, arguments.person, several=False)
    frames = parse_frames(arguments.frames, at.session)
    if arguments.n_frames < 1:
        raise TrackerError(f"expected --n-frames of at least 1, found {arguments.n_frames}; 5 to 10 are usual")
    if arguments.out is not None and (arguments.out.suffix != ".toml" or not arguments.out.parent.is_dir()):
        raise TrackerError(f"expected --out as a .toml file in a folder that exists, found '{arguments.out}'")
    settings = _settings(arguments, [c.camera.name for c in at.session.cameras])
    found = acquire(at, frames, settings, Reporter(silent=arguments.json), store=not arguments.dry_run)
    if arguments.out is not None:
        from tracker.files import write_text_atomic

        write_text_atomic(arguments.out, found["model"])
    print(format_json(found) if arguments.json else _format(found, arguments))


def _settings(arguments: AcquireArguments, cameras: list[str]) -> "AcquisitionSettings | TwoViewSettings":
    """Return the settings of the method that the arguments name.

    Raises:
        TrackerError: the views are not two cameras of the session, or are given without --paper.
    """
    from tracker.estimation.acquisition.from_contours import AcquisitionSettings
    from tracker.estimation.acquisition.from_voxels import VoxelSizeSettings
    from tracker.estimation.acquisition.size_fit import SizeFitSettings
    from tracker.estimation.acquisition.two_views import TwoViewSettings

    views, coupled = arguments.views, not arguments.uncoupled
    if views and not arguments.paper:
        raise TrackerError("expected --views with --paper alone, found it without; other methods use all views")
    if views and (len(set(views)) != len(views) or len(views) != 2 or not set(views) <= set(cameras)):
        raise TrackerError(
            f"expected --views as two of {', '.join(cameras)}, found '{' '.join(views)}'; name the frontal view first"
        )
    by_voxels = arguments.method == "voxels"
    if arguments.paper and by_voxels:
        raise TrackerError("expected --paper with --method contours, found voxels; leave one of them out")
    if arguments.voxels_only and not by_voxels:
        raise TrackerError("expected --voxels-only with --method voxels, found contours; add --method voxels")
    if arguments.paper:
        return TwoViewSettings((views[0], views[1]) if views else None, arguments.n_frames, coupled)
    fit = SizeFitSettings(rounds=()) if arguments.voxels_only else SizeFitSettings()
    voxels = VoxelSizeSettings() if by_voxels else None
    return AcquisitionSettings(n_frames=arguments.n_frames, coupled=coupled, fit=fit, voxels=voxels)


def acquire(
    at: Target, frames: range, settings: "AcquisitionSettings | TwoViewSettings", progress: Reporter, store: bool = True
) -> dict[str, Any]:
    """Acquire the body of one person and make it the present one, with keyframes fitted to it.

    Args:
        at: the session and the person.
        frames: the frames that may be used.
        settings: of the acquisition.
        progress: shows how far it is.
        store: whether the session is changed.

    Returns:
        `person`; `frames` and `views` that were used; `cost_before_px`, `cost_after_px`; `height_m`; `sizes`, a list
        of `name`, `before_m`, `after_m` and `sigma_m` (NaN without a known uncertainty); `segments`, a list
        of `name`, `length_m` and `sigma_m` of the lengths between limb joints in the poses; `swings_deg`, how far the
        limbs turn about each pair of joints; `notes` on joints whose centres this does not show; `model`, the body as
        TOML; `evaluations` of the fit to contours; `voxels`, None or the `height_m` of the body that was fitted to
        voxels, and `overlap_before` and `overlap_after` of its hull with that of the footage, 0 to 1.

    Raises:
        TrackerError: the person has no pose on these frames, or the views show nothing of them.
    """
    import numpy as np

    from tracker.estimation.acquisition.size_report import (
        acquired_segments,
        joint_swings,
        size_changes,
        unobservable_joints,
    )
    from tracker.evidence.observer import Observer
    from tracker.footage.recording import Recording
    from tracker.formats.model_toml import format_model
    from tracker.pipeline.body_acquisition import acquire_body, store_body
    from tracker.session.lock import SessionLock
    from tracker.session.relink import require_files
    from tracker.session.store.annotation_store import AnnotationStore

    session, (person,) = at
    require_files(session)
    name = session.people[person].name
    with SessionLock(session.folder), Recording(session.cameras) as recording:
        with progress.share("acquiring") as advance:

            def report(stage: str, share: float, text: str = "", /) -> None:
                advance(share)

            found = acquire_body(
                session, Observer(session.cameras, recording).at_nearest_times(), person, frames, settings, report
            )
        changes = size_changes(found)
        if store:
            with AnnotationStore(session.annotations_path) as annotations:
                poses = dict(zip(found.frames, found.poses, strict=True))
                store_body(session, annotations, person, found.body, poses, f"acquire sizes of {name}")
    return {
        "person": name,
        "frames": list(found.frames),
        "views": list(found.views) or [c.camera.name for c in session.cameras],
        "cost_before_px": found.cost_before_px,
        "cost_after_px": found.cost_after_px,
        "height_m": found.body.height_m,
        "sizes": [c._asdict() for c in changes],
        "segments": [s._asdict() for s in acquired_segments(found)],
        "swings_deg": {s.name: float(np.degrees(s.swing_rad)) for s in joint_swings(found)},
        "notes": unobservable_joints(found),
        "model": format_model(found.body),
        "evaluations": found.fit.n_evaluations,
        "voxels": None if found.voxels is None else {
            "height_m": found.voxels.body.height_m,
            "overlap_before": found.voxels.overlap_before,
            "overlap_after": found.voxels.overlap_after,
        },
    }  # fmt: skip


def _stages(found: dict[str, Any]) -> list[str]:
    """Return a line on each stage, where the acquisition had two."""
    by_voxels = found["voxels"]
    if by_voxels is None:
        return []
    lines = [
        f"voxels: {by_voxels['height_m']:.2f} m tall; the hulls of body and footage share "
        f"{100 * by_voxels['overlap_before']:.0f}% before, {100 * by_voxels['overlap_after']:.0f}% after"
    ]
    if found["evaluations"]:
        lines.append(f"contours: {found['height_m']:.2f} m tall, after {found['evaluations']} evaluations")
    return lines


def _format(found: dict[str, Any], arguments: AcquireArguments) -> str:
    frames = ", ".join(map(str, found["frames"]))
    where = f"frame {frames}" if len(found["frames"]) == 1 else f"frames {frames}"
    where += f", front view {found['views'][0]}, side view {found['views'][1]}" if arguments.paper else ""
    lines = [
        f"{found['person']}: {found['height_m']:.2f} m tall, from {where}",
        *_stages(found),
        f"cost {found['cost_before_px']:.2f} px before, {found['cost_after_px']:.2f} px with the acquired body",
        f"sizes that changed most, cm (before, after{'' if arguments.paper else ', standard deviation'}):",
    ]
    for row in found["sizes"][:_SHOWN]:
        sizes_m = [row[k] for k in ("before_m", "after_m", "sigma_m")[: 2 if arguments.paper else 3]]
        lines.append(f"  {row['name']:<34}" + " ".join(f"{size_m * 100:6.1f}" for size_m in sizes_m))
    lines += found["notes"]
    if arguments.dry_run:
        lines.append("nothing was stored (--dry-run)")
    else:
        lines.append("track again to use it: stored poses that are no keyframes keep the former body")
    return "\n".join(lines)
