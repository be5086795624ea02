"""The rooms of the house from the bottom up, one line each, and what each module imports."""

import ast
import gc
import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

ROOMS = [
    "tracker",
    "tracker.compute",
    "tracker.geometry",
    "tracker.body",
    "tracker.body.motion",
    "tracker.formats",
    "tracker.formats.joint_tables",
    "tracker.formats.keypoints",
    "tracker.formats.write_only",
    "tracker.formats.calibrations",
    "tracker.footage",
    "tracker.session",
    "tracker.session.store",
    "tracker.evidence.images",
    "tracker.evidence.contours",
    "tracker.evidence",
    "tracker.evidence.voxels",
    "tracker.estimation",
    "tracker.estimation.fitting",
    "tracker.estimation.trajectory",
    "tracker.estimation.appearance",
    "tracker.estimation.search",
    "tracker.estimation.tracking",
    "tracker.estimation.by_frame",
    "tracker.estimation.runs",
    "tracker.estimation.chamfer",
    "tracker.estimation.contour",
    "tracker.estimation.voxel",
    "tracker.estimation.acquisition",
    "tracker.estimation.initialization.generators",
    "tracker.estimation.initialization",
    "tracker.estimation.posing",
    "tracker.interchange",
    "tracker.interchange.observations",
    "tracker.interchange.detection",
    "tracker.interchange.plausibility",
    "tracker.interchange.exports",
    "tracker.interchange.exports.datasets",
    "tracker.interchange.exports.like",
    "tracker.calibration",
    "tracker.calibration.check",
    "tracker.calibration.boards",
    "tracker.calibration.self_calibration",
    "tracker.pipeline",
    "tracker.evaluation",
    "tracker.evaluation.agreement",
    "tracker.evaluation.markers",
    "tracker.evaluation.judging",
    "tracker.annotation",
    "tracker.api",
    "tracker.batch",
    "tracker.simulate.people",
    "tracker.simulate.motion",
    "tracker.simulate.stage",
    "tracker.simulate",
    "tracker.simulate.experiments",
    "app",
    "app.runtime",
    "app.state",
    "app.storage",
    "app.drawing",
    "app.session",
    "app.export",
    "app.control.session",
    "app.control.view",
    "app.control.search",
    "app.control.posing",
    "app.control.tracking",
    "app.control",
    "app.participants",
    "app.messages",
    "app.advice",
    "app.page.feeds",
    "app.page",
    "app.scene3d",
    "app.server",
    "app.share",
    "app.bench",
    "app.cli",
    "app.cli.calibration",
    "app.cli.observations",
    "app.cli.batches",
    "app.cli.annotation",
    "app.main",
    "quadrille",
]
FLOOR = {room: floor for floor, room in enumerate(ROOMS)}
ONLY_ROOMS = {"tracker.estimation", "tracker.interchange", "tracker.calibration"}
"""Wings without modules of their own."""

# What a library without a screen does without.
OF_THE_SCREEN = {"app", "viser", "aiohttp", "tyro", "webbrowser", "asyncio"}


def module_files():
    """Path of every module of the project by its dotted name."""
    files = {}
    for package in ("tracker", "app", "quadrille"):
        for path in sorted((ROOT / package).rglob("*.py")):
            files[".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")] = path
    return files


FILES = module_files()


def room_of(module):
    """Name of the room that a module is in."""
    if module in FLOOR:
        return module
    return module.rpartition(".")[0]


def wing_of(room):
    """Name of the wing of the library that a room is in."""
    return ".".join(room.split(".")[:2])


def imported(nodes_of_module, known):
    """Dotted names that a module imports anywhere, within functions too; of the project's own the very modules."""
    found = set()
    for node in nodes_of_module:
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            whole = [f"{node.module}.{alias.name}" for alias in node.names]
            found |= {name if name in known else node.module for name in whole}
    return found


@cache
def trees():
    """Syntax tree of each module; not made while tests are collected."""
    gc.disable()  # a million nodes that all stay: collecting them costs four times the parsing
    try:
        return {name: ast.parse(path.read_text("utf-8")) for name, path in FILES.items()}
    finally:
        gc.enable()


@cache
def nodes():
    """All nodes of the syntax tree of each module, walked once."""
    return {name: [*ast.walk(tree)] for name, tree in trees().items()}


@cache
def imports():
    """Dotted names that each module imports."""
    return {name: imported(found, FILES) for name, found in nodes().items()}


@cache
def own_imports():
    """Modules of the project that each module imports."""
    return {name: sorted(found & FILES.keys()) for name, found in imports().items()}


PAGE_ROOMS = [
    "widgets",
    "share",
    "model",
    "layout",
    "panes",
    "posing",
    "timeline",
    "search",
    "scene",
    "inspector",
    "annotation",
    "participants",
    "sessions",
    "shell",
    "starting",
    ".",
]
PAGE_FLOOR = {room: floor for floor, room in enumerate(PAGE_ROOMS)}
STATIC = ROOT / "static"
PAGE_IMPORT = re.compile(r"""(?:from\s+|import\s*\(\s*|import\s+)["'](\.[^"']+)["']""")
"""Imports of modules and of types."""
SCRIPTS = {p.relative_to(STATIC).as_posix(): p.read_text("utf-8") for p in sorted(STATIC.rglob("*.js"))}


def page_room(script):
    return Path(script).parent.as_posix()


def page_imports(script):
    """Scripts that a script imports, by their path below static/."""
    base = (STATIC / script).parent
    return {(base / target).resolve().relative_to(STATIC).as_posix() for target in PAGE_IMPORT.findall(SCRIPTS[script])}
