"""Draw the hypotheses of a run and the path through them: `python tests/recipes/path_picture.py docs/images/path.svg`.

The run is of a simulated person at so few pictures a second that the first pass loses a wrist. The picture shows how
high the wrist is in each hypothesis of each frame, in the pose of the first pass, and on the path of the estimate.
"""

import sys
import tempfile
from html import escape
from pathlib import Path

import numpy as np

from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.estimation.runs import run_estimate
from tracker.estimation.tracking.tracker import Subjects, TrackingRun
from tracker.estimation.trajectory.hypotheses import path_marginals, reduce_log_sum
from tracker.evaluation.references import read_joints
from tracker.evidence.observer import open_observer
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.pipeline.methods import make_tracker
from tracker.pipeline.track_session import Leg, TrackSession
from tracker.pipeline.tracked_changes import StoredPerson
from tracker.session.session import load_session
from tracker.simulate import Simulation, simulate

SIMULATION = Simulation("reach_and_cross", 4, 40, 1907, fps=8.0, person="heavy_man")
POINT, AXIS = "right_wrist", 2
WIDTH, HEIGHT, LEFT, TOP, BOTTOM = 900, 420, 64, 48, 56
INK, GREY, FIRST, PATH, TRUTH = "#1d2733", "#8a96a3", "#d9822b", "#3d8bd4", "#3a9a6b"


class Nowhere:
    """Takes poses, and stores nothing."""

    def write(self, label, changes, edit):
        """Drop the poses."""
        return edit


def estimated(folder):
    """Track a session from the true joints of its first frame.

    Returns:
        The search of the path, and the height of the point by the first pass, on the path and in truth.
    """
    session = load_session(folder)
    (person,), table = session.people, read_joints(folder / "truth.trc", session.fps)
    model, joints = person.model, [dict(zip(table.names, row, strict=True)) for row in table.points]
    start = fit_to_points(model, {name: joints[0][name] for name in LIMB_JOINTS}, centers=True).pose
    kept, assess = [], run_estimate.assessed_path

    def assessed(search, solved, first, *others):
        kept.append((search, solved, first))
        return assess(search, solved, first, *others)

    run_estimate.assessed_path = assessed
    with open_observer(session.cameras) as observer:
        subjects = Subjects.of([model])
        leg = Leg(TrackingRun(observer, subjects, [[start]], range(session.n_frames), session.fps))
        run = TrackSession(make_tracker(TrackSettings()), [leg], [StoredPerson("person", 1)], Nowhere(), "picture")
        for step in run.steps():
            run.take(step)
    ((search, solved, first),) = kept
    return search, [_height(model, first), _height(model, solved.poses), [own[POINT][AXIS] for own in joints]]


def _height(model, poses):
    return [model.joint_centers_world(pose)[model.point_names.index(POINT)][AXIS] for pose in poses]


def drawing(search, curves):
    """The picture as SVG."""
    model, paths, sets = search.model, search.paths, search.sets
    nats = path_marginals([s.costs() for s in sets], paths.motion_nats(sets), reduce_log_sum)
    heights = [np.array(_height(model, s.poses)) for s in sets]
    low, high = min(h.min() for h in heights) - 0.05, max(h.max() for h in heights) + 0.05

    def x(t):
        return LEFT + (WIDTH - LEFT - 24) * (t + 0.5) / len(sets)

    def y(height):
        return TOP + (HEIGHT - TOP - BOTTOM) * (high - height) / (high - low)

    out = [
        f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {WIDTH} {HEIGHT}' "
        "font-family='system-ui, sans-serif' font-size='13'>",
        f"<rect width='{WIDTH}' height='{HEIGHT}' rx='10' fill='#f7f8fa'/>",
    ]
    for height in np.arange(np.ceil(5 * low) / 5, high, 0.2):
        out.append(f"<path d='M{LEFT} {y(height):.1f}H{WIDTH - 24}' stroke='#dfe4ea'/>")
        out.append(text(LEFT - 8, y(height) + 4, f"{height:.1f}", "end"))
    out += [text(x(t), HEIGHT - BOTTOM + 18, str(t)) for t in range(0, len(sets), 5)]
    out.append(text((LEFT + WIDTH) / 2, HEIGHT - BOTTOM + 38, "frame"))
    out.append(text(10, 28, "height, m", "start"))
    for t, (of_frame, own) in enumerate(zip(nats, heights, strict=True)):
        masses = np.exp(of_frame.min() - of_frame)
        for mass, height in zip(masses / masses.sum(), own, strict=True):
            out.append(
                f"<circle cx='{x(t):.1f}' cy='{y(height):.1f}' r='{2.5 + 4 * np.sqrt(mass):.1f}' "
                f"fill='{GREY}' fill-opacity='{0.35 + 0.4 * mass:.2f}'/>"
            )
    names = "first pass", "path of the estimate", "truth"
    for i, (name, color, dash, curve) in enumerate(
        zip(names, (FIRST, PATH, TRUTH), ("5 4", "none", "2 3"), curves, strict=True)
    ):
        points = " ".join(f"{x(t):.1f},{y(height):.1f}" for t, height in enumerate(curve))
        out.append(
            f"<polyline points='{points}' fill='none' stroke='{color}' stroke-width='2.2' stroke-dasharray='{dash}'/>"
        )
        at = (310, 450, 640)[i]
        out.append(f"<path d='M{at} 24h34' stroke='{color}' stroke-width='2.2' stroke-dasharray='{dash}'/>")
        out.append(text(at + 42, 28, name, "start"))
    out += [
        f"<circle cx='{LEFT + 70}' cy='24' r='4' fill='{GREY}'/>",
        text(LEFT + 82, 28, "hypotheses, by mass", "start"),
    ]
    return "\n".join([*out, "</svg>\n"])


def text(x, y, words, anchor="middle"):
    """A label."""
    return f"<text x='{x:.1f}' y='{y:.1f}' text-anchor='{anchor}' fill='{INK}'>{escape(words)}</text>"


def main():
    """Film, track and draw."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "session"
        simulate(folder, SIMULATION)
        picture = drawing(*estimated(folder))
    Path(sys.argv[1]).write_text(picture, "utf-8")


if __name__ == "__main__":
    main()
