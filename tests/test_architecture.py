"""Imports run one way: a room imports only rooms below it. One line per room, from the bottom up."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

ROOMS = [
    "tracker",
    "tracker.compute",
    "tracker.geometry",
    "tracker.body.model",
    "tracker.motion",
    "tracker.formats",
    "tracker.footage.video",
    "tracker.session.session",
    "tracker.store",
    "tracker.images",
    "tracker.contours.occluding_contours",
    "tracker.evidence.view_evidence",
    "tracker.fitting",
    "tracker.appearance.part_colors",
    "tracker.search.best_first",
    "tracker.tracking",
    "tracker.tracking.chamfer",
    "tracker.acquisition",
    "tracker.posing.drag",
    "tracker.evaluation",
    "tracker.simulate.people",
    "tracker.simulate.motion",
    "tracker.simulate.stage",
    "tracker.simulate",
    "app",
    "app.runtime",
    "app.state.state",
    "app.storage",
    "app.drawing",
    "app.session",
    "app.control.session",
    "app.control.view",
    "app.control.posing",
    "app.control.search",
    "app.control.tracking",
    "app.control",
    "app.page",
    "app.scene3d",
    "app.server.server",
    "app.bench.report",
    "app.cli",
    "app.__main__",
]
FLOOR = {room: floor for floor, room in enumerate(ROOMS)}

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
MOVED = [m for m in FILES if room_of(m) not in ("tracker", "app")]


def test_the_walk_sees_imports_of_every_kind():
    within = "def f():\n    from tracker.errors import TrackerError\n    import viser as v\n"
    text = "import app.__main__\nfrom tracker import files, nothing\n" + within
    assert imported(ast.parse(text), FILES) == {"app.__main__", "tracker.files", "tracker", "tracker.errors", "viser"}
    assert len(FILES) > 50


@pytest.mark.parametrize("module", sorted(MOVED))
def test_imports_run_downwards(module):
    room = room_of(module)
    wrong = [m for m in OWN[module] if m in MOVED and room_of(m) != room and FLOOR[room_of(m)] >= FLOOR[room]]
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
