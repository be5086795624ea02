"""`quadrille merge`: join two copies of one session."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from app.runtime.json_output import format_json
from app.state.other_copy import TOLERANCE_MM
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.annotation.merge_sessions import MergeReport

_Copy = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(help_behavior_hint="")]


def command(a: _Copy, b: _Copy, /, into: Path, tolerance_mm: float = TOLERANCE_MM, json: bool = False) -> None:
    """Join two copies of one session, such as those of two annotators, in a new session.

    Both copies stay as they are. Poses that both annotated differently become tasks; docs/log/annotation.md has rules.

    Args:
        a: session folder of one copy.
        b: session folder of the other copy.
        into: session folder to write.
        tolerance_mm: distance of a joint up to which two poses count as one.
        json: print one JSON object.
    """
    from tracker.annotation.merge_sessions import merge_sessions

    if not tolerance_mm >= 0:
        raise TrackerError(f"expected --tolerance-mm as a number from 0, found {tolerance_mm}; choose another")
    found = merge_sessions(a, b, into, tolerance_mm / 1000)
    print(format_json(_record(into, found)) if json else _format(into, found))


def _record(into: Path, found: "MergeReport") -> dict[str, Any]:
    return {
        "folder": str(into),
        "edits": found.n_edits,
        "only_in": list(found.n_own),
        "disagreements": [
            {
                "person": c.at[0], "frame": c.at[1], "apart_mm": 1000 * c.apart_m, "shown": c.winner.author,
                "alternative": c.other.author,
            }
            for c in found.conflicts
        ],
        "notes": list(found.notes),
    }  # fmt: skip


def _format(into: Path, found: "MergeReport") -> str:
    lines = [f"wrote {into}: {found.n_edits} edits, {found.n_own[0]} and {found.n_own[1]} of one copy alone"]
    for (person, frame), winner, other, apart_m in found.conflicts:
        names = f"{winner.author or 'nobody named'} (shown) and {other.author or 'nobody named'}"
        lines.append(f"{person}, frame {frame}: {names} are {1000 * apart_m:.0f} mm apart")
    lines += found.notes
    n = len(found.conflicts)
    lines.append(f"{n} disagreement{'' if n == 1 else 's'}" + (f"; quadrille tasks {into} lists them" if n else ""))
    return "\n".join(lines)
