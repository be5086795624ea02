import os
from pathlib import Path

import pytest

from tracker.footage.recording import Recording
from tracker.interchange.detection.detect import DetectionPlan, detect_people
from tracker.interchange.detection.detectors import MODEL_FILES, default_folder, load_detector
from tracker.interchange.observations.observed import triangulate_observations
from tracker.interchange.observations.stored import load_observations


@pytest.fixture
def detected():
    """Detects people on frames of a session by the heavy network: the observations, and their joints in space."""
    pytest.importorskip("ai_edge_litert")
    folder = Path(os.environ.get("QUADRILLE_MODELS") or default_folder())
    if not all((folder / name).is_file() for name in MODEL_FILES):
        pytest.skip(f"expected the networks in {folder}: quadrille detect --get-models fetches them")
    detector, name = load_detector("blazepose", "heavy", folder)

    def detect(session, frames):
        with Recording(session.cameras) as recording:
            detect_people(session, recording, detector, DetectionPlan("net", name, frames))
        observations = load_observations(session, "net")
        return observations, triangulate_observations(observations, [c.camera for c in session.cameras]).joints

    return detect
