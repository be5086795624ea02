"""One word, one meaning: retired names and private words do not come back."""

import io
import re
import tokenize

from architecture import FILES, ROOT, SCRIPTS, STATIC

# Identifier today -> what took its place. Whole names, in all of Python, tests included.
RETIRED = {
    "LimbLook": "LimbScorer",
    "Kept": "StaticContours",
    "told_of": "settings_record",
    "spoken": "display_name",
    "_NEAREST_M": "NEAR_PLANE_M, or a name for what it is",
    "OtherPose": "Alternative",
    "views_px": "view_costs_px",
    "parts_px": "part_costs_px",
    "place_px": "position_px",
    "FrameNumbers": "FramePose",
    "StayNear": "PosePrior",
    "KeepApart": "SelfPenetration",
    "KeepBodiesApart": "BodyPenetration",
    "ContourMatch": "ContourResiduals",
    "nearest_alike": "nearest_oriented_segment",
    "nearest_alongside": "nearest_parallel_segment",
    "cheapest_way": "viterbi_path",
    "follow_back": "TrackSession.backward_pass",
    "Followed": "BackwardStep",
    "MatchedView": "WorkingView",
    "Probes": "SampleGrid",
    "Scenery": "StaticEdgeModel",
    "BORROW": "NO_REFCOUNT",
    "dealt_out": "map_chunked",
    "side_by_side": "map_parallel",
    "rebodied": "retarget_pose",
    "embody": "set_body_models",
    "summed_up": "make_estimate",
    "Sharing": "EvidencePool",
    "Screen": "SessionState",
    "Casting": "PeopleVisibility",
    "Choosing": "Alternatives",
    "Flooring": "FloorEditing",
    "Sizing": "BodySizeEditing",
    "Listing": "FootageScan",
    "Recent": "ByteBoundedCache",
    "ViewPin": "PointObservation",
    "BodySizes": "BodyDimensions",
    "write_text_whole": "write_text_atomic",
}
# Private words in prose: comments, docstrings, documents, what the page shows.
WORDS = re.compile(r"\b(anew|in vain|at hand|whoever|whosoever|as it were|so to speak)\b", re.IGNORECASE)
PYTHON = [*FILES.values(), *sorted((ROOT / "tests").rglob("*.py"))]
PROSE = [
    *PYTHON,
    *sorted(ROOT.glob("*.md")),
    *sorted((ROOT / "docs").rglob("*.md")),
    *(STATIC / script for script in SCRIPTS),
    *sorted(STATIC.rglob("*.html")),
]


def names_in(text):
    return {t.string for t in tokenize.generate_tokens(io.StringIO(text).readline) if t.type == tokenize.NAME}


def test_retired_names_stay_retired():
    retired = re.compile(rf"\b({'|'.join(RETIRED)})\b")
    texts = {path: text for path in PYTHON if retired.search(text := path.read_text("utf-8"))}  # tokens take long
    found = {path: names_in(text) & RETIRED.keys() for path, text in texts.items()}
    assert {f"{path.relative_to(ROOT)}: {n} is {RETIRED[n]}" for path, names in found.items() for n in names} == set()


def test_prose_keeps_to_plain_words():
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in PROSE
        if path.name != "test_vocabulary.py"
        for number, line in enumerate(path.read_text("utf-8").splitlines(), 1)
        if WORDS.search(line)
    ]
    assert found == []


def test_names_of_tests_have_a_subject():
    """A reader of a report knows which thing failed."""
    names = re.findall(r"def (test_\w+)", "".join(p.read_text("utf-8") for p in (ROOT / "tests").rglob("test_*.py")))
    assert [n for n in names if re.match("test_(what|where|who|whose|those|nor)_", n) or len(n) > 100] == []


def test_one_class_has_one_name():
    """No two classes of the program share a name; messages are named after what they carry."""
    declarations = "client pose search server base binary_headers"
    messages = {f"app.messages.{name}" for name in declarations.split()}
    places = {}
    for module in FILES.keys() - messages:
        for name in re.findall(r"^class ([A-Z]\w*)", FILES[module].read_text("utf-8"), re.MULTILINE):
            places.setdefault(name, []).append(module)
    assert {name: modules for name, modules in places.items() if len(modules) > 1} == {}
