"""Each colour has one meaning, and what is seen together differs for every kind of colour vision, or in shape."""

import json
import re
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pytest
from architecture import ROOT
from color_vision import MACHADO_2009, ciede2000, contrast, difference, lab, over, rgb, seen_with

from app.drawing import overlay_colors
from app.drawing.overlay_colors import KIND_COLORS
from tracker.session.session import PALETTE

APART = 10
"""Least CIEDE2000 difference of what is seen together in the same shape, with every kind of colour vision."""
OWN_HUE = 15
"""Least CIEDE2000 difference, with normal vision, between a reserved colour and everything else, whatever its shape."""
TEXT, GRAPHICS = 4.5, 3.0
"""Least contrast ratios of WCAG 2.2, criteria 1.4.3 and 1.4.11."""
NEARLY_GREY = 0.06
"""Largest spread of the channels of a grey."""
SCHEMES = ("dark", "light")
BLACK, WHITE = rgb("#000"), rgb("#fff")


class Seen(NamedTuple):
    """A mark in a place of the page."""

    name: str
    color: str
    shape: str


def sheet(name):
    return (ROOT / "static" / name).read_text("utf-8")


def tokens(scheme):
    """Return the custom properties of the page in a scheme, by name."""
    found = {}
    for selectors, rules in re.findall(r"^([^{}/*]+)\{([^}]*)\}", sheet("styles/tokens.css"), re.MULTILINE):
        if scheme == "light" or "light" not in selectors:
            found |= dict(re.findall(r"--([\w-]+):\s*([^;]+);", rules))
    return found


def table_of(source, name):
    """Return a literal table of a JavaScript module whose values have only plain values."""
    body = re.search(rf"const {name} = (\{{.*?\n\}});", sheet(source), re.DOTALL)[1]
    body = re.sub(r"//.*", "", body)
    return json.loads(re.sub(r",(\s*[}\]])", r"\1", re.sub(r"(?<![\"\w-])([A-Za-z_]\w*):", r'"\1":', body)))


LINES = table_of("panes/drawing.js", "LINE_STYLES")
SOURCES = table_of("timeline/cell_marks.js", "SOURCE_MARKS")
RIGHT_DASH = json.loads(re.search(r"RIGHT_DASH = (\[.*?\]);", sheet("panes/drawing.js"))[1])
OWN_SHAPES = {
    "facing": "arrow", "facing_away": "arrow", "epipolar": "straight line across the pane",
    "floor": "crosses and grid", "part_edge": "thin line in an outline", "accepted": "loose strokes",
    "rejected": "loose strokes", "residual": "short strokes across the outlines",
    "imported": "crosses joined by lines", "imported_off": "crosses joined by lines",
}  # fmt: skip
"""Kinds of lines whose shape, not their dash, tells them from outlines of bodies."""


def dash_class(dash):
    """Return how the eye reads a dash."""
    names = {0: "solid", 2: "dashed", 4: "dash-dot", 6: "dash-dot-dot"}
    return "dotted" if len(dash) == 2 and dash[0] < dash[1] else names[len(dash)]


def lines_over_footage():
    people = [
        Seen(f"person {i + 1}, {side}", color, f"outline, {dash_class(dash)}")
        for i, color in enumerate(PALETTE)
        for side, dash in (("left", []), ("right", RIGHT_DASH))
    ]
    kinds = [
        Seen(kind, color, OWN_SHAPES.get(kind) or f"outline, {dash_class(LINES[kind]['dash'])}")
        for kind, color in KIND_COLORS.items()
        if kind != "floor_sight"  # a line of sight, like "epipolar"
    ]
    bones = [Seen("bone", overlay_colors.NEUTRAL, "straight line between joints")]
    off = [Seen("distance to pin or pointer", tokens("dark")["image-off"], "short dashes to a joint")]
    return [*people, *kinds, *bones, *off, Seen("silhouette", overlay_colors.SILHOUETTE, "area")]


def timeline(scheme):
    page = tokens(scheme)
    people = [Seen(f"person {i + 1}", color, "lane") for i, color in enumerate(PALETTE)]
    statuses = [Seen(s, page[t], "bar") for s, t in (("good", "good"), ("doubtful", "warning"), ("lost", "bad"))]
    sources = [Seen(s, page[mark["color"][2:]], str(mark["bands"])) for s, mark in SOURCES.items()]
    return [*people, *statuses, *sources, Seen("marked range", page["accent"], "bracket")]


def curves(scheme):
    page = tokens(scheme)
    return [Seen(f"curve {i}", page[f"series-{i % 4}"], "solid" if i < 4 else "dashed") for i in range(8)]


def trails():
    return [Seen("before", overlay_colors.TRAIL_BEFORE, ""), Seen("after", overlay_colors.TRAIL_AFTER, "")]


PLACES = {
    "footage": lines_over_footage(),
    "trails": trails(),
    **{f"{what.__name__}, {scheme}": what(scheme) for what in (timeline, curves) for scheme in SCHEMES},
}


def confused(marks):
    """Return the pairs of one shape and different meaning that some people cannot tell apart."""
    pairs = [(a, b) for a, b in combinations(marks, 2) if a.shape == b.shape]
    left, right = (np.array([rgb(mark.color) for mark in side]) for side in zip(*pairs, strict=True))
    apart = {v: ciede2000(lab(seen_with(v, left)), lab(seen_with(v, right))) for v in MACHADO_2009}
    nearest = [min((float(apart[v][i]), v) for v in MACHADO_2009) for i in range(len(pairs))]
    return [
        f"{a.name} and {b.name}: {found:.1f} with {vision}"
        for (a, b), (found, vision) in zip(pairs, nearest, strict=True)
        if found < APART
    ]


@pytest.mark.parametrize("place", PLACES)
def test_curves_seen_together_differ_in_color_or_shape(place):
    assert confused(PLACES[place]) == []


@pytest.mark.parametrize("scheme", SCHEMES)
def test_warnings_errors_selection_and_marks_own_their_hues(scheme):
    """The colour of a warning is that of nothing else. Over images, both schemes use the colours of the dark one."""
    page = tokens(scheme)
    reserved = {name: page[name] for name in ("accent", "good", "warning", "bad")}
    others = {f"person {i + 1}": color for i, color in enumerate(PALETTE)}
    others |= {name: color for name, color in page.items() if name.startswith(("source-", "series-"))}
    others |= {"trail before": overlay_colors.TRAIL_BEFORE, "trail after": overlay_colors.TRAIL_AFTER}
    if scheme == "dark":
        reserved["mark"] = overlay_colors.MARK
        others |= {"accepted": overlay_colors.ACCEPTED, "rejected": overlay_colors.REJECTED}
        others["imported"] = overlay_colors.IMPORTED
    pairs = [*combinations(reserved.items(), 2), *((a, b) for a in reserved.items() for b in others.items())]
    near = [(a, b, difference(rgb(x), rgb(y))) for (a, x), (b, y) in pairs]
    assert [f"{a} and {b}: {found:.1f}" for a, b, found in near if found < OWN_HUE] == []


def test_the_first_people_are_far_from_outlines_over_them():
    """A candidate or new sizes nearly coincide with the body: the dash alone is hard to see there."""
    outlines = (overlay_colors.NEUTRAL, overlay_colors.PROPOSAL)
    assert min(difference(rgb(a), rgb(b)) for a in PALETTE[:2] for b in outlines) > 30


def test_python_and_the_page_draw_with_the_same_colors():
    page = tokens("light")
    assert page["image-proposal"] == overlay_colors.PROPOSAL == tokens("dark")["accent"]
    assert page["image-off"] == tokens("dark")["bad"]
    assert page["image-mark"] == overlay_colors.MARK
    assert (rgb(page["image-neutral"]) == rgb(overlay_colors.NEUTRAL)).all()


def test_only_tokens_have_hues():
    """Everywhere else the page takes its colours from the tokens or from messages, but for greys."""
    found = []
    for path in sorted((ROOT / "static").rglob("*.*")):
        if path.suffix not in (".css", ".js") or path.name == "tokens.css":
            continue
        text = re.sub(r"linear-gradient\(to right, #fcffa4[^)]*\)", "", path.read_text("utf-8"))  # OpenCV's inferno
        colors = [rgb(digits) for digits in re.findall(r"#([0-9a-fA-F]{6}|[0-9a-fA-F]{3})\b(?=[;\s\"',)])", text)]
        colors += [np.array(c, float) / 255 for c in re.findall(r"rgba?\((\d+),? (\d+),? (\d+)", text)]
        found += [(path.name, color) for color in colors if np.ptp(color) > NEARLY_GREY]
    assert found == []


@pytest.mark.parametrize("scheme", SCHEMES)
def test_text_and_marks_stand_out_from_their_background(scheme):
    page = {name: rgb(color) for name, color in tokens(scheme).items() if color.startswith("#")}
    areas, plots = ("chrome", "raised", "track"), ("plot",)
    wanted = [
        *((name, ground, TEXT) for name in ("text", "muted") for ground in (*areas, "pressed", "stage", "plot")),
        *((name, ground, TEXT) for name in ("accent", "good", "warning", "bad") for ground in ("chrome", "raised")),
        *((f"on-{name}", name, TEXT) for name in ("accent", "warning", "bad")),
        *((name, ground, GRAPHICS) for name in ("accent", "good", "warning", "bad") for ground in (*areas, "pressed")),
        *((name, "track", GRAPHICS) for name in page if name.startswith("source-")),
        *((name, ground, GRAPHICS) for name in page if name.startswith("series-") for ground in (*plots, "chrome")),
        ("faint", "chrome", GRAPHICS), ("faint", "raised", GRAPHICS),
    ]  # fmt: skip
    low = [(a, b, contrast(page[a], page[b]), least) for a, b, least in wanted]
    assert [f"{a} on {b}: {found:.2f}" for a, b, found, least in low if found < least] == []


@pytest.mark.parametrize("scheme", SCHEMES)
def test_areas_of_people_stand_out_or_have_an_edge(scheme):
    page = tokens(scheme)
    edge = re.match(r"rgb\(0 0 0 / (\d+)%\)", page["edge"])
    for color in map(rgb, PALETTE):
        shown = over(BLACK, int(edge[1]) / 100, color) if edge else color
        assert contrast(shown, rgb(page["track"])) >= GRAPHICS


@pytest.mark.parametrize("ground", [BLACK, WHITE], ids=["black", "white"])
def test_lines_are_legible_on_any_footage(ground):
    """The outline darkens bright footage around a line; a line without an outline is legible by itself."""
    share = int(re.search(r"/ (\d+)%", tokens("dark")["image-outline"])[1]) / 100
    outline = over(BLACK, share, ground)
    kinds = {**KIND_COLORS, **dict.fromkeys(("model", "hidden", "facing", "facing_away", "error"), None)}
    low = []
    for kind, own in kinds.items():
        for color in PALETTE if own is None else [own]:
            found = contrast(rgb(color), outline if LINES[kind]["hasOutline"] else ground)
            low += [f"{kind} {color}: {found:.2f}"] if found < GRAPHICS else []
    assert set(kinds) == set(LINES)
    assert low == []


def test_trails_are_legible_in_both_schemes():
    for color in (overlay_colors.TRAIL_BEFORE, overlay_colors.TRAIL_AFTER, overlay_colors.TRAIL_END):
        assert min(contrast(rgb(color), BLACK), contrast(rgb(color), WHITE)) >= GRAPHICS


def test_difference_and_contrast_have_their_published_values():
    """CIEDE2000 test data of Sharma, Wu, Dalal 2005, Table 1, and the contrast of black on white."""
    data = [
        ((50, 2.6772, -79.7751), (50, 0, -82.7485), 2.0425), ((50, 0, 0), (50, -1, 2), 2.3669),
        ((50, 2.5, 0), (73, 25, -18), 27.1492), ((2.0776, 0.0795, -1.135), (0.9033, -0.0636, -0.5514), 0.9082),
    ]  # fmt: skip
    for a, b, expected in data:
        assert float(ciede2000(np.array(a, float), np.array(b, float))) == pytest.approx(expected, abs=1e-4)
    assert contrast(BLACK, WHITE) == pytest.approx(21)
    assert lab(WHITE) == pytest.approx([100, 0, 0], abs=1e-3)
