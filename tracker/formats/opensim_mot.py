"""OpenSim motions (.mot): the coordinates of a model (`opensim_model`) over time, degrees and metres.

A header with the name, the numbers of rows and columns and inDegrees, then tab-separated columns: time in seconds, then
one for each coordinate. Rows of frames without a pose are left out; OpenSim interpolates by time.
"""

from pathlib import Path

import numpy as np

from tracker.body.model import BodyModel
from tracker.files import write_text_atomic
from tracker.formats.opensim_model import coordinate_joints, coordinate_values
from tracker.geometry.arrays import Array


def write_mot(path: str | Path, model: BodyModel, poses: Array, times: Array, title: str, note: str) -> None:
    """Write poses of one body.

    Args:
        path: the file.
        model: the body of all poses.
        poses: (n, n_values).
        times: time of each, ascending, (n,), s.
        title: name of the motion in OpenSim.
        note: a line of the header for people.
    """
    joints = coordinate_joints(model)
    names = [name for joint in joints for name in joint.names]
    is_length = np.array([i < 3 and joint.is_free for joint in joints for i in range(len(joint.names))])
    values = coordinate_values(model, poses)
    values[:, ~is_length] = np.degrees(values[:, ~is_length])
    lines = [title, "version=1", f"nRows={len(poses)}", f"nColumns={len(names) + 1}", "inDegrees=yes", note]
    lines.append("endheader")
    lines.append("\t".join(["time", *names]))
    for time, row in zip(times.tolist(), values.tolist(), strict=True):
        lines.append("\t".join([f"{time:.9f}", *(f"{x:.9f}" for x in row)]))
    write_text_atomic(Path(path), "\n".join(lines) + "\n")
