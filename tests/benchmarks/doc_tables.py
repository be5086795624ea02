"""Tables that benchmarks write into the documents, between the lines `<!-- table: NAME -->` and `<!-- end -->`.

A benchmark lists the names of its tables in `TABLES`. The first word of a name is the benchmark, the rest names its
tables apart. `--write docs/log/accuracy.md` replaces exactly these blocks; without it, tables are only printed.
"""

import argparse
import re
import subprocess
import tempfile
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import NamedTuple, Protocol, TypeVar

from tracker.files import write_text_atomic

ROOT = Path(__file__).resolve().parents[2]
END = "<!-- end -->"
WIDTH = 120
"""Longest line of a paragraph in the documents."""


class _Named(Protocol):
    @property
    def name(self) -> str: ...


Clip = TypeVar("Clip", bound=_Named)
Settings = TypeVar("Settings")
Cell = TypeVar("Cell")


class Conditions(NamedTuple):
    """The conditions under which a table was measured. Each is a phrase without a full stop."""

    footage: str
    body: str
    start: str
    settings: str
    chosen: str
    """Which settings were chosen on this footage; "none" where nobody looked at it while choosing."""
    command: str
    """The command that measures and writes the table."""

    def paragraph(self, tree: str, is_repeated: bool = False) -> str:
        """Return the conditions and the tree that was measured, as a paragraph of Markdown.

        Args:
            tree: the tree, see `measured_tree`.
            is_repeated: the reader has seen the conditions at another table of the same measurement.
        """
        labels = ("Footage", "Body", "Start", "Settings", "Settings chosen on this footage")
        text = " ".join(f"*{label}:* {value}." for label, value in zip(labels, self[:5], strict=True))
        text = f"{text} *Written by* `{self.command}`, tree {tree}."
        if is_repeated:
            text = f"*Conditions:* those of the other table of `{self.command.split()[1]}`, tree {tree}."
        return textwrap.fill(text, WIDTH, break_long_words=False, break_on_hyphens=False)


def measured(
    variants: Mapping[str, Settings],
    clips: Sequence[Clip],
    measure: Callable[[Clip, Settings], Cell],
    told: Callable[[Cell], str],
) -> dict[str, list[Cell]]:
    """Measure every variant on every recording; each is printed as it comes."""
    rows: dict[str, list[Cell]] = {}
    for variant, settings in variants.items():
        for clip in clips:
            rows.setdefault(variant, []).append(measure(clip, settings))
            print(f"{variant}, {clip.name}: {told(rows[variant][-1])}", flush=True)
    return rows


def table(heads: Sequence[str], rows: Mapping[str, Sequence[str]], first: str = "variant") -> str:
    """Return a table of Markdown with a row for each variant; `first` is the head of their names."""
    lines = [f"| {first} | {' | '.join(heads)} |", "|---" * (len(heads) + 1) + "|"]
    return "\n".join(lines + [f"| {name} | {' | '.join(cells)} |" for name, cells in rows.items()]) + "\n"


def benchmark_parser(description: str | None, needed: Sequence[str] = (), **folders: str) -> argparse.ArgumentParser:
    """Return a parser with an option for each folder, and with `--write DOC...`; read it by `read_words`.

    Args:
        description: of the benchmark.
        needed: names of the folders without which it cannot run.
        folders: the help of each option by its name.
    """
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, text in folders.items():
        parser.add_argument(f"--{name}", type=Path, required=name in needed, help=text)
    parser.add_argument(
        "--write", type=Path, nargs="+", default=[], metavar="DOC",
        help="documents whose tables are replaced, such as docs/log/accuracy.md docs/measurements.md",
    )  # fmt: skip
    return parser


def read_words(parser: argparse.ArgumentParser, tables: Sequence[str]) -> argparse.Namespace:
    """Read the command line, and check the places of the tables in the documents; call it first."""
    words = parser.parse_args()
    check_places(words.write, tables)
    return words


@contextmanager
def work_folder(work: Path | None) -> Iterator[Path]:
    """Yield a folder for what is made: the given one, which stays, or one that goes afterwards."""
    with tempfile.TemporaryDirectory() as scratch:
        yield work or Path(scratch)


def check_places(paths: Sequence[Path], names: Sequence[str]) -> None:
    """End the program unless documents hold exactly one place for each table, and note the tree: call it first."""
    measured_tree()
    for name in names if paths else ():
        document_of(paths, name)


def document_of(paths: Sequence[Path], name: str) -> Path:
    """Return the document that holds the place of a table.

    Raises:
        SystemExit: none of the documents holds the place, or more than one, or the place does not end.
    """
    marker = _marker(name)
    having = [path for path in paths if marker in path.read_text("utf-8").splitlines()]
    if len(having) != 1:
        shown = ", ".join(map(str, paths))
        raise SystemExit(f"expected '{marker}' in one of {shown}, found it in {len(having)}; name the right documents")
    with_table(having[0].read_text("utf-8"), name, "")
    return having[0]


def show(paths: Sequence[Path], name: str, conditions: Conditions, content: str, is_repeated: bool = False) -> None:
    """Print a table, and write it with its conditions into the document that has its place, if any are given.

    Args:
        paths: the documents, as `--write` gives them; none to print only.
        name: one of the benchmark's `TABLES`.
        conditions: under which it was measured.
        content: the table, as Markdown.
        is_repeated: another table of the same measurement has the conditions in full.

    Raises:
        SystemExit: the documents do not hold exactly one place for the table.
    """
    text = f"{conditions.paragraph(measured_tree(), is_repeated)}\n\n{content.strip()}\n"
    print(text)
    if paths:
        path = document_of(paths, name)
        write_text_atomic(path, with_table(path.read_text("utf-8"), name, text))


def with_table(document: str, name: str, text: str) -> str:
    """Return a document with `text` between the markers of a table, and all else as it was.

    Raises:
        SystemExit: the document does not hold exactly one place for the table.
    """
    marker = _marker(name)
    begins = [m.end() for m in re.finditer(f"^{re.escape(marker)}$", document, re.MULTILINE)]
    if len(begins) != 1:
        raise SystemExit(f"expected one line '{marker}', found {len(begins)}; put it where the table belongs")
    end = re.compile(r"^<!-- (?:end|table: .*) -->$", re.MULTILINE).search(document, begins[0])
    if end is None or end.group() != END:
        raise SystemExit(f"expected a line '{END}' after '{marker}', found none; put it where the table ends")
    return f"{document[: begins[0]]}\n\n{text.strip()}\n\n{document[end.start() :]}"


def _marker(name: str) -> str:
    return f"<!-- table: {name} -->"


@cache
def measured_tree() -> str:
    """Return the commit of this tree when this was called first, marked where files differ from it."""
    command = ["git", "describe", "--always", "--dirty=, with changes", "--abbrev=8", "--exclude=*"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        return "of unknown version"
    commit, *changed = done.stdout.strip().split(", ")
    return ", ".join([f"`{commit}`", *changed])
