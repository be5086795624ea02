"""What is kept of the 3-D view, and what is made of a file that holds something else."""

import json
from dataclasses import fields, replace

import pytest

from app.state.view_3d import View3d, restored, stored

OTHER = View3d(
    bodies=False, colors="parts", opacity=0.35, cameras=False, images=False, floor=False, gizmos=False, ghost=True,
    voxels=True, character="knossow54", trail_points=frozenset(("left_wrist", "head")), trail_frames=80,
)  # fmt: skip


def test_every_field_comes_back():
    assert all(getattr(OTHER, f.name) != getattr(View3d(), f.name) for f in fields(View3d))
    assert restored(json.loads(json.dumps(stored(OTHER)))) == OTHER


@pytest.mark.parametrize(
    "data",
    [
        None, 3, [], {}, {"colors": "rainbow"}, {"opacity": 0}, {"opacity": "much"}, {"trail_frames": 100_000},
        {"trail_frames": True}, {"trail_points": "head"}, {"trail_points": [3]}, {"bodies": "yes"}, {"no_such": 1},
        {"character": "nobody"}, {"character": ["knossow54"]},
    ],
)  # fmt: skip
def test_senseless_values_fall_back_to_the_default(data):
    assert restored(data) == View3d()


def test_one_bad_field_does_not_spoil_the_others():
    assert restored(stored(OTHER) | {"opacity": -1}) == replace(OTHER, opacity=1.0)
