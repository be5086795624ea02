"""The morning after a batch: the table of its recordings, as JSON and for a terminal."""

import shlex
from typing import Any

from app.remedies import phrases
from tracker.batch.manifest import Manifest
from tracker.batch.results import RecordingRow, summarize, totals
from tracker.batch.task_files import Result

_EARLIER = "done with earlier settings of the plan; give the batch another --out to do it with the present ones"


def record(manifest: Manifest) -> dict[str, Any]:
    """Return the results of a batch as one JSON object; docs/log/batch.md lists its keys."""
    rows = summarize(manifest)
    sums = totals(manifest, rows)
    return {
        "folder": str(manifest.folder),
        "recordings": [_record(row) for row in rows],
        "totals": {
            **{state: sums.counts.get(state, 0) for state in ("done", "failed", "running", "waiting")},
            "hours": sums.hours,
            "cpu_hours": sums.cpu_hours,
            "poses": sums.n_poses,
            "verified": sums.n_verified,
            "share_verified": sums.share_verified,
        },
    }


def format_table(found: dict[str, Any]) -> str:
    """Format the results for a terminal."""
    rows = found["recordings"]
    width = max(9, *(len(row["name"]) for row in rows))
    lines = [f"{'recording':{width}}  state    error mm  doubted  verified     s  look at"]
    for row in rows:
        error = "" if row["expected_error_mm"] is None else f"{row['expected_error_mm']:.1f}"
        doubted = f"{100 * row['share_doubted']:.0f}%" if row["poses"] else ""
        verified = f"{row['verified']}/{row['poses']}" if row["poses"] else ""
        at = "" if row["worst_frame"] is None else f"frame {row['worst_frame']} ({row['worst_person']})"
        numbers = f"{error:>9}  {doubted:>7}  {verified:>8}  {row['seconds']:4.0f}"
        lines.append(f"{row['name']:{width}}  {row['state']:7} {numbers}  {at}")
    for key in ("error", "contradiction", "joined", "earlier"):
        lines += [f"{row['name']}: {row[key]}" for row in rows if row[key]]
    sums = found["totals"]
    counts = ", ".join(f"{sums[s]} {s}" for s in ("done", "failed", "running", "waiting") if sums[s])
    lines.append(
        f"{counts}; {sums['hours']:.2f} hours of workers; {100 * sums['share_verified']:.0f}% of "
        f"{sums['poses']} poses verified"
    )
    if opened := next((row["open"] for row in rows if row["open"]), None):
        lines.append(f"open the first with: {opened}")
    return "\n".join(lines)


def _record(row: RecordingRow) -> dict[str, Any]:
    words = ["quadrille", "open", row.session]
    words += [] if row.worst_frame is None else ["--frame", str(row.worst_frame), "--person", row.worst_person]
    return {
        "name": row.name,
        "session": row.session,
        "state": row.state,
        "expected_error_mm": row.expected_error_mm,
        "share_doubted": row.share_doubted,
        "poses": row.n_poses,
        "verified": row.n_verified,
        "worst_frame": row.worst_frame,
        "worst_person": row.worst_person,
        "seconds": row.seconds,
        "cpu_seconds": row.cpu_seconds,
        "contradiction": row.contradiction,
        "stretches": row.n_stretches,
        "seams": [{"frame": s.frame, "person": s.person, "apart_mm": s.apart_mm, "over": s.is_over} for s in row.seams],
        "joined": _joined(row),
        "earlier": _EARLIER if row.is_earlier else "",
        "error": "" if row.result is None else _error(row.result),
        "files": [] if row.result is None else row.result.files,
        "open": shlex.join(words) if row.state == "done" else "",
    }


def _joined(row: RecordingRow) -> str:
    """Return a sentence on how the stretches of a recording were joined; empty for one that was not cut."""
    if row.n_stretches == 1:
        return ""
    text = f"joined of {row.n_stretches} stretches"
    if not row.seams:
        return f"{text} at keyframes"
    text += f", at most {row.seams[0].apart_mm:.0f} mm apart"
    if not (over := [seam for seam in row.seams if seam.is_over]):
        return text
    at = ", ".join(f"frame {seam.frame} ({seam.person})" for seam in over[:3])
    return f"{text}; check {at}{f' and {len(over) - 3} more' if len(over) > 3 else ''}, where the tracks do not meet"


def _error(result: Result) -> str:
    """Return why a task failed, with what to do in the words of the command line."""
    try:
        return f"{result.error}; {phrases()[result.remedy].command_line.format(**result.remedy_fields)}"
    except LookupError:  # none, or one of another version of the program
        return result.error
