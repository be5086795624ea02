"""Gizmos without a browser: what they do to the controller, and where they stand."""

import contextlib
from types import SimpleNamespace

import numpy as np
import pytest
from gestures import drag, wait_for

from app.scene3d.gizmos import Gizmos
from tracker.geometry import rigid


class Handle:
    """Stands for a gizmo of viser."""

    def __init__(self, **_):
        self.visible, self.position, self.wxyz, self.told = False, None, None, None

    def on_update(self, callback):
        self.told = callback

    async def pull(self, phase, position=None, wxyz=None):
        target = SimpleNamespace(
            position=self.position if position is None else position, wxyz=self.wxyz if wxyz is None else wxyz
        )
        await self.told(SimpleNamespace(phase=phase, target=target))


class Server:
    def __init__(self):
        self.handles = {}
        self.scene = self

    def add_transform_controls(self, name, *_, **__):
        self.handles[name.rpartition("/")[2]] = Handle()
        return self.handles[name.rpartition("/")[2]]

    def atomic(self):
        return contextlib.nullcontext()


@pytest.fixture
def controller(opened):
    controller = opened()
    drag(controller, "left_wrist", (25.0, -25.0))
    return controller


@pytest.fixture
def handles(controller):
    server = Server()
    Gizmos(server, controller)
    wait_for(lambda: server.handles["root"].visible)
    return server.handles


def part_frame(controller, name):
    model = controller.models[0]
    return model.kinematics(controller.state.poses[0]).Ts_world_part[[j.name for j in model.joints].index(name)]


async def test_the_root_is_moved_and_turned_as_one_entry(controller, handles):
    root, T = handles["root"], part_frame(controller, "torso")
    await root.pull("start")
    R = rigid.so3_exp(np.array([0.1, -0.2, 0.4])) @ T[:3, :3]
    for t in (0.5, 1.0):
        await root.pull("update", T[:3, 3] + t * np.array([0.1, 0.2, -0.1]), rigid.quaternion_from_matrix(R))
    await root.pull("end", T[:3, 3] + np.array([0.1, 0.2, -0.1]), rigid.quaternion_from_matrix(R))
    wait_for(lambda: np.allclose(part_frame(controller, "torso")[:3, 3], T[:3, 3] + [0.1, 0.2, -0.1]))
    wait_for(lambda: np.allclose(part_frame(controller, "torso")[:3, :3], R, atol=1e-4))
    # When it is let go it stands where the state says.
    wait_for(lambda: np.allclose(root.position, T[:3, 3] + [0.1, 0.2, -0.1]))
    wait_for(lambda: controller.state.undo == "place torso, frame 0")
    controller.history.undo()
    assert controller.state.undo == "drag left wrist, frame 0"


async def test_a_joint_turns_within_its_limits_and_the_gizmo_comes_back(controller, handles):
    assert not handles["joint"].visible or controller.state.point is not None
    controller.navigation.select(0, "left_elbow")
    wait_for(lambda: handles["joint"].visible)
    T = part_frame(controller, "left_elbow")
    wait_for(lambda: np.allclose(handles["joint"].position, part_frame(controller, "left_elbow")[:3, 3]))
    joint = handles["joint"]
    await joint.pull("start")
    wanted = rigid.quaternion_from_matrix(T[:3, :3] @ rigid.so3_exp(np.array([0.0, -0.5, 1.0])))
    await joint.pull("end", None, wanted)
    wait_for(lambda: controller.state.undo == "place left elbow, frame 0")
    wait_for(
        lambda: np.allclose(rigid.matrix_from_quaternion(joint.wxyz), part_frame(controller, "left_elbow")[:3, :3])
    )
    model = controller.models[0]
    np.testing.assert_allclose(model.clip(controller.state.poses[0]), controller.state.poses[0])


def test_gizmos_hide_while_a_tracker_runs(placed, tracker):
    server = Server()
    Gizmos(server, placed)
    wait_for(lambda: server.handles["root"].visible)
    placed.tracking.start(False, None)
    wait_for(lambda: not server.handles["root"].visible)
