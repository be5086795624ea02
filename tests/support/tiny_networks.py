"""ONNX files of networks that do next to nothing, with the inputs and outputs of those that detect people."""

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper


def write_landmarks(path, n_points=17, size=(256, 192)):
    """All points lie on the brightest column and row of the input."""
    nodes = [
        helper.make_node("Gather", ["input", "red"], ["points"], axis=1),
        helper.make_node("ReduceMax", ["points"], ["simcc_x"], axes=[2], keepdims=0),
        helper.make_node("ReduceMax", ["points"], ["simcc_y"], axes=[3], keepdims=0),
    ]
    shapes = {"simcc_x": [1, n_points, size[1]], "simcc_y": [1, n_points, size[0]]}
    return _write(path, size, nodes, {"red": np.zeros(n_points, np.int64)}, shapes)


def write_finder(path, boxes, labels, size=(64, 64)):
    """The same boxes, x, y, x, y and score each, px of the input, in any picture."""
    return _constant(path, size, dets=np.array([boxes], np.float32), labels=np.array([labels], np.int64))


def write_people(path, boxes, points, size=(64, 64)):
    """The same boxes, and x, y, score of the points of each, in any picture."""
    return _constant(path, size, dets=np.array([boxes], np.float32), keypoints=np.array([points], np.float32))


def _constant(path, size, **outputs):
    nodes = [helper.make_node("Identity", [f"own {name}"], [name]) for name in outputs]
    shapes = {name: list(value.shape) for name, value in outputs.items()}
    return _write(path, size, nodes, {f"own {name}": value for name, value in outputs.items()}, shapes)


def _write(path, size, nodes, values, shapes):
    kinds = {"labels": TensorProto.INT64}
    graph = helper.make_graph(
        nodes, "tiny", [helper.make_tensor_value_info("input", TensorProto.FLOAT, [1, 3, *size])],
        [helper.make_tensor_value_info(name, kinds.get(name, TensorProto.FLOAT), s) for name, s in shapes.items()],
        [numpy_helper.from_array(value, name) for name, value in values.items()],
    )  # fmt: skip
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.save(model, path)
    return path
