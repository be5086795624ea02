"""`quadrille body`: a person gets another body; the page shows it, and one undo there brings the former one back."""

import json

import numpy as np
import pytest
from command_line import WITH_POSE, assert_refused, stored

from tracker.session.session import load_session


@pytest.mark.slow
def test_a_person_gets_feet_and_undo_takes_them_away(run, session, opened):
    assert run("init", session, *WITH_POSE, "--frame", "4", "--json")[0] == 0
    (before,) = stored(session).values()
    status, out, _ = run("body", session, "--to", "gavrila38", "--json")
    told = json.loads(out)
    assert (status, told["before"], told["after"]) == (0, "gavrila22", "gavrila38")
    assert (told["refitted"], told["kept"]) == (1, 0)
    assert told["off_mm"] < 30  # a trunk that bends for a rigid one
    model = load_session(session).people[0].model
    assert model.name == "gavrila38"
    (after,) = stored(session).values()
    assert (len(after.values), after.keyframe) == (len(model.value_names), True)
    controller = opened()
    controller.navigation.seek(4)
    assert controller.models[0].name == "gavrila38"
    np.testing.assert_array_equal(controller.state.poses[0], after.values)
    for undo, name, pose in ((True, "gavrila22", before), (False, "gavrila38", after)):
        (controller.history.undo if undo else controller.history.redo)()
        assert load_session(session).people[0].model.name == name
        assert (controller.state.frame, controller.models[0].name) == (4, name)
        np.testing.assert_array_equal(controller.state.poses[0], pose.values)
        controller.navigation.seek(7)
        assert len(controller.state.poses[0]) == len(controller.models[0].value_names)
        controller.navigation.seek(4)


@pytest.mark.parametrize(("words", "expected"), [
    (["--to", "gavrila22"], ["expected another body", "found gavrila22 again"]),
    (["--to", "gavrila99"], ["gavrila99", "expected one of"]),
    (["--to", "gavrila38", "--person", "bob"], ["expected --person to be one of person, found 'bob'"]),
])  # fmt: skip
def test_refused_requests(run, session, words, expected):
    assert_refused(run("body", session, *words), expected)
    assert load_session(session).people[0].model.name == "gavrila22"
