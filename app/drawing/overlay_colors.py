"""Colours over footage: one meaning for each, the same in both colour schemes.

`docs/colours.md` lists all colours of the program. `tracker/session/session.py` has those of people, and
`static/styles/tokens.css` those of the page. `tests/app/drawing/test_colors.py` compares them for every kind of colour
vision.
"""

NEUTRAL = "#ffffff"
"""Poses beside the shown one for comparison, bones, limbs that stand out. Their lines differ in dash."""
PROPOSAL = "#5aa9ff"
"""Poses that a press would take: a candidate, an alternative, new body sizes. The accent of the page."""
MARK = "#f0e442"
"""Marks placed by hand, their lines of sight, and the floor that they give. Yellow of Okabe and Ito (2008)."""
PART_EDGE = "#d7dbe0"
SILHOUETTE = "#7ff0e0"
ACCEPTED = "#00a389"
REJECTED = "#b32a9c"
"""Edge segments that the shown poses explain, and the others: legible without an outline on black and on white."""
IMPORTED = "#d9c3a0"
"""Points of other programs: quiet beside the bodies of people."""
IMPORTED_OFF = "#f65a80"
"""Limbs of them that are off: the rose red of what is lost or failed."""
KIND_COLORS = {
    "candidate": NEUTRAL,
    "compared": NEUTRAL,
    "result": NEUTRAL,
    "preview": PROPOSAL,
    "alternative": PROPOSAL,
    "new_sizes": PROPOSAL,
    "other_copy": NEUTRAL,
    "former": NEUTRAL,
    "part_edge": PART_EDGE,
    "epipolar": MARK,
    "floor": MARK,
    "floor_sight": MARK,
    "accepted": ACCEPTED,
    "rejected": REJECTED,
    "residual": NEUTRAL,
    "imported": IMPORTED,
    "imported_off": IMPORTED_OFF,
}
"""Colours of the kinds of lines; all other kinds have the colour of their person."""
OUTLINE_RGB = (0, 0, 0)
TRAIL_BEFORE = "#8a5cf0"
TRAIL_AFTER = "#5f8f1e"
TRAIL_END = "#8c8c91"
"""Trails: just before the shown frame, just after it, and at both ends. Legible on white and on black."""


def rgb(color: str) -> tuple[int, int, int]:
    """Return the channels of `#rrggbb`, 0 to 255."""
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)
