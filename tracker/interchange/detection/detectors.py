"""The detectors, the program's own and those of other packages (`quadrille.detectors`), and files of networks."""

from pathlib import Path
from typing import NamedTuple

from platformdirs import user_data_path

from tracker.compute.extensions import Extended
from tracker.errors import Remedy, TrackerError
from tracker.formats.write_only.optional_packages import require
from tracker.interchange.detection.detector import Detector, DetectorKind
from tracker.interchange.observations.observed import checksum

LICENSE = "The networks are those of MediaPipe (Apache License 2.0), Copyright The MediaPipe Authors."
WHEEL, TARBALL = "mediapipe==0.10.21", "@mediapipe/pose@0.5.1675469404"
"""The packages that hold the files: of pip, and of npm."""


class ModelFile(NamedTuple):
    """A file of a network."""

    package: str
    """The package that holds it."""
    member: str
    """Its path there."""
    sha256: str
    """Checksum of its bytes."""


MODEL_FILES = {
    "pose_detection.tflite": ModelFile(
        WHEEL, "mediapipe/modules/pose_detection/pose_detection.tflite",
        "9ba9dd3d42efaaba86b4ff0122b06f29c4122e756b329d89dca1e297fd8f866c",
    ),
    "pose_landmark_full.tflite": ModelFile(
        WHEEL, "mediapipe/modules/pose_landmark/pose_landmark_full.tflite",
        "e9a5c5cb17f736fafd4c2ec1da3b3d331d6edbe8a0d32395855aeb2cdfd64b9f",
    ),
    "pose_landmark_lite.tflite": ModelFile(
        TARBALL, "package/pose_landmark_lite.tflite",
        "f17bfbecadb61c3be1baa8b8d851cc6619c870a87167b32848ad20db306b9d61",
    ),
    "pose_landmark_heavy.tflite": ModelFile(
        TARBALL, "package/pose_landmark_heavy.tflite",
        "59e42d71bcd44cbdbabc419f0ff76686595fd265419566bd4009ef703ea8e1fe",
    ),
}  # fmt: skip
"""By the name of the file."""


def default_folder() -> Path:
    """Return the folder of models of this user."""
    return user_data_path("quadrille", appauthor=False) / "models"


def model_file(folder: Path, name: str) -> Path:
    """Return the path of a file of a network.

    Raises:
        TrackerError: it is missing, or another one.
    """
    path = folder / name
    if not path.is_file():
        raise TrackerError(f"expected the network {name} in {folder}, found none", Remedy("get_models"))
    if checksum(path.read_bytes()) != MODEL_FILES[name].sha256:
        raise TrackerError(
            f"expected the network {name} as its makers published it, found another file at {path}",
            Remedy("get_models"),
        )
    return path


def _blazepose(model: str, folder: Path) -> Detector:
    from tracker.interchange.detection.blazepose import BlazePose

    require("ai_edge_litert", "BlazePose", "run", "detect")
    return BlazePose(model_file(folder, "pose_detection.tflite"), model_file(folder, f"pose_landmark_{model}.tflite"))


def _onnx(model: str, folder: Path) -> Detector:
    from tracker.interchange.detection.onnx_pose import OnnxPose

    require("onnxruntime", "ONNX files", "run", "detect-onnx")
    return OnnxPose([path if (path := Path(name)).is_file() else folder / name for name in model.split(",")])


_OWN = (
    DetectorKind(
        "blazepose", "BlazePose of MediaPipe (Apache License 2.0), 33 points", ("lite", "full", "heavy"), _blazepose
    ),
    DetectorKind("onnx", "files of your own: RTMO.onnx, or FINDER.onnx,RTMPOSE.onnx", (), _onnx),
)

DETECTORS = Extended({kind.name: kind for kind in _OWN}, "quadrille.detectors", DetectorKind)
"""By name."""


def load_detector(name: str, model: str | None, folder: Path) -> tuple[Detector, str]:
    """Load a detector.

    Args:
        name: of the detector.
        model: its model; None for the most accurate one.
        folder: of the models' files.

    Returns:
        The detector, and its name with that of its model, which is stored with what it finds.

    Raises:
        TrackerError: there is no such detector or model, or its files or packages are missing.
    """
    if name not in DETECTORS:
        raise TrackerError(f"expected a detector of {', '.join(DETECTORS)}, found '{name}'; choose one of these")
    kind = DETECTORS[name]
    chosen = kind.models[-1] if model is None and kind.models else model
    if chosen is None or (kind.models and chosen not in kind.models):
        expected = f"one of {', '.join(kind.models)}" if kind.models else "a file"
        raise TrackerError(f"expected as the model of {name} {expected}, found '{model}'; correct it")
    return kind.load(chosen, folder), f"{name} {chosen}"
