"""Imports run one way: a room imports only rooms below it (tests/support/architecture.py lists them)."""

import ast

import pytest
<<<<<<< HEAD
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
=======

ROOT = Path(__file__).resolve().parents[1]

ROOMS = [
    "tracker",
    "tracker.compute",
    "tracker.geometry",
    "tracker.body",
    "tracker.motion",
    "tracker.formats",
    "tracker.footage",
    "tracker.session",
    "tracker.store",
    "tracker.images",
    "tracker.contours",
    "tracker.evidence",
    "tracker.fitting",
    "tracker.appearance",
    "tracker.search",
    "tracker.tracking",
    "tracker.tracking.chamfer",
    "tracker.acquisition",
    "tracker.posing",
    "tracker.evaluation",
    "tracker.simulate.people",
    "tracker.simulate.motion",
    "tracker.simulate.stage",
    "tracker.simulate",
    "app",
    "app.runtime",
    "app.state",
    "app.storage",
    "app.drawing",
    "app.session",
    "app.control.session",
    "app.control.view",
    "app.control.search",
    "app.control.posing",
    "app.control.tracking",
    "app.control",
    "app.page",
    "app.scene3d",
    "app.server",
    "app.bench",
    "app.cli",
    "app.__main__",
]
FLOOR = {room: floor for floor, room in enumerate(ROOMS)}

# What the package does before any kernel is decorated.
AT_IMPORT = {"tracker": {"tracker.compute.kernel_cache"}}

# What a library without a screen does without.
OF_THE_SCREEN = {"app", "viser", "aiohttp", "tyro", "webbrowser", "asyncio"}


def module_files():
    """Path of every module of the project by its dotted name."""
    files = {}
    for package in ("tracker", "app"):
        for path in sorted((ROOT / package).rglob("*.py")):
            files[".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")] = path
    return files


FILES = module_files()


def room_of(module):
    """Name of the room that a module is in."""
    if module in FLOOR:
        return module
    return module.rpartition(".")[0]


def imported(tree, known):
    """Dotted names that a module imports anywhere, within functions too; of the project's own the very modules."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            whole = [f"{node.module}.{alias.name}" for alias in node.names]
            found |= {name if name in known else node.module for name in whole}
    return found


IMPORTS = {name: imported(ast.parse(path.read_text("utf-8")), FILES) for name, path in FILES.items()}
OWN = {name: sorted(found & FILES.keys()) for name, found in IMPORTS.items()}
>>>>>>> main


def test_the_walk_sees_imports_of_every_kind():
    within = "def f():\n    from tracker.errors import TrackerError\n    import viser as v\n"
    text = "import app.__main__\nfrom tracker import files, nothing\n" + within
    assert imported(ast.parse(text), FILES) == {"app.__main__", "tracker.files", "tracker", "tracker.errors", "viser"}
    assert len(FILES) > 50


@pytest.mark.parametrize("module", sorted(FILES))
def test_imports_run_downwards(module):
    room = room_of(module)
    needed = [m for m in OWN[module] if m not in AT_IMPORT.get(module, ())]
    wrong = [m for m in needed if room_of(m) != room and FLOOR[room_of(m)] >= FLOOR[room]]
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


def test_no_folder_is_crowded():
    """Next to nothing at a root, at most 22 files in a room."""
    folders = {p.parent for p in [*FILES.values(), *STATIC.rglob("*.js"), *STATIC.rglob("*.css")]}
    crowded = {f.relative_to(ROOT).as_posix(): len([p for p in f.iterdir() if p.is_file()]) for f in folders}
    assert {name: n for name, n in crowded.items() if n > (5 if name in ("tracker", "app") else 22)} == {}
