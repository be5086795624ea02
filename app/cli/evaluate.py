"""`quadrille evaluate`: compare stored poses with a reference."""

from dataclasses import asdict, dataclass
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from app.cli.arguments import OptionalClock, OptionalName, OptionalPath, OptionalRange, OptionalWhole, SessionArg
from app.cli.target import Target, check_stride, load_target, parse_frames
from app.remedies import command_line_text
from app.runtime.json_output import format_json
from tracker.errors import TrackerError
from tracker.evaluation.metric import metrics

if TYPE_CHECKING:
    from tracker.evaluation.metrics import Alignment
    from tracker.evaluation.references import Reference


@dataclass(frozen=True)
class EvaluateArguments:
    """Arguments of `quadrille evaluate`."""

    session: SessionArg
    """session folder."""
    reference: Path
    """TRC file, pose table (CSV; its body in NAME_model.toml beside it) or session folder."""
    frames: OptionalRange = None
    """A:B, half open; from the first to the last pose by default."""
    stride: OptionalWhole = None
    """compare every Nth frame; by default the distance at which the poses are stored."""
    person: OptionalName = None
    """name; needed in a session of several people."""
    joint_map: OptionalPath = None
    """TOML file with a line such as left_shoulder = "LSHO" for each joint, if the file has other names."""
    axes: str = "x,y,z"
    """the file's axes in the session's order, such as x,-z,y."""
    first_frame: OptionalWhole = None
    """frame of the session, from 0, at which the first row of the joints lies; by default what the file says."""
    clock: OptionalClock = None
    """frames: each frame number of the joints is a frame of the session; time: rows lie at their Time. By default
    DataRate and Time are compared, and a contradiction is an error."""
    marker_set: OptionalName = None
    """the reference has markers of this set: plug-in-gait, cast, helen-hayes, or a TOML file. Joint centres are made of
    them, and laid over the poses by the motion, in time and in space."""
    report: OptionalPath = None
    """with --marker-set: HTML file to write, with Bland-Altman plots of joints and angles."""
    overwrite: bool = False
    """replace the file of --report."""
    align: Literal["none", "rigid-all"] = "none"
    """rigid-all moves the whole reference onto the estimate first."""
    json: bool = False
    """print one JSON object."""


def command(arguments: Annotated[EvaluateArguments, tyro.conf.arg(name="")]) -> None:
    """Compare stored poses with a reference: mean errors of the limb joints, lost frames, acceleration error, angles.

    Joints and parts are compared by name, so that the reference may be of another body model. The second column is the
    error without each joint's constant offset. The offset is printed in the frame of the part above the joint.
    """
    from tracker.evaluation.references import placement, read_reference

    at = load_target(arguments.session, arguments.person, several=False)
    if arguments.marker_set is not None:
        print(_against_markers(at, arguments, arguments.marker_set))
        return
    if arguments.report is not None:
        raise TrackerError("expected --report with --marker-set, found no marker set; add it, or leave the report out")
    path, known = arguments.reference, placement(at.session, arguments.first_frame, arguments.clock)
    reference = read_reference(path, at.session, at.people[0], arguments.joint_map, arguments.axes, known)
    if reference.motion is not None and (known.first_frame is not None or known.clock is not None):
        raise TrackerError(f"expected --first-frame and --clock with joints, found poses in '{path}'; leave them out")
    found = evaluate(at, reference, arguments.frames, arguments.align, arguments.axes, arguments.stride)
    print(format_json(found) if arguments.json else _format(found))


def _against_markers(at: Target, arguments: EvaluateArguments, marker_set: str) -> str:
    """Compare the poses of one person with the markers of a capture system; return the text to print."""
    from app.export.agreement_report import write_report
    from app.export.agreement_table import agreement_record
    from tracker.evaluation.markers.agreement import compare_with_markers
    from tracker.evaluation.markers.reference import read_marker_reference
    from tracker.evaluation.references import stored_motion

    given = {name for name in ("joint_map", "first_frame", "clock") if getattr(arguments, name) is not None}
    if given or arguments.axes != "x,y,z" or arguments.align != "none":
        raise TrackerError(
            "expected --marker-set without --joint-map, --axes, --first-frame, --clock and --align: clock and axes are "
            "found by the motion; leave them out"
        )
    path = arguments.report
    if path is not None and path.exists() and not arguments.overwrite:
        raise TrackerError(f"expected --report at a path that is free, found {path}; say --overwrite to replace it")
    session, (index,) = at
    estimate = stored_motion(session, index).joints
    read = read_marker_reference(arguments.reference, marker_set, estimate)
    found = evaluate(at, read.reference, arguments.frames, "none", stride=arguments.stride)
    frames = [error.frame for error in found["per_frame"]]
    copies, agreement = compare_with_markers(estimate, read.reference.joints, found["person"], frames)
    if path is not None:
        write_report(copies, agreement, None, path)
    if arguments.json:
        more = {"lag_s": read.lag_s, "T_world_markers": read.T_world_markers.tolist()}
        return format_json(found | more | {"agreement": agreement_record(copies, agreement, {}, "all", None)})
    lines = [_format(found), "  angle               bias  limits of agreement"]
    for name, angle in agreement.angles.items():
        bias, low, high = map(degrees, (angle.limits.bias, angle.limits.lower, angle.limits.upper))
        lines.append(f"  {name.replace('_', ' '):16} {bias:5.1f} deg {low:7.1f} to {high:.1f} deg")
    return "\n".join([*lines, *([f"wrote {path}"] if path else [])])


def added_help() -> str:
    """Return a sentence for help about the measures of extensions; empty without any."""
    listed = "; ".join(f"{metric.name}: {metric.title}" for metric in metrics().values())
    return listed and f"Measures of extensions: {listed}."


def evaluate(
    at: Target,
    reference: "Reference",
    frames: str | None,
    align: "Alignment",
    axes: str = "x,y,z",
    stride: int | None = None,
) -> dict[str, Any]:
    """Compare the stored poses of one person with a reference, over the given frames or all that have poses.

    Returns:
        The errors; `notes` has a sentence if the two differ in length or lie metres apart.

    Raises:
        SessionError: the person has no pose.
    """
    from tracker.evaluation.stored_evaluation import evaluate_stored

    session, (index,) = at
    wanted = None if frames is None else parse_frames(frames, session)
    every = None if stride is None else check_stride(stride)
    found = evaluate_stored(session, index, reference, wanted, every, align, axes)
    notes = [*found.notes, *([] if found.apart is None else [command_line_text(*found.apart)])]
    return {"person": session.people[index].name, **asdict(found.result), "notes": notes}


def _format(found: dict[str, Any]) -> str:
    counts = f"{found['frames']} frames, {found['missing_frames']} missing, {found['lost_frames']} lost"
    lines = [
        f"{found['person']}: {counts}",
        f"  MPJPE {found['mpjpe_mm']:.1f} mm, median {found['median_mm']:.1f}, 95% {found['p95_mm']:.1f}",
    ]
    lines[1] += f"; without offsets MPJPE {found['mpjpe_without_offsets_mm']:.1f} mm"
    if found["acceleration_error_m_s2"] is not None:
        rate = f"at {found['fps']:g} frames per second"
        lines.append(f"  acceleration error {found['acceleration_error_m_s2']:.1f} m/s2 {rate}")
    if found["lost_frame_numbers"]:
        lines.append(f"  lost: frames {_lost(found)}")
    lines.append(f"  {'':16}    raw      without offset  offset: forward, left, up")
    for joint, error in found["per_joint_mm"].items():
        rest, offset = found["per_joint_without_offsets_mm"][joint], found["offsets_mm"][joint]
        x, y, z = offset
        lines.append(f"  {joint.replace('_', ' '):16} {error:6.1f} mm {rest:10.1f} mm {x:10.0f} {y:5.0f} {z:5.0f} mm")
    if found["axis_error_deg"] is not None:
        worst = f"{found['worst_axis_error_deg']:.2f} in frame {found['worst_axis_frame']}"
        lines.append(f"  part axes {found['axis_error_deg']:.2f} deg, worst frame's mean {worst}")
        lines.append(f"  without twist {found['long_axis_error_deg']:.2f} deg")
        errors = found["per_part_axis_deg"].items()
        lines += [f"  {part.replace('_', ' '):16} {error:6.2f} deg" for part, error in errors]
    lines += [f"note: {note}" for note in found["notes"]]
    lines[1:1] = [f"  {metrics()[n].title} {v:.4g} {metrics()[n].unit}".rstrip() for n, v in found["metrics"].items()]
    return "\n".join(lines)


def _lost(found: dict[str, Any]) -> str:
    """List the lost frames as ranges, with the joint that is off most in them."""
    from tracker.session.row_placement import listed_frames

    lost = set(found["lost_frame_numbers"])
    measured = [e for e in found["per_frame"] if e.frame in lost and e.worst_mm is not None]
    listed = listed_frames(found["lost_frame_numbers"])
    if not measured:
        return f"{listed}, none of which has a pose"
    worst = max(measured, key=lambda e: e.worst_mm)
    joint = worst.worst_joint.replace("_", " ")
    return f"{listed}; the worst is {worst.frame}, where the {joint} is off by {worst.worst_mm:.0f} mm"
