"""Imports run one way: a room imports only rooms below it (tests/support/architecture.py lists them)."""

import ast
import re

import pytest
from architecture import (
    FILES,
    FLOOR,
    IMPORTS,
    OF_THE_SCREEN,
    OWN,
    PAGE_FLOOR,
    ROOT,
    SCRIPTS,
    STATIC,
    imported,
    page_imports,
    page_room,
    room_of,
)


def test_the_walk_sees_imports_of_every_kind():
    within = "def f():\n    from tracker.errors import TrackerError\n    import viser as v\n"
    text = "import app.__main__\nfrom tracker import files, nothing\n" + within
    assert imported(ast.parse(text), FILES) == {"app.__main__", "tracker.files", "tracker", "tracker.errors", "viser"}
    assert len(FILES) > 50


@pytest.mark.parametrize("module", sorted(FILES))
def test_imports_run_downwards(module):
    room = room_of(module)
    wrong = [m for m in OWN[module] if room_of(m) != room and FLOOR[room_of(m)] >= FLOOR[room]]
    assert wrong == [], f"{module} must not import these"


def test_no_circle():
    left = {m: set(needs) - {m} for m, needs in OWN.items()}
    while left:
        free = [m for m, needs in left.items() if not needs & left.keys()]
        assert free, f"import circle among {', '.join(sorted(left))}"
        for m in free:
            del left[m]


@pytest.mark.parametrize("module", sorted(m for m in FILES if m.split(".")[0] == "tracker"))
def test_the_tracker_knows_no_screen(module):
    assert {name.split(".")[0] for name in IMPORTS[module]} & OF_THE_SCREEN == set()


@pytest.mark.parametrize("script", sorted(SCRIPTS))
def test_the_page_imports_run_downwards(script):
    wrong = [s for s in page_imports(script) if PAGE_FLOOR[page_room(s)] > PAGE_FLOOR[page_room(script)]]
    assert wrong == [], f"{script} must not import these"
    assert page_imports(script) <= SCRIPTS.keys()


@pytest.mark.parametrize("room", sorted(m for m, path in FILES.items() if path.name == "__init__.py"))
def test_what_a_room_offers_exists(room):
    """Its docstring names `file.function`, or a room as `room.part`."""
    docstring = ast.get_docstring(ast.parse(FILES[room].read_text("utf-8"))) or ""
    for file, name in re.findall(r"`([a-z_0-9]+)\.([A-Za-z_0-9]+)`", docstring):
        if not {f"{file}.{name}", f"{room.split('.')[0]}.{file}.{name}"} & FILES.keys():
            text = FILES[f"{room}.{file}"].read_text("utf-8")
            assert re.search(rf"^(def |class )?{name}\b", text, re.MULTILINE), f"{file}.{name}"


def test_no_folder_is_crowded():
    """Next to nothing at a root, at most 22 files in a room."""
    folders = {p.parent for p in [*FILES.values(), *STATIC.rglob("*.js"), *STATIC.rglob("*.css")]}
    crowded = {f.relative_to(ROOT).as_posix(): len([p for p in f.iterdir() if p.is_file()]) for f in folders}
    assert {name: n for name, n in crowded.items() if n > (5 if name in ("tracker", "app") else 22)} == {}


def test_the_page_mounts_rooms():
    """main.js puts rooms together and knows no widget of theirs."""
    imported_by_main = page_imports("main.js")
    others = {s for s in imported_by_main if not s.endswith("/index.js") and not s.startswith("model/")}
    assert others == {"shell/test_hook.js"}
    assert {"panes/index.js", "shell/index.js", "timeline/index.js"} <= imported_by_main
