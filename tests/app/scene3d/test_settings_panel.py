import numpy as np
import pytest
import viser

from app.scene3d.settings_panel import SettingsPanel, settings_of
from tracker.errors import TrackerError
from tracker.motion.prediction import PredictSettings
from tracker.tracking.chamfer.settings import TrackSettings

SHOWN = {
    "method": "search alone (paper)", "order": "constant acceleration", "window": 5, "recover": False,
    "bound_deg": 30.0, "bound_cm": 12.0, "step_deg": 4.0, "step_cm": 3.0, "passes": "1, 0.5", "patience": 7,
    "theta_px": 25.0, "outliers": "paper", "backward_pass": False,
}  # fmt: skip


def test_all_that_is_shown_is_taken_over():
    before = TrackSettings(trust_rad=0.3, predict=PredictSettings(bound_m=0.2))
    found = settings_of(SHOWN, before)
    assert (found.estimate, found.recover, found.theta_px, found.outliers) == ("search", None, 25.0, "paper")
    assert (found.predict.order, found.predict.window, found.predict.bound_m) == (2, 5, 0.2)
    assert found.search.bound_rad == pytest.approx(np.pi / 6)
    assert (found.search.bound_m, found.search.step_m) == (pytest.approx(0.12), pytest.approx(0.03))
    assert (found.search.passes, found.search.patience) == ((1.0, 0.5), 7)
    assert not found.backward_pass
    assert found.trust_rad == 0.3  # not shown, so it stays


def test_zero_theta_is_the_default_and_limbs_are_searched_again():
    found = settings_of(SHOWN | {"theta_px": 0.0, "recover": True}, settings_of(SHOWN, TrackSettings()))
    assert found.theta_px is None
    assert found.recover == TrackSettings().recover


@pytest.mark.parametrize("passes", ["", "often", "2, 1", "0"])
def test_passes_that_are_none_are_refused(passes):
    with pytest.raises(TrackerError, match="passes as factors"):
        settings_of(SHOWN | {"passes": passes}, TrackSettings())


def test_what_a_fresh_panel_shows_is_what_is_set(opened):
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        controller = opened()
        assert SettingsPanel(server, controller).read() == controller.state.settings
    finally:
        server.stop()


def test_what_is_changed_elsewhere_is_shown(opened):
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        panel = SettingsPanel(server, opened())
        changed = settings_of(SHOWN, TrackSettings())
        panel.show(changed)
        assert panel.read() == changed
    finally:
        server.stop()
