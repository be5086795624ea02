"""Tables of variants by recordings, each a section of a document that leaves the others alone."""

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Protocol, TypeVar


class _Named(Protocol):
    @property
    def name(self) -> str: ...


Clip = TypeVar("Clip", bound=_Named)
Settings = TypeVar("Settings")
Cell = TypeVar("Cell")


def measured(
    variants: Mapping[str, Settings],
    clips: Sequence[Clip],
    measure: Callable[[Clip, Settings], Cell],
    told: Callable[[Cell], str],
) -> dict[str, list[Cell]]:
    """What every variant reaches on every recording; each is printed as it comes."""
    rows: dict[str, list[Cell]] = {}
    for variant, settings in variants.items():
        for clip in clips:
            rows.setdefault(variant, []).append(measure(clip, settings))
            print(f"{variant}, {clip.name}: {told(rows[variant][-1])}", flush=True)
    return rows


def table(heads: Sequence[str], rows: Mapping[str, Sequence[str]]) -> str:
    """Markdown of a row for each variant."""
    lines = [f"| variant | {' | '.join(heads)} |", "|---" * (len(heads) + 1) + "|"]
    return "\n".join(lines + [f"| {name} | {' | '.join(cells)} |" for name, cells in rows.items()]) + "\n"


def put_section(path: Path, section: str) -> None:
    """Write a section, text under its first line `## ...`, in place of that of the same heading, or at the end."""
    heading = section.splitlines()[0]
    before = re.split(r"^(?=## )", path.read_text("utf-8"), flags=re.MULTILINE) if path.exists() else []
    found = [s for s in before if s.strip()]
    own = [i for i, s in enumerate(found) if s.splitlines()[0] == heading]
    for i in own or [len(found)]:
        found[i : i + 1] = [section]
    path.write_text("\n".join(s.strip("\n") + "\n" for s in found), "utf-8")
