"""Imports run one way: each module from those below it, none from beside or above. The order is written down here."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

# From the bottom up. A module may import from the rows above its own in this list, never from its own row or further
# down. A new module takes its place here; one that finds none is two concepts, or in the wrong file.
ORDER = [
    [
        "tracker",
        "tracker.formats",
        "tracker.errors",
        "tracker.kernels",
        "tracker.quantiles",
        "tracker.rigid",
        "tracker.store_schema",
        "tracker.footage_index",
    ],
    ["tracker.footage_listing", "tracker.nearest", "tracker.silhouettes"],
    [
        "tracker.cameras",
        "tracker.floor",
        "tracker.shapes",
        "tracker.kinematics",
        "tracker.probes",
        "tracker.segments",
        "tracker.edges",
        "tracker.files",
        "tracker.footage",
        "tracker.records",
    ],
    ["tracker.joints", "tracker.sampling", "tracker.scenery", "tracker.stored_poses", "tracker.twists"],
    ["tracker.session_lock", "tracker.annotations", "tracker.body", "tracker.matched", "tracker.silhouette_contour"],
    ["tracker.formats.anipose", "tracker.formats.trc", "tracker.formats.model_toml", "tracker.formats.pose_table"],
    ["tracker.picking", "tracker.sights", "tracker.surfaces"],
    ["tracker.outlines", "tracker.hiding"],
    ["tracker.contours", "tracker.fit", "tracker.joint_maps"],
    ["tracker.orienting"],
    [
        "tracker.occlusion",
        "tracker.part_masks",
        "tracker.posing",
        "tracker.sizes",
        "tracker.evaluate",
        "tracker.interpolate",
        "tracker.standing",
        "tracker.disagree",
        "tracker.measures",
    ],
    ["tracker.occlusion", "tracker.pins", "tracker.posing", "tracker.sizes", "tracker.evaluate"],
    ["tracker.rebody"],
    # The session keeps its cameras and models in files of these formats, so it reads and writes by them; a format
    # knows cameras, bodies and tables, never a session.
    ["tracker.session", "tracker.proxy"],
    ["tracker.locks", "tracker.recording", "tracker.references"],
    ["tracker.foreground"],
    ["tracker.assemble", "tracker.evidence", "tracker.simulate"],
    ["tracker.kept", "tracker.observer"],
    ["tracker.limb_look", "tracker.matching", "tracker.points"],
    ["tracker.chamfer", "tracker.predict", "tracker.appearance", "tracker.refine", "tracker.apart"],
    ["tracker.descent", "tracker.sharing", "tracker.surroundings"],
    ["tracker.search", "tracker.confidence"],
    ["tracker.recover", "tracker.pose_edits", "tracker.memory"],
    ["tracker.track_settings"],
    ["tracker.scene", "tracker.frame_fit", "tracker.ways"],
    ["tracker.track"],
    ["tracker.second_pass"],
    # The program: what the screen shows, then who may change it, then who shows it.
    [
        "app",
        "app.access",
        "app.allocation",
        "app.cells",
        "app.jobs",
        "app.layers",
        "app.private_viser",
        "app.viser_proxy",
        "app.painting",
        "app.pictures",
        "app.recent",
        "app.tracked",
        "app.words",
        "app.writing",
    ],
    ["app.centred", "app.expected", "app.floor_picks", "app.trails", "app.view_choice"],
    ["app.state"],
    ["app.samples"],
    ["app.bench_scenes", "app.commands", "app.curves", "app.frames", "app.overlays", "app.saving", "app.server"],
    ["app.bench_rows", "app.dofs", "app.floor_lines", "app.graspable", "app.pin_marks", "app.runs", "app.screen"],
    [
        "app.casting",
        "app.choosing",
        "app.hand",
        "app.history",
        "app.locks",
        "app.pose_edits",
        "app.searching",
        "app.tracking",
        "app.disagreements",
        "app.listing",
        "app.compiling",
    ],
    ["app.compile_kernels", "app.flooring", "app.viewing"],
    ["app.landscape", "app.pinning", "app.sizing", "app.ranges", "app.replay", "app.search_settings"],
    ["app.controller", "app.messages", "app.headless", "app.indexing"],
    ["app.pace"],
    [
        "app.body_panel",
        "app.frusta",
        "app.gizmos",
        "app.pose_intentions",
        "app.snap",
        "app.view_panel",
        "app.search_feed",
        "app.search_intentions",
        "app.settings_panel",
    ],
    ["app.intentions"],
    ["app.panels", "app.picture_sets"],
    ["app.panes", "app.scene"],
    ["app.workbench"],
    ["app.bench"],
    ["app.ending"],
    ["app.__main__"],
]
LEVEL = {module: level for level, row in enumerate(ORDER) for module in row}

# What a library without a screen does without.
OF_THE_SCREEN = {"app", "viser", "aiohttp", "tyro", "rich", "webbrowser", "asyncio"}


def module_files():
    """Path of every module of the project by its dotted name."""
    files = {}
    for package in ("tracker", "app"):
        for path in sorted((ROOT / package).rglob("*.py")):
            files[".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")] = path
    return files


FILES = module_files()


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


def place_of(module):
    """Level of a module; those within the simulator have the level of the whole."""
    return LEVEL["tracker.simulate"] if module.startswith("tracker.simulate.") else LEVEL.get(module)


def test_the_walk_sees_imports_of_every_kind():
    within = "def f():\n    from tracker.body import Body\n    import viser as v\n"
    text = "import app.state\nfrom tracker import rigid, nothing\n" + within
    assert imported(ast.parse(text), FILES) == {"app.state", "tracker.rigid", "tracker", "tracker.body", "viser"}
    assert len(FILES) > 50


def test_every_module_has_its_place():
    assert sorted(m for m in FILES if place_of(m) is None) == [], "give them a row in ORDER"
    assert sorted(LEVEL.keys() - FILES.keys()) == [], "take them out of ORDER"


@pytest.mark.parametrize("module", sorted(FILES))
def test_imports_run_downwards(module):
    within_simulate = [
        m for m in OWN[module] if module.startswith("tracker.simulate") and m.startswith("tracker.simulate.")
    ]
    wrong = [m for m in OWN[module] if m not in within_simulate and place_of(m) >= place_of(module)]
    assert wrong == [], f"{module} must not import these"


def test_no_circle_within_the_simulator():
    inner = {
        m: [i for i in OWN[m] if i.startswith("tracker.simulate.")] for m in FILES if m.startswith("tracker.simulate")
    }
    while inner:
        free = [m for m, needs in inner.items() if not any(n in inner for n in needs)]
        assert free, f"import circle among {', '.join(inner)}"
        for m in free:
            del inner[m]


@pytest.mark.parametrize("module", sorted(m for m in FILES if m.split(".")[0] == "tracker"))
def test_the_tracker_knows_no_screen(module):
    assert {name.split(".")[0] for name in IMPORTS[module]} & OF_THE_SCREEN == set()


def test_the_controller_imports_no_view():
    views = {"app.messages", "app.panes", "app.scene", "app.panels", "app.overlays", "app.server", "app.workbench"}
    below = ("app.screen", "app.searching", "app.tracking", "app.saving", "app.frames", "app.state", "app.jobs")
    for module in ("app.controller", *below):
        assert views & set(OWN[module]) == set(), module
        assert {name.split(".")[0] for name in IMPORTS[module]} & {"viser", "aiohttp", "tyro"} == set(), module


def test_formats_know_no_session():
    for module in FILES:
        if module.startswith("tracker.formats"):
            assert {"tracker.session", "tracker.recording", "tracker.annotations"} & set(OWN[module]) == set(), module


def test_the_cost_knows_no_part_edges():
    """Where parts meet is drawn for the eye and never matched (GD96 Sect. 5)."""
    for module in ("tracker.chamfer", "tracker.search", "tracker.scene", "tracker.track"):
        assert "tracker.occlusion" not in OWN[module]
