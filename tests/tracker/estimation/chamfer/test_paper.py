import numpy as np
import pytest

from tracker.errors import Remedy, TrackerError
from tracker.estimation.chamfer.paper import PAPER_BODY, paper_settings, require_paper_body
from tracker.estimation.search.best_first import stages
from tracker.formats.model_toml import load_model


def test_the_settings_are_those_of_the_paper():
    settings = paper_settings()
    search, predict, edges = settings.search, settings.predict, settings.edges
    assert (settings.estimate, settings.outliers, search.passes) == ("search", "paper", (1.0,))
    assert (search.bound_rad, search.step_rad) == pytest.approx((np.radians(15), np.radians(5)))
    assert (search.bound_m, search.step_m) == (0.10, 0.05)
    assert search.patience == search.max_expansions  # nothing else ends a stage
    assert (predict.order, predict.full_window) == (2, True)
    assert (settings.segments, edges.max_segment_px, edges.whole_images) == (True, None, True)
    assert (settings.recover, settings.whole_run) == (None, False)


def test_the_spaces_searched_have_5_9_and_8_dimensions():
    found = stages([load_model(PAPER_BODY)], paper_settings().search)
    assert [len(s.group.dofs) for s in found] == [5, 9, 8]


def test_the_papers_body_of_any_height_is_accepted():
    require_paper_body({"ann": load_model(PAPER_BODY, 1.5), "bob": load_model(PAPER_BODY, 1.9)})


@pytest.mark.parametrize("name", ["gavrila34", "gavrila22_cones"])
def test_another_body_is_refused(name):
    with pytest.raises(TrackerError, match=rf"gavrila22 of 'bob', found {name} ") as caught:
        require_paper_body({"ann": load_model(PAPER_BODY), "bob": load_model(name)})
    assert caught.value.remedy == Remedy("paper_body", body="gavrila22")
