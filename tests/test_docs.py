"""The documents are true: links lead somewhere, commands run, names exist, the picture shows the house."""

import re
import shlex
import sys

import pytest
import rooms_picture
from architecture import FLOOR, ONLY_ROOMS, PAGE_ROOMS, ROOT, SCRIPTS, own_imports, page_imports, page_room, room_of
from code_counts import git

from app.main import main

PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "sample_sessions").glob("*.md")])
LINK = re.compile(r"\]\((?!https?:)([^)#\s]+)(#[^)]*)?\)")
HEADING_LINK = re.compile(r"\]\((?!https?:)([^)#\s]*)#([^)\s]+)\)")
FILE = re.compile(r"`((?:app|tracker|static|tests|docs|sample_sessions)/[\w./-]+)`")
COMMAND = re.compile(r"^ {4}(?:\.venv/bin/)?(quadrille\b(?:[^\\\n]|\\\n)*)", re.MULTILINE)


def place_of(page):
    """Path of a page from the root."""
    return page.relative_to(ROOT).as_posix()


def anchors(page):
    """Anchors of the headings of a page: letters, digits and hyphens; equal ones are numbered from the second on."""
    found = set()
    for heading in re.findall(r"^#+ (.+)$", page.read_text("utf-8"), re.MULTILINE):
        name = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        n = sum(re.fullmatch(rf"{re.escape(name)}(-\d+)?", other) is not None for other in found)
        found.add(f"{name}-{n}" if n else name)
    return found


def words_of(path):
    """Every command line of the program in a page, without placeholders."""
    for line in COMMAND.findall(path.read_text("utf-8")):
        yield shlex.split(line.replace("\\\n", " "), comments=True)


@pytest.mark.parametrize("page", PAGES, ids=place_of)
def test_links_lead_somewhere(page):
    missing = [target for target, _ in LINK.findall(page.read_text("utf-8")) if not (page.parent / target).exists()]
    assert missing == []


@pytest.mark.parametrize("page", PAGES, ids=place_of)
def test_links_to_headings_lead_to_one(page):
    links = [(target or page.name, name) for target, name in HEADING_LINK.findall(page.read_text("utf-8"))]
    missing = [link for link in links if link[0].endswith(".md") and link[1] not in anchors(page.parent / link[0])]
    assert missing == []


def test_anchors_are_those_that_the_host_makes(tmp_path):
    page = tmp_path / "a.md"
    page.write_text("# What `--paper` is\n\n## A, b & c (`x/y_z`)\n\n### Same\n\n### Same\n\n    # code\n", "utf-8")
    assert anchors(page) == {"what---paper-is", "a-b--c-xy_z", "same", "same-1"}


@pytest.mark.parametrize("page", PAGES, ids=place_of)
def test_files_that_are_named_exist(page):
    names = [name for name in FILE.findall(page.read_text("utf-8")) if "NAME" not in name]
    missing = [name for name in names if not (ROOT / name).exists()]
    assert missing == []


def test_the_site_has_each_document_once():
    """mkdocs.yml lists the documents; docs/site/build.py brings in those outside of docs."""
    listed = re.findall(r"(\S+\.md)$", (ROOT / "mkdocs.yml").read_text("utf-8"), re.MULTILINE)
    outside = dict(
        re.findall(r'^    "(\S+\.md)": "(\S+\.md)"', (ROOT / "docs/site/build.py").read_text("utf-8"), re.MULTILINE)
    )
    places = [outside.get(place_of(page), place_of(page).removeprefix("docs/")) for page in PAGES]
    assert sorted(listed) == sorted(places)


def test_nobody_is_told_to_install_the_bare_name():
    """`quadrille` alone is a distribution of somebody else; ours is `quadrille-mocap`."""
    bare = re.compile(r"(?:pipx?|uv tool|uv pip|uvx) (?:install |run |-\S+ )*['\"]?quadrille(?![\w.-])")
    assert bare.search(f"pip install '{'quadrille'}[dask]'")
    ends = (".md", ".py", ".toml", ".js", ".html", ".yml", ".cff", "Makefile")
    names = [name for name in (git("ls-files") or "").split() if name.endswith(ends) and name != "tests/test_docs.py"]
    assert [name for name in names if bare.search((ROOT / name).read_text("utf-8"))] == []


def test_targets_of_make_exist():
    makefile = (ROOT / "Makefile").read_text("utf-8")
    named = {t for page in PAGES for t in re.findall(r"(?:`| {4})make ([a-z-]+)", page.read_text("utf-8"))}
    assert {"run", "test", "check"} <= named
    assert [t for t in sorted(named) if not re.search(rf"^{t}:", makefile, re.MULTILINE)] == []


@pytest.mark.parametrize(
    "words", [w for page in PAGES for w in words_of(page)], ids=lambda w: " ".join(w[1:])[:60] or "quadrille"
)
def test_commands_are_understood(words, monkeypatch, capsys):
    """Each word of a documented command is one that the program knows: its help would list it."""
    names = [w for w in words[1:] if not w.startswith("-")]
    commands = {"open", "new", "info", "index", "init", "track", "evaluate", "export", "simulate", "bench"}
    commands |= {"import", "relink", "restore", "acquire", "observability", "experiment", "body", "calibrate"}
    commands |= {
        "check",
        "sync",
        "judge",
        "assign",
        "tasks",
        "merge",
        "compare",
        "share",
        "batch",
        "doctor",
        "next",
        "detect",
    }
    command = names[0] if names and names[0] in commands else "open"
    monkeypatch.setattr(sys, "argv", ["quadrille", command, "--help"])
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code
    shown = capsys.readouterr().out
    assert [w for w in words[1:] if w.startswith("--") and w.partition("=")[0] not in shown] == []


def drawn():
    """Floor of each drawn room of Python by its dotted name, and of the page's."""
    floors = {}
    for name, rows in rooms_picture.HOUSE.items():
        package = name.split("/")[0]
        for floor, row in enumerate(reversed(rows)):
            for room in row:
                for part in room.split(", "):
                    floors[f"{package}/{part}"] = floor
    return floors


def test_the_picture_shows_every_room():
    floors = drawn()
    rooms = {r.replace(".", "/") for r in FLOOR.keys() - ONLY_ROOMS} - {"tracker", "app", "quadrille"}
    rooms = {r for r in rooms if not r.startswith("tracker/simulate/")}  # drawn as one
    rooms |= {f"static/{r}" for r in PAGE_ROOMS if r != "."}
    assert rooms - floors.keys() == set()
    assert (ROOT / "docs/images/rooms.svg").read_text("utf-8") == rooms_picture.drawing()


def test_the_floors_of_the_picture_are_those_of_the_imports():
    floors = drawn()
    arrows = {(room_of(a), room_of(b)) for a, needs in own_imports().items() for b in needs}
    arrows |= {(f"static.{page_room(a)}", f"static.{page_room(b)}") for a in SCRIPTS for b in page_imports(a)}
    pairs = {(a.replace(".", "/"), b.replace(".", "/")) for a, b in arrows if a != b}
    level = {(a, b) for a, b in pairs if a.split("/")[0] == b.split("/")[0] and floors.keys() >= {a, b}}
    assert len(level) > 50
    assert {(a, b) for a, b in level if floors[a] <= floors[b]} == set()
