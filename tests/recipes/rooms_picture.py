"""Draw the rooms of the house: `python tests/recipes/rooms_picture.py docs/images/rooms.svg`.

Rows are floors: a room imports only rooms on lower floors. tests/test_docs.py checks that every room is drawn.
"""

import sys
from html import escape
from pathlib import Path

HOUSE = {
    "static/  the page": [
        ["main.js"],
        ["shell"],
        ["annotation"],
        ["inspector", "sessions", "participants"],
        ["search"],
        ["timeline", "scene"],
        ["posing"],
        ["panes"],
        ["model", "layout", "share"],
        ["widgets", "starting"],
    ],
    "app/  the viewer": [
        ["main"],
        ["cli/calibration", "cli/observations"],
        ["cli/annotation", "cli/batches"],
        ["cli", "share"],
        ["bench", "server"],
        ["page", "scene3d"],
        ["page/feeds"],
        ["advice"],
        ["messages"],
        ["participants"],
        ["control"],
        ["control/posing", "control/tracking"],
        ["control/search", "control/view"],
        ["control/session", "export"],
        ["session", "storage"],
        ["drawing"],
        ["state", "runtime"],
    ],
    "tracker/  the library": [
        ["batch", "simulate"],
        ["api", "annotation"],
        ["evaluation/judging", "evaluation/markers"],
        ["evaluation/agreement"],
        ["evaluation"],
        ["pipeline"],
        ["calibration/self_calibration"],
        ["calibration/boards"],
        ["calibration/check"],
        ["interchange/exports/like", "interchange/exports/datasets"],
        ["interchange/exports", "interchange/plausibility", "interchange/detection"],
        ["interchange/observations"],
        ["estimation/posing", "estimation/initialization"],
        ["estimation/initialization/generators"],
        ["estimation/acquisition"],
        ["estimation/chamfer", "estimation/contour", "estimation/voxel"],
        ["estimation/runs"],
        ["estimation/by_frame"],
        ["estimation/tracking"],
        ["estimation/search", "estimation/appearance", "estimation/trajectory"],
        ["estimation/fitting"],
        ["evidence/voxels"],
        ["evidence"],
        ["evidence/images", "evidence/contours"],
        ["session/store"],
        ["session"],
        ["footage"],
        ["formats/write_only", "formats/keypoints", "formats/joint_tables", "formats/calibrations"],
        ["formats"],
        ["body/motion"],
        ["body"],
        ["geometry"],
        ["compute", "errors, files"],
    ],
}
WINGS = ("evaluation", "calibration", "interchange", "estimation", "evidence", "session", "formats", "body")
"""Folders of the library with several rooms, whose names stand beside them."""
COLORS = {"static/  the page": "#d9822b", "app/  the viewer": "#3d8bd4", "tracker/  the library": "#3a9a6b"}
WIDTH, ROW, GAP, TOP, WING = 960, 34, 6, 64, 92
WIDTHS = {"static/  the page": 180, "app/  the viewer": 310, "tracker/  the library": 440}
INK = "#1d2733"
FONT = "font-family='system-ui, sans-serif'"


def drawing():
    """The picture as SVG."""
    height = TOP + max(len(rows) for rows in HOUSE.values()) * (ROW + GAP) + 44
    out = [
        f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {WIDTH} {height}' {FONT} font-size='13'>",
        f"<rect width='{WIDTH}' height='{height}' rx='10' fill='#f7f8fa'/>",
    ]
    x = 8.0
    for name, rows in HOUSE.items():
        width, color = WIDTHS[name], COLORS[name]
        out.append(
            f"<text x='{x + width / 2}' y='34' text-anchor='middle' font-weight='600' fill='{INK}'>{name}</text>"
        )
        base = TOP + (max(len(r) for r in HOUSE.values()) - len(rows)) * (ROW + GAP)
        places = [base + i * (ROW + GAP) for i in range(len(rows))]
        for wing in WINGS if name.startswith("tracker") else ():
            own = [y for y, row in zip(places, rows, strict=True) if wing_of(row[0]) == wing]
            out += box(wing, x, own[0], WING, own[-1] + ROW - own[0], color, 0.34)
        for i, (y, row) in enumerate(zip(places, rows, strict=True)):
            inset = WING + GAP if name.startswith("tracker") and wing_of(row[0]) in WINGS else 0
            w = (width - inset - GAP * (len(row) - 1)) / len(row)
            for k, room in enumerate(row):
                text = room.partition("/")[2] if inset and "/" in room else room
                out += box(text, x + inset + k * (w + GAP), y, w, ROW, color, 0.16 if i % 2 else 0.24)
        x += width + 7
    out.append(
        f"<text x='{WIDTH / 2}' y='{height - 16}' text-anchor='middle' fill='#53606e'>"
        "A room imports only rooms on lower floors. app imports tracker, never the other way; "
        "page and program talk by the pane socket.</text></svg>"
    )
    return "\n".join(out) + "\n"


def wing_of(room):
    return room.partition("/")[0]


def box(text, x, y, width, height, color, opacity):
    """A room or a wing with its name in the middle."""
    return [
        f"<rect x='{x:.1f}' y='{y}' width='{width:.1f}' height='{height}' rx='5' fill='{color}' "
        f"fill-opacity='{opacity}' stroke='{color}'/>"
        f"<text x='{x + width / 2:.1f}' y='{y + height / 2 + 4.5}' text-anchor='middle' fill='{INK}'"
        f"{size(text, width)}>{escape(text)}</text>"
    ]


def size(room, width):
    """Smaller letters for a long name in a narrow room."""
    return " font-size='11'" if len(room) * 7.2 > width - 6 else ""


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(drawing(), "utf-8")
