"""Pictures of the footage for the page."""

import cv2
import numpy as np


def test_a_picture_has_the_size_asked_for_and_is_made_once(opened, monkeypatch):
    frames = opened().frames
    read = []
    real = frames._read
    monkeypatch.setattr(frames, "_read", lambda frame, camera: read.append((frame, camera)) or real(frame, camera))
    pictures = [frames.image(9, 1, reduction) for reduction in (1.0, 1.6, 3.0, 1.6)]
    assert read == [(9, 1)] * 3
    assert pictures[1] is pictures[3]
    whole, smaller, small, _ = (cv2.imdecode(np.frombuffer(p, np.uint8), cv2.IMREAD_COLOR_RGB) for p in pictures)
    assert [p.shape[:2] for p in (whole, smaller, small)] == [(480, 640), (300, 400), (160, 213)]
    undistorted = frames.images(9)[1]
    assert np.abs(whole.astype(int) - undistorted).mean() < 4
    for picture in (smaller, small):
        simple = cv2.resize(undistorted, picture.shape[1::-1], interpolation=cv2.INTER_AREA)
        assert np.abs(picture.astype(int) - simple).mean() < 5
