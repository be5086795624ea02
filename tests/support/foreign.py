"""Programs of others that check exports: packages of the extras `export` and `slow`, and OpenCV's projection."""

import importlib
import os

import cv2
import pytest


def foreign(package):
    """Import a package of others: skip where it is missing, fail where CI promises it."""
    if os.environ.get("CI") == "true":
        return importlib.import_module(package)
    return pytest.importorskip(package, reason=f"needs {package}: pip install -e '.[export,slow]'")


def projected(camera, place):
    """Project a point in the world, (3,), to original pixels, (2,), by OpenCV."""
    pose = cv2.Rodrigues(camera.T_camera_world[:3, :3])[0], camera.T_camera_world[:3, 3], camera.K, camera.distortion
    project = cv2.fisheye.projectPoints if camera.fisheye else cv2.projectPoints
    return project(place.reshape(1, 1, 3), *pose)[0].ravel()
