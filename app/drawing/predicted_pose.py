"""Predict the pose of a frame as the tracker does, from the stored poses around it."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from tracker.body.model import BodyModel
from tracker.body.motion.pose_steps import PredictSettings, predict
from tracker.geometry.arrays import Array


class Prediction(NamedTuple):
    """The tracker's prediction for a frame."""

    values: Array | None
    """The pose, (n_values,); None if there is none."""
    why: str
    """The frames that it was predicted from, or why there is none; for people to read."""


def prediction(
    model: BodyModel,
    poses: Callable[[range], Mapping[int, Array]],
    frame: int,
    settings: PredictSettings,
    backward: bool,
) -> Prediction:
    """Predict the pose of a frame from the poses before it.

    Args:
        model: the body.
        poses: returns the stored poses in a range, by frame.
        frame: to predict.
        settings: of the motion model.
        backward: whether to predict from the poses after it, as a run backward does.
    """
    before = "after" if backward else "before"
    window = settings.window
    around = range(frame + 1, frame + 1 + window) if backward else range(max(0, frame - window), frame)
    known = poses(around)
    past: list[int] = []
    for k in around if backward else reversed(around):  # from the nearest frame to the first gap
        if k not in known:
            break
        past.append(k)
    if not past:
        return Prediction(None, f"no pose on the frame {before} this one")
    values = predict(model, [known[k] for k in reversed(past)], settings)
    first, last = min(past), max(past)
    return Prediction(values, f"from frame {first}" if first == last else f"from frames {first} to {last}")
