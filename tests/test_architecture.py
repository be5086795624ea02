"""Imports run one way: a room imports only rooms below it (tests/support/architecture.py lists them)."""

import ast
import re
from itertools import groupby

from architecture import (
    FILES,
    FLOOR,
    OF_THE_SCREEN,
    ONLY_ROOMS,
    PAGE_FLOOR,
    ROOMS,
    ROOT,
    SCRIPTS,
    STATIC,
    imported,
    imports,
    own_imports,
    page_imports,
    page_room,
    room_of,
    trees,
    wing_of,
)

MEASURING = ("tracker.simulate", "app.bench")


def test_the_walk_sees_imports_of_every_kind():
    within = "def f():\n    from tracker.errors import TrackerError\n    import viser as v\n"
    text = "import app.main\nfrom tracker import files, nothing\n" + within
    assert imported(ast.walk(ast.parse(text)), FILES) == {
        "app.main",
        "tracker.files",
        "tracker",
        "tracker.errors",
        "viser",
    }
    assert len(FILES) > 50


def test_imports_run_downwards():
    wrong = {
        f"{module} imports {m}"
        for module, needs in own_imports().items()
        for m in needs
        if room_of(m) != room_of(module) and FLOOR[room_of(m)] >= FLOOR[room_of(module)]
    }
    assert wrong == set()


def test_wings_import_one_way():
    """Rooms run downwards, so that wings do if the rooms of each follow one another in the list."""
    wings = [wing_of(room) for room in ROOMS if room.startswith("tracker.")]
    assert len([*groupby(wings)]) == len({*wings}) < 20
    assert {*wings} - FLOOR.keys() == set()
    assert {*wings} - {room_of(m) for m in FILES if m not in FLOOR} == ONLY_ROOMS


def test_no_circle():
    left = {m: set(needs) - {m} for m, needs in own_imports().items()}
    while left:
        free = [m for m, needs in left.items() if not needs & left.keys()]
        assert free, f"import circle among {', '.join(sorted(left))}"
        for m in free:
            del left[m]


def test_the_tracker_knows_no_screen():
    roots = {m: {name.split(".")[0] for name in found} for m, found in imports().items() if m.startswith("tracker")}
    assert {m: found & OF_THE_SCREEN for m, found in roots.items() if found & OF_THE_SCREEN} == {}


def test_statistics_are_loaded_where_they_are_used():
    """They take 0.8 s, for which each start of the program would wait."""
    at_top = {name: [n for n in tree.body if isinstance(n, ast.ImportFrom)] for name, tree in trees().items()}
    assert [name for name, first in at_top.items() if any(n.module == "scipy.stats" for n in first)] == []


def test_measuring_is_of_no_use_to_the_product():
    """Simulated recordings, experiments and benchmarks are started by commands alone."""
    users = {(m, wing_of(n)) for m, needs in own_imports().items() for n in needs if n.startswith(MEASURING)}
    others = {(m, wing) for m, wing in users if not m.startswith((*MEASURING, "app.cli."))}
    assert len(users) > 20
    assert others == set()


def test_the_page_imports_run_downwards():
    wrong = {  # `make page-types` writes the types of model/protocol.js
        f"{script} imports {s}"
        for script in SCRIPTS
        for s in page_imports(script)
        if s not in {"model/protocol.js", *SCRIPTS} or PAGE_FLOOR[page_room(s)] > PAGE_FLOOR[page_room(script)]
    }
    assert wrong == set()


def test_named_parts_of_rooms_exist():
    """The docstring of a room names `file.function`, or a room as `room.part`."""
    missing = {
        f"{room}: {file}.{name}"
        for room in (m for m, path in FILES.items() if path.name == "__init__.py")
        for file, name in re.findall(r"`([a-z_0-9]+)\.([A-Za-z_0-9]+)`", ast.get_docstring(trees()[room]) or "")
        if not _is_offered(room, file, name)
    }
    assert missing == set()


def _is_offered(room, file, name):
    if {f"{file}.{name}", f"{room.split('.')[0]}.{file}.{name}"} & FILES.keys():
        return True
    module = FILES.get(f"{room}.{file}")
    return module is not None and bool(re.search(rf"^(def |class )?{name}\b", module.read_text("utf-8"), re.MULTILINE))


def test_each_room_of_the_library_names_what_others_use():
    """`__all__` of a room has the modules that other rooms import, so that a new use is made on purpose."""
    used = {room: set() for room in ROOMS if room.startswith("tracker.")}
    for module, needs in own_imports().items():
        for m in needs:
            if room_of(m) in used and room_of(m) != room_of(module) and m != room_of(m):
                used[room_of(m)].add(m.rpartition(".")[2])
    stated = {}
    for room in used:
        names = [n for n in trees()[room].body if isinstance(n, ast.Assign) and ast.unparse(n.targets[0]) == "__all__"]
        stated[room] = {e.value for n in names for e in n.value.elts}
    stated["tracker.simulate"] = used["tracker.simulate"]  # it offers functions instead
    assert stated == used


WRITERS = {
    "tracker.batch.join": "stretches of a long recording, as they were tracked",
    "tracker.pipeline.body_acquisition": "the start, in other sizes",
    "tracker.pipeline.find_people": "starts that are found",
    "tracker.pipeline.given_pose": "starts that are given",
    "tracker.pipeline.keypoint_poses": "poses by key points, by `solve_path`",
    "tracker.pipeline.tracked_changes": "poses of the first pass, of a run and of an audit, by `run_estimate`",
}
"""Modules of the library that write poses, and which: the pose of a run is decided in one place."""


def test_poses_are_written_where_they_are_known_to_be():
    found = {
        module
        for module, tree in trees().items()
        if module.startswith("tracker.")
        for n in ast.walk(tree)
        if isinstance(n, ast.Call) and ast.unparse(n.func) == "PoseChange"
    }
    assert found == WRITERS.keys()


def test_no_folder_is_crowded():
    """Next to nothing at a root, at most 22 files in a room."""
    folders = {p.parent for p in [*FILES.values(), *STATIC.rglob("*.js"), *STATIC.rglob("*.css")]}
    crowded = {f.relative_to(ROOT).as_posix(): len([p for p in f.iterdir() if p.is_file()]) for f in folders}
    assert {name: n for name, n in crowded.items() if n > (5 if name in ("tracker", "app", "quadrille") else 22)} == {}


def test_rooms_look_up_their_own_markup():
    """Or that of rooms below, or of index.html; no id is declared twice."""
    ids = [
        (i, p.parts[-3]) for p in STATIC.rglob("markup/*.html") for i in re.findall(r'\sid="([^"]+)"', p.read_text())
    ]
    looked_up = {(s, i) for s, text in SCRIPTS.items() for i in re.findall(r'\b(?:byId|button)\("([^"]+)"', text)}
    floors = {i: PAGE_FLOOR[room] for i, room in ids}
    assert len(floors) == len(ids) > 200
    assert {(s, i) for s, i in looked_up if floors.get(i, 0) > PAGE_FLOOR[page_room(s)] != PAGE_FLOOR["share"]} == set()


def test_the_page_mounts_rooms():
    """main.js puts rooms together and knows no widget of theirs."""
    imported_by_main = page_imports("main.js")
    others = {s for s in imported_by_main if not s.endswith("/index.js") and not s.startswith("model/")}
    assert others == {"shell/test_hook.js"}
    assert {"panes/index.js", "shell/index.js", "timeline/index.js"} <= imported_by_main
