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
        ["search", "scene"],
        ["posing", "timeline"],
        ["panes"],
        ["model", "layout"],
        ["widgets", "starting", "share"],
    ],
    "app/  the viewer": [
        ["__main__"],
        ["cli/calibration", "cli/observations", "cli/annotation", "cli/batches"],
        ["cli", "share"],
        ["bench", "server"],
        ["page", "scene3d"],
        ["page/feeds"],
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
        ["batch"],
        ["api", "experiments", "annotation"],
        ["judging"],
        ["pipeline", "exports/like"],
        ["exports", "agreement"],
        ["simulate", "evaluation", "self_calibration"],
        ["boards", "posing"],
        ["calibration", "plausibility"],
        ["acquisition", "initialization"],
        ["tracking/chamfer, tracking/contour, tracking/voxel"],
        ["tracking/runs"],
        ["tracking/estimation"],
        ["tracking", "initialization/generators"],
        ["search", "appearance", "trajectory"],
        ["fitting", "voxels", "detection"],
        ["evidence", "observations"],
        ["contours", "images", "store"],
        ["session"],
        ["footage", "calibrations", "motion"],
        ["formats/interchange", "formats/keypoints", "formats/joint_tables"],
        ["formats"],
        ["body"],
        ["geometry"],
        ["compute", "errors, files"],
    ],
}
COLORS = {"static/  the page": "#d9822b", "app/  the viewer": "#3d8bd4", "tracker/  the library": "#3a9a6b"}
WIDTH, ROW, GAP, TOP = 960, 34, 6, 64
WIDTHS = {"static/  the page": 190, "app/  the viewer": 340, "tracker/  the library": 400}
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
        for i, row in enumerate(rows):
            y, w = base + i * (ROW + GAP), (width - GAP * (len(row) - 1)) / len(row)
            for j, room in enumerate(row):
                left = x + j * (w + GAP)
                out.append(
                    f"<rect x='{left:.1f}' y='{y}' width='{w:.1f}' height='{ROW}' rx='5' fill='{color}' "
                    f"fill-opacity='{0.16 if i % 2 else 0.24}' stroke='{color}'/>"
                    f"<text x='{left + w / 2:.1f}' y='{y + ROW / 2 + 4.5}' text-anchor='middle' fill='{INK}'"
                    f"{size(room, w)}>{escape(room)}</text>"
                )
        x += width + 7
    out.append(
        f"<text x='{WIDTH / 2}' y='{height - 16}' text-anchor='middle' fill='#53606e'>"
        "A room imports only rooms on lower floors. app imports tracker, never the other way; "
        "page and program talk by the pane socket.</text></svg>"
    )
    return "\n".join(out) + "\n"


def size(room, width):
    """Smaller letters for a long name in a narrow room."""
    return " font-size='11'" if len(room) * 7.2 > width - 6 else ""


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(drawing(), "utf-8")
