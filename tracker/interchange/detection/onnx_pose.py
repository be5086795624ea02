"""People by networks that a user has as ONNX files: RTMPose with a finder of people, or RTMO, which does both.

The role of a file follows from its outputs, as MMDeploy names them: `simcc_x` and `simcc_y` for RTMPose (Jiang et al.
2023), `dets` and `keypoints` for RTMO (Lu et al. 2024), `dets` and `labels` for a finder such as RTMDet or YOLOX.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tracker.errors import TrackerError
from tracker.formats.joint_maps import joint_map_of_size
from tracker.geometry.arrays import Array, Image
from tracker.interchange.detection.detector import DetectedPerson, PictureSquare, SquareImage

_COLORS = np.array([[123.675, 116.28, 103.53], [58.395, 57.12, 57.375]])
"""Mean and standard deviation of red, green and blue in ImageNet, by which RTMPose's input is normalized; beside a
picture, inputs have the mean."""
_OUTPUTS = {"landmarks": {"simcc_x", "simcc_y"}, "people": {"dets", "keypoints"}, "finder": {"dets", "labels"}}


class OnnxPose:
    """A network of people, or one of landmarks with a finder."""

    def __init__(self, files: Sequence[Path]) -> None:
        """Load one file or two.

        Raises:
            TrackerError: a file is no such network, or the files do not make a detector together.
        """
        networks = [_Network(path) for path in files]
        self._by_role = {network.role: network for network in networks}
        if not ({"people"} == self._by_role.keys() or {"landmarks", "finder"} == self._by_role.keys()):
            found = ", ".join(f"{n.path.name} ({n.role})" for n in networks)
            raise TrackerError(
                f"expected RTMO, or RTMPose with a finder of people such as YOLOX, found {found}; give both files"
            )
        pose = self._by_role.get("people") or self._by_role["landmarks"]
        self.skeleton = joint_map_of_size(pose.n_points, str(pose.path)).name

    def find(self, picture: Image, square: PictureSquare) -> Sequence[PictureSquare]:
        """See `Detector.find`."""
        if "people" in self._by_role:
            people = self._people(picture, square)
            return [_square_around(p.points_px.min(axis=0), p.points_px.max(axis=0), square.turn_rad) for p in people]
        network = self._by_role["finder"]
        crop = network.crop(picture, square)
        boxes, labels = network({"dets", "labels"}, crop.image[..., ::-1])
        found = boxes[(labels == 0) & (boxes[:, 4] > 1 - boxes[:, 4])]
        corners = found[np.argsort(-found[:, 4]), :4].reshape(-1, 2, 2)
        return [_square_around(c.min(axis=0), c.max(axis=0), square.turn_rad) for c in crop.in_picture(corners)]

    def look(self, picture: Image, square: PictureSquare) -> DetectedPerson | None:
        """See `Detector.look`."""
        if "people" in self._by_role:
            people = self._people(picture, square)
            apart = [float(np.linalg.norm(np.median(p.points_px, axis=0) - square.center_px)) for p in people]
            nearest = int(np.argmin(apart)) if apart else -1
            return people[nearest] if apart and apart[nearest] < square.side_px / 4 else None
        network = self._by_role["landmarks"]
        crop = network.crop(picture, square)
        x, y = network({"simcc_x", "simcc_y"}, (crop.image - _COLORS[0]) / _COLORS[1])
        height, width = network.size
        columns, rows = x.argmax(axis=1) * width / x.shape[1], y.argmax(axis=1) * height / y.shape[1]
        confidence = np.clip(np.minimum(x.max(axis=1), y.max(axis=1)), 0, 1).astype(np.float64)
        points = crop.in_picture(np.column_stack([columns, rows]))
        presence = float(np.median(confidence))
        return DetectedPerson(points, confidence, presence) if presence > 1 - presence else None

    def _people(self, picture: Image, square: PictureSquare) -> list[DetectedPerson]:
        network = self._by_role["people"]
        crop = network.crop(picture, square)
        boxes, points = network({"dets", "keypoints"}, crop.image[..., ::-1])
        order = [i for i in np.argsort(-boxes[:, 4]) if boxes[i, 4] > 1 - boxes[i, 4]]
        return [
            DetectedPerson(
                crop.in_picture(points[i, :, :2]),
                np.clip(points[i, :, 2], 0, 1).astype(np.float64), float(boxes[i, 4]),
            )
            for i in order
        ]  # fmt: skip


class _Network:
    """A network of ONNX Runtime, on one thread."""

    def __init__(self, path: Path) -> None:
        import onnxruntime  # imported lazily: an optional package

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        try:
            self._session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
        except Exception as error:  # its kinds of errors are private
            raise TrackerError(f"expected a network at {path}, found none that can be read: {error}") from error
        self.path, self._input = path, self._session.get_inputs()[0]
        outputs = {o.name: o.shape for o in self._session.get_outputs()}
        self.role = next((role for role, names in _OUTPUTS.items() if names <= outputs.keys()), "unknown")
        if self.role == "unknown":
            expected = " or ".join(" and ".join(sorted(names)) for names in _OUTPUTS.values())
            raise TrackerError(
                f"expected a network with the outputs {expected}, found {', '.join(outputs)} in {path}; export it with "
                "MMDeploy"
            )
        sizes = [n for n in self._input.shape[2:] if isinstance(n, int)]
        if len(sizes) < 2:
            raise TrackerError(f"expected a network of a fixed input size, found {self._input.shape} in {path}")
        self.size = int(sizes[0]), int(sizes[1])
        """Height and width of the input, px."""
        points = {"landmarks": ("simcc_x", 1), "people": ("keypoints", 2)}.get(self.role)
        self.n_points = int(outputs[points[0]][points[1]]) if points else 0

    def crop(self, picture: Image, square: PictureSquare) -> SquareImage:
        """Return an image of the input's size that shows a square."""
        height, width = self.size
        return square.crop(picture, width, height, borderValue=_COLORS[0].tolist())

    def __call__(self, names: set[str], image: NDArray[Any]) -> list[NDArray[Any]]:
        """Return outputs in the order of their names, without the axis of the batch."""
        batch = np.ascontiguousarray(image.transpose(2, 0, 1)[None], np.float32)
        return [np.asarray(found)[0] for found in self._session.run(sorted(names), {self._input.name: batch})]


def _square_around(low_px: Array, high_px: Array, turn_rad: float) -> PictureSquare:
    """Return the square around a box, which is larger by a quarter, as RTMPose is trained."""
    return PictureSquare((low_px + high_px) / 2, 1.25 * float((high_px - low_px).max()), turn_rad)
