"""Kernels run as plain Python where that is chosen, with the results of the compiled ones."""

import subprocess
import sys
import threading

import numpy as np
import pytest

from tracker.compute.jit import njit
from tracker.compute.uncompiled_kernels import interpret_modules, is_interpreted, run_uncompiled

_SCORE = """
import numpy as np
from app.session.samples import bundled
from tracker.body.model import PosedBody
from tracker.compute.uncompiled_kernels import run_uncompiled
from tracker.evidence.contours import occluding_contours
from tracker.evidence.observer import open_observer
from tracker.estimation.posing.default_pose import default_pose
from tracker.estimation.posing.drag import drag
from tracker.estimation.posing.grab import grab
from tracker.estimation.search import chamfer_kernels
from tracker.estimation.search.chamfer_cost import ChamferCost
from tracker.session.session import load_session

session = load_session(bundled("elbow_rotation"))
cameras = [c.camera for c in session.cameras]

def figures():
    bodies = [PosedBody(p.model, default_pose(p.model, cameras, np.eye(3), 0.0)) for p in session.people]
    held = grab(bodies[0].model, bodies[0].values, cameras[0], "left_wrist", np.array([200.0, 200.0]))
    dragged = drag(held, np.array([230.0, 190.0]), bodies[0].values)
    cost = ChamferCost(views, bodies).at_prediction()
    return [*dragged, cost.total_px, *cost.view_costs_px]

with open_observer(session.cameras) as observer:
    views = observer.evidence(25)
with run_uncompiled():
    slow = figures()
assert not chamfer_kernels.score_traced.signatures
fast = figures()
assert chamfer_kernels.score_traced.signatures
np.testing.assert_allclose(slow, fast, rtol=1e-4, atol=1e-6)
"""


@pytest.fixture
def kernel():
    @njit(error_model="numpy")
    def double(values):
        for i in range(values.shape[0]):
            values[i] *= 2

    @njit
    def double_twice(values):
        double(values)
        double(values)
        return values.sum()

    double_twice.inner = double
    return double_twice


@pytest.mark.slow
def test_an_interpreted_kernel_compiles_nothing(kernel):
    with run_uncompiled():
        assert kernel(np.ones(3)) == 12
        assert not kernel.signatures
        assert not kernel.inner.signatures
    assert kernel(np.ones(3)) == 12
    assert len(kernel.signatures) == 1


@pytest.mark.slow
def test_other_threads_compile(kernel):
    with run_uncompiled():
        other = threading.Thread(target=kernel, args=(np.ones(3),))
        other.start()
        other.join()
        assert len(kernel.signatures) == 1


def test_a_context_in_another_ends_alone():
    with run_uncompiled():
        with run_uncompiled():
            pass
        assert is_interpreted("any")
    assert not is_interpreted("any")


@pytest.mark.slow
def test_chosen_modules_are_interpreted_in_all_threads(kernel):
    interpret_modules(__name__)
    try:
        other = threading.Thread(target=kernel, args=(np.ones(3),))
        other.start()
        other.join()
        assert not kernel.signatures
        assert not is_interpreted("tracker.evidence.images.edges")
    finally:
        interpret_modules()
    kernel(np.ones(3))
    assert kernel.signatures


@pytest.mark.slow
def test_a_body_is_dragged_and_scored_as_by_compiled_kernels():
    subprocess.run([sys.executable, "-c", _SCORE], check=True, timeout=240)
