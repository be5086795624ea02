"""People by the two networks of BlazePose: a finder of people and the landmarks of one (Bazarevsky et al. 2020).

The networks are those of MediaPipe; their inputs and outputs are described in its model card. Each runs on one thread.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from tracker.geometry.arrays import Array, Image, IntArray
from tracker.interchange.detection.detector import DetectedPerson, PictureSquare

_BEYOND = ("hips", "rim", "shoulders", "rim of shoulders", "left palm", "right palm")
"""Landmarks behind those of the skeleton, from which MediaPipe makes the next square."""


class _Card(NamedTuple):
    """Facts of the networks, as their model card states them."""

    strides: tuple[tuple[int, int], ...]
    """Cells of the finder's grids, px of its input, and anchors in each."""
    around: float
    """Side of the square of the landmarks over the diameter of the circle around a person."""
    kernel: int
    """Cells of a heat map on each side of a landmark whose center of mass refines it."""


_CARD = _Card(((8, 2), (16, 2), (32, 6)), 1.25, 3)
"""The facts of these versions."""


class BlazePose:
    """The finder of people and the network of landmarks."""

    skeleton = "BlazePose_33"

    def __init__(self, finder: Path, landmarks: Path) -> None:
        """Load both networks.

        Raises:
            TrackerError: a file is missing or no such network, or the package that runs it is not installed.
        """
        self._finder, self._landmarks = _Network(finder), _Network(landmarks)
        self._anchors = _anchors(self._finder.size)

    def find(self, picture: Image, square: PictureSquare) -> Sequence[PictureSquare]:
        """See `Detector.find`."""
        n = self._finder.size
        crop = square.crop(picture, n, n)
        raw, logits = self._finder(crop.image / np.float32(127.5) - 1)
        keep = logits[:, 0] > 0
        raw, anchors, probability = raw[keep] / n, self._anchors[keep], expit(logits[keep, 0])
        corners = raw[:, :2] + anchors - raw[:, 2:4] / 2
        out = []
        for group in _groups(np.column_stack([corners, raw[:, 2:4]]), probability):
            weights = probability[group] / probability[group].sum()
            hips, rim = (weights @ (raw[group, at : at + 2] + anchors[group]) * n - 0.5 for at in (4, 6))
            out.append(_square_around(crop.in_picture(hips), crop.in_picture(rim)))
        return out

    def look(self, picture: Image, square: PictureSquare) -> DetectedPerson | None:
        """See `Detector.look`."""
        n = self._landmarks.size
        crop = square.crop(picture, n, n, borderMode=cv2.BORDER_REPLICATE)
        marks, presence, logits, heat, _ = self._landmarks(crop.image / np.float32(255))
        if (present := float(presence.item())) < 1 - present:
            return None
        marks = marks.reshape(-1, 5)[: -len(_BEYOND)]
        points = crop.in_picture(_refined(marks[:, :2] / n, heat) * n - 0.5)
        seen = expit(marks[:, 3]) * expit(marks[:, 4])
        return DetectedPerson(points, seen.astype(np.float64), present, _mask(logits[..., 0], crop.to_picture))


class _Network:
    """A network of TensorFlow Lite."""

    def __init__(self, path: Path) -> None:
        from ai_edge_litert.interpreter import Interpreter  # imported lazily: an optional package

        self._net = Interpreter(str(path), num_threads=1)
        self._net.allocate_tensors()
        self._input, self._outputs = self._net.get_input_details()[0], self._net.get_output_details()
        self.size = int(self._input["shape"][1])

    def __call__(self, image: NDArray[np.floating]) -> list[Any]:
        self._net.set_tensor(self._input["index"], np.ascontiguousarray(image[None], np.float32))
        self._net.invoke()
        return [self._net.get_tensor(o["index"])[0] for o in self._outputs]


def _anchors(size: int) -> Array:
    """Return the centers of the finder's cells, one for each anchor, (n, 2), as shares of its input."""
    out = []
    for stride, count in _CARD.strides:
        centers = (np.arange(size // stride) + 0.5) * stride / size
        out.append(np.repeat(np.stack(np.meshgrid(centers, centers), axis=-1).reshape(-1, 2), count, axis=0))
    return np.concatenate(out)


def _groups(boxes: Array, probability: Array) -> list[IntArray]:
    """Join the boxes, (n, 4) as corner and size, that overlap the most probable one by half, and so on."""
    left, out = np.argsort(-probability), []
    while len(left):
        corner = np.maximum(boxes[left, :2], boxes[left[0], :2])
        end = np.minimum(boxes[left, :2] + boxes[left, 2:], boxes[left[0], :2] + boxes[left[0], 2:])
        common = np.maximum(end - corner, 0).prod(axis=1)
        areas = boxes[left, 2:].prod(axis=1)
        near = 2 * common > areas + areas[0] - common
        near[0] = True
        out.append(left[near])
        left = left[~near]
    return out


def _square_around(hips_px: Array, rim_px: Array) -> PictureSquare:
    """Return the square of a person whose circle, around the hips, passes the rim above the head."""
    up = rim_px - hips_px
    return PictureSquare(hips_px, 2 * _CARD.around * float(np.hypot(*up)), float(np.arctan2(up[0], -up[1])))


def _refined(places: Array, heat: Array) -> Array:
    """Move landmarks, (N, 2) as shares of the square, to the centers of mass of their heat maps around them."""
    n, out = heat.shape[0], places.astype(np.float64)
    for i, (column, row) in enumerate((places * n).astype(int)):
        if not (0 <= column < n and 0 <= row < n):
            continue
        top, left = max(0, row - _CARD.kernel), max(0, column - _CARD.kernel)
        logits = heat[top : row + _CARD.kernel + 1, left : column + _CARD.kernel + 1, i]
        if logits.max() >= 0:
            weights = expit(logits)
            rows, columns = np.mgrid[top : top + weights.shape[0], left : left + weights.shape[1]]
            out[i] = np.array([(weights * columns).sum(), (weights * rows).sum()]) / weights.sum() / n
    return out


def _mask(logits: Array, back: Array) -> Callable[[tuple[int, int]], NDArray[np.float32]]:
    def probability(shape: tuple[int, int]) -> NDArray[np.float32]:
        found = cv2.warpAffine(expit(logits).astype(np.float32), back, shape[::-1])
        return np.asarray(found, dtype=np.float32)

    return probability
