"""The detectors: the program's own, and those of other packages (`quadrille.detectors`)."""

from pathlib import Path

from tracker.compute.extensions import Extended
from tracker.errors import TrackerError
from tracker.formats.write_only.optional_packages import require
from tracker.interchange.detection.detector import Detector, DetectorKind
from tracker.interchange.detection.model_files import model_file


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
