"""The cost of a pose is one number: each place that shows it or writes it has the same, to a hundredth of a pixel."""

import csv
import json

import numpy as np
import pytest
from command_line import SAMPLE, output_of, stored
from gestures import drag, wait_for

from app.drawing.curves import plots_of, samples
from app.messages import encoding
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.search.best_first import SearchSettings
from tracker.session.session import load_session

QUICK = TrackSettings(search=SearchSettings(passes=(1.0,), max_expansions=3))
FRAMES = range(5)


def within(costs, others):
    """Whether costs agree to a hundredth of a pixel, and whether the same ones are unknown."""
    known = np.array([[np.nan if c is None else c for c in own] for own in (costs, others)], float)
    return np.allclose(*known, rtol=0, atol=0.01, equal_nan=True)


def exported(run, session, folder):
    """Mean cost and that of each view by frame, as the table of an export has them."""
    assert run("export", session, "--out", folder / "poses.csv")[0] == 0
    with (folder / "poses.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    names = ["cost_px", *(f"cost_{c.camera.name}_px" for c in load_session(session).cameras)]
    return {int(row["frame"]): [float(row[name]) if row[name] else None for name in names] for row in rows}


def shown(controller, frame):
    """Mean cost in the top bar, and that in the corner of each view."""
    controller.navigation.seek(frame)
    wait_for(lambda: controller.state.cost_px is not None)
    message = encoding.state(controller.session, controller.state)
    return [message.cost_px, *message.view_costs_px]


@pytest.mark.parametrize(
    "words",
    [(), *(pytest.param(w, marks=pytest.mark.slow) for w in (("--paper",), ("--cameras", "RIGHT", "BACK", "LEFT")))],
)
def test_each_place_has_the_same_cost_of_a_tracked_pose(run, session, opened, tmp_path, words):
    run("init", session, "--joints", SAMPLE / "truth.trc", "--frame", "0")
    out = output_of(run("track", session, "--frames", f"0:{len(FRAMES)}", *words, "--json"))
    table, records, controller = exported(run, session, tmp_path), stored(session), opened()
    top = {k: shown(controller, k) for k in FRAMES}
    rows = {k: [r.cost_px, *r.view_costs_px] for k, r in records.items()}
    cells = {k: cell["cost_px"] for k, cell in controller.session_state.saver.index.timeline(0).items()}
    for k in FRAMES:
        if k == 0 and words == ("--paper",):  # nothing assesses a keyframe there
            continue
        assert within(table[k], top[k])
        assert within(rows[k], top[k])
        assert cells[k] == pytest.approx(top[k][0], abs=0.01)
    assert json.loads(out)["mean_cost_px"] == pytest.approx(np.mean([top[k][0] for k in FRAMES[1:]]), abs=0.01)


def test_edits_searches_and_replays_end_at_the_cost_of_the_pose(controller):
    drag(controller, "left_wrist", (9.0, 0.0))
    dragged = shown(controller, 0)
    controller.search.set_settings(QUICK)
    controller.search.run()
    wait_for(lambda: controller.state.search.message)
    with controller.lock:
        (ended,) = controller.replay.runs()
    state = controller.state
    assert ended.end_px == pytest.approx(state.cost_px, abs=0.01)
    compared = encoding.state(controller.session, state).compared
    assert within([compared.before_px, *compared.before_view_costs_px], dragged)
    assert within([compared.after_px, *compared.after_view_costs_px], [state.cost_px, *state.view_costs_px])
    controller.replay.show(ended.number, len(ended.steps) - 1)
    replayed = controller.state.drawn
    assert within([replayed.cost_px, *replayed.view_costs_px], [state.cost_px, *state.view_costs_px])
    controller.replay.show(ended.number, -1)
    assert within([controller.state.drawn.cost_px, *controller.state.drawn.view_costs_px], dragged)
    controller.replay.leave()
    assert within(shown(controller, 0), [state.cost_px, *state.view_costs_px])
    saver = controller.session_state.saver
    curves = plots_of(controller.models[0], controller.session.camera_names, "cost")
    curve = samples(controller.models[0], curves, [0], saver.pose_rows(0, [0]))[:, 0]
    assert within(curve, [state.cost_px, *state.view_costs_px])


def test_the_cell_of_a_frame_has_the_cost_of_all_people_as_they_are(couple):
    for person, by in ((0, 60.0), (1, 9.0), (0, -58.0)):  # the cost falls, while bob's row has that of before
        drag(couple, "torso", (by, 0.0), person=person)
    cell = couple.session_state.saver.index.timeline(0)[0]
    assert cell["cost_px"] == pytest.approx(shown(couple, 0)[0], abs=0.01)
