"""`quadrille track`: track people and store the poses; the same command resumes an interrupted run."""

import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, make_dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from app.cli.arguments import Names, OptionalName, OptionalNumber, OptionalRange, OptionalWhole, SessionArg
from app.cli.target import Target, check_stride, load_target, parse_frames
from app.runtime.json_output import format_json
from app.runtime.progress import Reporter
from tracker.errors import TrackerError
from tracker.estimation.tracking.method import OptionValue, PaperMode
from tracker.pipeline.methods import METHODS, all_options

if TYPE_CHECKING:
    from tracker.estimation.tracking.tracker import TrackerSettings
    from tracker.pipeline.automatic_run import ChainPlan
    from tracker.pipeline.stored_run import TrackPlan
    from tracker.session.session import Session


@dataclass(frozen=True)
class TrackWords:
    """Arguments of `quadrille track` that all methods share."""

    session: SessionArg
    """session folder."""
    method: str = ""
    """how people are tracked."""
    init: Literal["auto"] | None = None
    """auto finds people who have no pose first, by stored key points or by silhouettes, on the frame where they track
    best, and tracks from there in both directions."""
    detect: bool = False
    """with --init auto: detect people by a network first, as quadrille detect does, and track by their key points and
    the contours; for footage without backgrounds."""
    of: OptionalName = None
    """name of observations: their key points alone show --init auto the people, and are the evidence that --evidence
    says."""
    evidence: Literal["contours", "keypoints", "both"] = "contours"
    """both: key points of --of too; contours overrule them where they contradict. keypoints: the body is fitted to them
    alone, frame by frame, and smoothed; pictures are not looked at."""
    acquire: bool = False
    """acquire sizes from the contours before tracking, of people whose body has the sizes of its preset, or sizes from
    before the calibration was corrected; then track from the frame where people are placed in both directions."""
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
    between_keyframes: bool = False
    """only the stretches between two keyframes that were not tracked from them as they are now: after the correction
    of a keyframe, the two beside it."""
    paper: bool = False
    """as the method's paper."""
    json: bool = False
    """print one JSON object."""


def arguments_class() -> type[TrackWords]:
    """Return the arguments of `quadrille track`, with all methods and their options."""
    papers = [f"{m.name} as {_paper_text(m.paper)}" for m in METHODS.values() if m.paper is not None]
    methods = " ".join(f"{m.name}: {m.help}." for m in METHODS.values())
    own = [
        _field("method", next(iter(METHODS)), _one_of(METHODS), methods),
        _field("paper", False, bool, f"as the method's paper: {'; '.join(papers)}. See docs/trackers.md."),
    ]
    for option in all_options().values():
        owners = [m.name for m in METHODS.values() if option in m.options]
        prefix = "" if len(owners) == len(METHODS) else f"{', '.join(owners)}: "
        text = f"{prefix}{option.help}{'; ' * bool(option.defaults)}{option.defaults}."
        kinds = {"switch": bool, "whole": OptionalWhole, "number": OptionalNumber}
        kind = kinds.get(option.kind) or _one_of(option.choices or ()) | None
        own.append(_field(option.name, True if option.kind == "switch" else None, kind, text))
    return make_dataclass("TrackArguments", own, bases=(TrackWords,), frozen=True)


def _one_of(words: Iterable[str]) -> Any:
    """Return the type of words that are known at run time only."""
    return Literal[tuple(words)]  # pyrefly: ignore[invalid-literal]


def _field(name: str, default: object, kind: Any, text: str) -> tuple[str, Any, Any]:
    argument = tyro.conf.arg(help=text, help_behavior_hint="" if default is None else None)
    return name, Annotated[kind, argument], field(default=default)


def _paper_text(paper: PaperMode) -> str:
    return paper.source + (f", in a session made with --model {paper.body}" if paper.body else "")


if TYPE_CHECKING:
    TrackArguments = TrackWords
else:
    TrackArguments = arguments_class()


def command(arguments: Annotated[TrackArguments, tyro.conf.arg(name="")]) -> None:
    """Track people through a range of frames and store the poses.

    Between two keyframes of a person it tracks from both, and joins the two passes where they agree best. Ctrl+C stops
    it and keeps the poses found so far; run it again to resume.
    """
    from app.cli.track_report import format_stretches, format_summary
    from tracker.pipeline.automatic_run import ChainPlan
    from tracker.pipeline.find_people import FindSettings
    from tracker.pipeline.stored_run import TrackPlan
    from tracker.session.matching import check_names

    at = load_target(arguments.session, arguments.person, several=True)
    ascending = parse_frames(arguments.frames, at.session)[:: check_stride(arguments.stride)]
    frames = ascending[::-1] if arguments.backward else ascending
    _check_chain(arguments)
    if arguments.detect or (arguments.init is not None and arguments.of is None):
        arguments = _with_detection(arguments, at.session)
    paper, settings = METHODS[arguments.method].paper, settings_of(arguments)
    if arguments.paper and paper is not None:
        paper.require_body({p.name: p.model for p in (at.session.people[i] for i in at.people)})
    used = check_names(arguments.cameras, [c.camera.name for c in at.session.cameras], "camera", "--cameras")
    if arguments.evidence == "keypoints":
        found = _track_keypoints(at, frames, arguments)
        print(format_json(found) if arguments.json else _format_keypoints(found))
        return
    find = None if arguments.init is None else FindSettings(keypoints=arguments.of)
    keypoints = arguments.of if arguments.evidence == "both" else None
    track_plan = TrackPlan(frames, at.people, settings, tuple(used), keypoints=keypoints)
    if arguments.between_keyframes:
        found = track_between(at.session, track_plan, Reporter(silent=arguments.json))
        print(format_json(found) if arguments.json else format_stretches(found))
        if any(run["stopped_at"] is not None for run in found["runs"]):
            sys.exit(130)
        return
    plan = ChainPlan(track_plan, find, at.people if arguments.acquire else ())
    found = track(at.session, plan, Reporter(silent=arguments.json))
    print(format_json(found) if arguments.json else format_summary(found))
    if found["stopped_at"] is not None:
        sys.exit(130)


def _with_detection(arguments: TrackArguments, session: "Session") -> TrackArguments:
    """Return arguments with key points that are detected first if they ask for it; else say where that would help."""
    reporter = Reporter(silent=arguments.json)
    if arguments.detect:
        of = _detected(arguments.of, session, parse_frames(arguments.frames, session), reporter)
        return replace(arguments, of=of, evidence="both")
    if not session.has_outlines:
        reporter.say(
            "note: no camera has a background or masks, so that only what moves shows the people; --detect finds them "
            "by a network first"
        )
    return arguments


def _detected(name: str | None, session: "Session", frames: range, reporter: Reporter) -> str:
    """Detect people unless that was done; return the name of the observations."""
    from tracker.footage.recording import Recording
    from tracker.interchange.detection.detect import DetectionPlan, complete_detection, detect_people, open_name
    from tracker.interchange.detection.detectors import default_folder, load_detector
    from tracker.session.lock import SessionLock

    detector, text = load_detector("blazepose", None, default_folder())
    known = complete_detection(session, text, frames, name)
    if known is not None:
        return known
    plan = DetectionPlan(name or open_name(session, "detected", text, frames), text, frames)
    with (
        SessionLock(session.folder),
        Recording(session.cameras) as recording,
        reporter.over(len(frames), "detecting people") as advance,
    ):
        found = detect_people(session, recording, detector, plan, lambda *_: advance())
    for note in found.notes:
        reporter.say(f"note: {note}")
    if not found.is_complete:
        print("stopped before tracking; what was detected is kept; run it again to go on", file=sys.stderr)
        sys.exit(130)
    return plan.name


def _track_keypoints(at: Target, frames: Sequence[int], arguments: TrackArguments) -> dict[str, Any]:
    """Store poses by key points alone; return `people` with the number of poses of each."""
    from tracker.pipeline.automatic_run import open_stored_session, unplaced
    from tracker.pipeline.keypoint_evidence import find_by_keypoints

    assert arguments.of is not None
    with open_stored_session(at.session) as opened:
        missing = unplaced(opened, at.people)
        if missing and arguments.init is not None:
            opened.store_found(find_by_keypoints(opened.session, missing, frames, arguments.of))
        counts = opened.store_keypoint_poses(at.people, frames, arguments.of)
        names = [p.name for p in opened.session.people]
    return {"of": arguments.of, "people": {names[i]: n for i, n in counts.items()}}


def _format_keypoints(found: dict[str, Any]) -> str:
    return "\n".join(f"{name}: {n} poses by the key points of {found['of']}" for name, n in found["people"].items())


def _check_chain(arguments: TrackArguments) -> None:
    """Raise a `TrackerError` where arguments contradict one another."""
    if arguments.evidence != "contours" and arguments.of is None:
        raise TrackerError(
            f"expected --of NAME with --evidence {arguments.evidence}, found none; name the imported observations"
        )
    if arguments.of is not None and arguments.evidence == "contours" and arguments.init is None:
        raise TrackerError(
            "expected --init auto or --evidence with --of, found neither; say what the key points are for"
        )
    if arguments.evidence == "keypoints" and arguments.acquire:
        raise TrackerError(
            "expected --evidence both with --acquire, found keypoints: sizes are acquired from the contours"
        )
    if arguments.detect and (arguments.init is None or arguments.evidence == "keypoints"):
        raise TrackerError(
            "expected --detect with --init auto, and contours as evidence beside its key points; correct the options, "
            "or run quadrille detect first"
        )
    others = ("init", "acquire", "backward")
    if arguments.between_keyframes and (any(getattr(arguments, o) for o in others) or arguments.stride != 1):
        raise TrackerError(
            "expected --between-keyframes without --init, --acquire, --backward and --stride, found one of them; it "
            "tracks every frame between keyframes in both directions"
        )
    for option, is_used in (("--init", arguments.init is not None), ("--acquire", arguments.acquire)):
        if is_used and arguments.backward:
            raise TrackerError(
                f"expected {option} without --backward, found both; it tracks in both directions by itself"
            )


def settings_of(arguments: TrackWords) -> "TrackerSettings":
    """Return the settings of the tracker that the arguments name.

    Raises:
        TrackerError: an option belongs to another method, or its value is invalid.
    """
    method, chosen = METHODS[arguments.method], dict[str, OptionValue]()
    for name, option in all_options().items():
        value = getattr(arguments, name)
        if value is not None and not (option.kind == "switch" and value):
            chosen[name] = value
    names = {option.name for option in method.options}
    foreign = [_flag(name, value) for name, value in chosen.items() if name not in names]
    if foreign:
        raise TrackerError(
            f"expected options of the method '{method.name}', found {', '.join(foreign)}; leave them out, or choose "
            "another --method"
        )
    settings = method.paper.settings() if arguments.paper and method.paper is not None else method.settings()
    return method.at_stride(method.with_options(settings, chosen), arguments.stride)


def _flag(name: str, value: OptionValue) -> str:
    return f"--{'no-' if value is False else ''}{name.replace('_', '-')}"


def track(session: "Session", plan: "ChainPlan", progress: Reporter) -> dict[str, Any]:
    """Track people and store their poses as one entry of the history.

    Keyframes and locked degrees of freedom keep their values. An interrupted run keeps its poses; run it again
    to resume.

    Args:
        session: the session.
        plan: what to do. If it neither finds people nor acquires sizes, the run goes from its first frame to its last.
        progress: shows how far it is.

    Returns:
        See `track_report.summarize`.

    Raises:
        SessionError: a person has no pose at or before the first frame.
    """
    from app.cli.track_report import ChainProgress, summarize
    from tracker.pipeline.automatic_run import find_and_track, open_stored_session

    is_stopped = False
    with open_stored_session(session) as opened, ChainProgress(progress) as sink:
        if opened.backup_error is not None:
            progress.say(opened.backup_error)
        try:
            if plan.find is None and not plan.acquire:
                opened.track(plan.track, sink)
            else:
                find_and_track(plan, opened, sink)
        except KeyboardInterrupt:
            is_stopped = opened.run is None or not opened.run.finished
    if opened.run is None or opened.plan is None:
        kept = "what was found is kept; run it again to go on" if opened.is_changed else "nothing was stored"
        print(f"stopped before tracking; {kept}", file=sys.stderr)
        sys.exit(130)
    return summarize(opened.session, opened.plan, opened.run, is_stopped)


def track_between(session: "Session", plan: "TrackPlan", progress: Reporter) -> dict[str, Any]:
    """Track the stretches between keyframes that were not tracked from them as they are now.

    Args:
        session: the session.
        plan: whom to track, within which frames, and how.
        progress: shows how far it is.

    Returns:
        `stretches` with `first`, `last` and `people` of each, and `runs`: see `track_report.summarize`. A run is of the
        people who share its stretches.

    Raises:
        TrackerError: nobody has two keyframes with other frames between them.
    """
    from app.cli.track_report import ChainProgress, summarize
    from tracker.pipeline.automatic_run import open_stored_session
    from tracker.pipeline.keyframe_stretches import frames_of

    if not plan.settings.whole_run:
        raise TrackerError(
            "expected a backward pass with --between-keyframes, found a run without one; leave out --no-whole-run"
        )
    names = [p.name for p in session.people]
    out: dict[str, Any] = {"stretches": [], "runs": []}
    with open_stored_session(session) as opened:
        for people, some in opened.stretches_to_track(plan).items():
            is_stopped = False
            with ChainProgress(progress) as sink:
                try:
                    opened.track(replace(plan, people=people, frames=frames_of(some)), sink)
                except KeyboardInterrupt:
                    is_stopped = opened.run is None or not opened.run.finished
            assert opened.run is not None
            assert opened.plan is not None
            of_all = [names[i] for i in people]
            out["stretches"] += [{"first": s.first, "last": s.last, "people": of_all} for s in some]
            out["runs"].append(summarize(opened.session, opened.plan, opened.run, is_stopped))
            if is_stopped:
                break
    return out
