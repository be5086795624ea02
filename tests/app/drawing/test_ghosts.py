"""Poses about as good as the shown one, as ghosts of the limbs that are elsewhere."""

from dataclasses import replace

import numpy as np

from app.drawing.ghosts import ghost_lines
from app.state.page_view import View
from app.state.reason import RankedPose, Reason, ReasonState
from tracker.body.limbs import limbs

VIEW = View(frozenset(("alternatives",)), (1, 0, 1, 1))


def test_each_alternative_has_a_path_in_each_view_in_its_order(controller):
    state, model = controller.state, controller.models[0]
    values = state.poses[0]
    arm = next(x for x in limbs(model) if x.name == "left_forearm")
    lifted = model.clip(model.retract(values, np.where(arm.dofs, 0.7, 0.0)))
    others = (RankedPose(lifted, -8.0, ("left arm",)), RankedPose(lifted, 2.0, ()))
    reason = Reason(state.frame, 0, values, None, None, alternatives=others)
    shown = replace(state, reasons=ReasonState(found=reason))
    paths = ghost_lines(controller.session, shown, VIEW)
    assert [(p.camera, p.kind) for p in paths] == [(c, "alternative") for _ in others for c in (0, 2, 3)]
    of_arm, of_body = paths[0], paths[3]
    assert 0 < len(of_arm.segments_px) < len(of_body.segments_px) / 2
    moved = replace(shown, people=(replace(shown.people[0], values=values.copy()),))
    assert ghost_lines(controller.session, moved, VIEW) == []  # of another pose
    assert ghost_lines(controller.session, shown, replace(VIEW, layers=frozenset(("contours",)))) == []
    hidden = replace(shown, visibility=replace(shown.visibility, hidden=frozenset((0,))))
    assert ghost_lines(controller.session, hidden, VIEW) == []
