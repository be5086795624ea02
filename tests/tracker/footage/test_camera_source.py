"""The clock of a camera: when its pictures were taken, with frames that it lost."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from staging import cameras_around

from tracker.footage.camera_source import CameraSource, Clock, LostFrames

N = 40
LOSSES = [(), (LostFrames(10, 1),), (LostFrames(10, 2), LostFrames(20, 3)), (LostFrames(10, -2),), (LostFrames(90, 1),)]
"""In frames; the last one is after the end."""


def test_pictures_after_a_lost_frame_are_later():
    clock = Clock(0.25, 0.01, (LostFrames(10, 1), LostFrames(20, -2)))
    assert [clock.offset_frames(k) for k in (0, 9, 10, 19, 20)] == pytest.approx([0.25, 0.34, 1.35, 1.44, -0.55])


@pytest.mark.parametrize("lost", LOSSES)
@pytest.mark.parametrize(("ahead", "rate"), [(0.0, 0.0), (0.4, 0.03), (-1.3, -0.02)])
def test_the_nearest_picture_is_found_as_by_trying_all(lost, ahead, rate):
    clock = Clock(ahead, rate, lost)
    taken = np.array([k + clock.offset_frames(k) for k in range(N)])
    for frame in range(N):
        nearest = clock.nearest(frame, N)
        assert abs(taken[nearest] - frame) == pytest.approx(np.abs(taken - frame).min(), abs=1e-12)


@pytest.mark.parametrize("lost", LOSSES)
def test_a_clock_is_in_step_if_all_pictures_are_the_nearest_ones(lost):
    clock = Clock(0.3, 0.0, lost)
    assert clock.is_in_step(N) == all(clock.nearest(k, N) == k for k in range(N))


def test_losses_of_one_frame_are_added_and_those_that_cancel_are_dropped():
    clock = Clock(0.1).with_lost(LostFrames(20, 2)).with_lost(LostFrames(5, 1)).with_lost(LostFrames(20, 1))
    assert clock == Clock(0.1, 0.0, (LostFrames(5, 1), LostFrames(20, 3)))
    assert clock.with_lost(LostFrames(20, -3)).lost == (LostFrames(5, 1),)


def test_another_start_keeps_the_lost_frames():
    source = CameraSource(cameras_around(1)[0], Path("a.mp4"), clock=Clock(0.0, 0.0, LOSSES[1]))
    assert source.starting_at(2.4).clock == replace(source.clock, ahead_frames=-0.4)
