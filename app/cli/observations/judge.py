"""`quadrille judge`: say where imported observations are wrong, by the footage."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from app.cli.arguments import OptionalPath, SessionArg
from app.cli.target import load_target
from app.runtime.json_output import format_json
from app.runtime.progress import Reporter
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.evaluation.judging.judge import Judgement
    from tracker.session.session import Session

_LISTED = 20
"""Number of entries of the list by severity."""


@dataclass(frozen=True)
class JudgeArguments:
    """Arguments of `quadrille judge`."""

    session: SessionArg
    """session folder."""
    of: str
    """name of the imported observations."""
    report: OptionalPath = None
    """HTML file to write: the worst frames with pictures."""
    blur_faces: bool = False
    """blur the heads of all people who are known in the pictures of --report."""
    overwrite: bool = False
    """replace the file of --report."""
    json: bool = False
    """print one JSON object; docs/log/observations.md lists its keys."""


def command(arguments: Annotated[JudgeArguments, tyro.conf.arg(name="")]) -> None:
    """Say where imported observations are wrong, limb by limb, and why.

    People are tracked from them by contours and key points in a temporary folder; the session stays as it is. Ctrl+C
    stops it.
    """
    from app.export.judge_report import write_report

    session = load_target(arguments.session, None, several=True).session
    path = arguments.report
    if path is not None and path.exists() and not arguments.overwrite:
        raise TrackerError(f"expected --report at a path that is free, found {path}; say --overwrite to replace it")
    if path is not None and (path.is_dir() or not path.parent.is_dir()):
        raise TrackerError(f"expected --report at a file in a folder that exists, found {path}; give another path")
    if arguments.blur_faces and path is None:
        raise TrackerError("expected --blur-faces with --report, found no report; add it, or leave the option out")
    found = judge_session(session, arguments.of, Reporter(silent=arguments.json))
    print(format_json(record(found)) if arguments.json else _format(found))
    if path is not None:
        write_report(session, arguments.of, found, path, arguments.blur_faces)
        if not arguments.json:
            print(f"wrote {path}")


def judge_session(session: "Session", name: str, progress: Reporter) -> list["Judgement"]:
    """Judge observations of a session.

    Raises:
        TrackerError: there are no such observations, or footage is missing.
    """
    from app.cli.track_report import ChainProgress
    from tracker.estimation.chamfer.settings import TrackSettings
    from tracker.evaluation.judging.judge import judge
    from tracker.evidence.observer import open_observer
    from tracker.session.relink import require_files

    require_files(session)
    with open_observer(session.cameras) as observer, ChainProgress(progress) as sink:
        return judge(session, observer.at_nearest_times(), name, TrackSettings(), sink)


def record(found: list["Judgement"]) -> dict[str, Any]:
    """Return judgements as one JSON object."""
    frames = dict[int, dict[str, Any]]()
    worst = list[dict[str, Any]]()
    for own in found:
        who = {} if len(found) == 1 else {"person": own.person}
        for k, limbs in own.frames.items():
            prefix = "" if len(found) == 1 else f"{own.person}: "
            verdicts = {
                f"{prefix}{limb}": {
                    "probability_off": v.probability_off, "distance_mm": 1000 * v.distance_m, "reason": v.reason
                }
                for limb, v in limbs.items()
            }  # fmt: skip
            frames.setdefault(k, {"frame": k, "limbs": {}})["limbs"].update(verdicts)
        worst += [
            {
                **who, "frame": d.frame, "limb": d.limb, "probability_off": d.verdict.probability_off,
                "distance_mm": 1000 * d.verdict.distance_m, "reason": d.verdict.reason,
            }
            for d in own.worst
        ]  # fmt: skip
    worst.sort(key=lambda d: (-round(d["probability_off"], 2), -d["distance_mm"]))
    people = {
        own.person: {
            "share_in_order": own.share_in_order,
            "sentences": own.sentences,
            "joints": {
                name: {"offset_mm": (1000 * offset).tolist(), "spread_mm": 1000 * own.spread_m[name]}
                for name, offset in own.offsets_m.items()
            },
        }
        for own in found
    }
    return {"frames": [frames[k] for k in sorted(frames)], "worst": worst, "people": people}


def _format(found: list["Judgement"]) -> str:
    lines = []
    for own in found:
        doubted = [d for d in own.worst if d.verdict.is_doubted]
        lines.append(f"{own.person}: {100 * own.share_in_order:.0f}% of {len(own.frames)} frames in order")
        lines += [f"  {sentence}" for sentence in own.sentences]
        for d in doubted[:_LISTED]:
            lines.append(f"  frame {d.frame}: {d.verdict.reason} ({100 * d.verdict.probability_off:.0f}%)")
        if len(doubted) > _LISTED:
            lines.append(f"  and {len(doubted) - _LISTED} more; --json lists all")
    return "\n".join(lines)
