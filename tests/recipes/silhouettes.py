"""Print precision and recall of silhouettes against masks: `python tests/recipes/silhouettes.py SESSION MASKS`.

The session has backgrounds and no masks; MASKS is a folder with CAMERA/%06d.png. Rows: background subtraction with
shadow and highlight removal, without, with the background learnt from the recording, with the shadows that other views
contradict, and OpenCV's MOG2 after one pass over the recording.
"""

import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from tracker.evidence.images.background_subtraction import SHADOWS, SHADOWS_AND_HIGHLIGHTS, Shading
from tracker.evidence.silhouettes import SilhouetteFinder
from tracker.evidence.voxels.shadows import recover_from_shadows
from tracker.evidence.voxels.voxel_grid import VOXEL_M
from tracker.footage.recording import Recording, background_frames
from tracker.geometry.ground_plane import floor_plane
from tracker.session.session import load_session

EVERY = 5
"""Every which frame is scored."""
_NO_SHADING = Shading(1.0, 1.0, 0.0)
_MOG2_SHADOW, _MOG2_FOREGROUND = 127, 255


def main(folder, masks):
    session = load_session(folder)
    cameras = session.cameras
    frames = range(0, session.n_frames, EVERY)
    truth = {(k, c.camera.name): _mask(masks, c.camera.name, k) for k in frames for c in cameras}
    without = [replace(c, background=None) for c in cameras]
    with Recording(cameras) as recording:
        rows = {
            "no shadow removal": SilhouetteFinder(cameras, recording, _NO_SHADING),
            "shadows removed": SilhouetteFinder(cameras, recording, SHADOWS),
            "shadows and highlights removed": SilhouetteFinder(cameras, recording, SHADOWS_AND_HIGHLIGHTS),
            "the same, background from the recording": SilhouetteFinder(without, recording),
        }
        for name, finder in rows.items():
            _show(name, _scores(map(finder.silhouettes, frames), frames, truth))
        floor, finder = floor_plane(session.up, session.floor), rows["shadows and highlights removed"]
        recovered = (recover_from_shadows(finder.silhouettes(k), floor, VOXEL_M) for k in frames)
        _show("the same, with what others contradict", _scores(recovered, frames, truth))
        for name, value in (("MOG2, shadows removed", _MOG2_FOREGROUND), ("MOG2 with shadows", _MOG2_SHADOW)):
            _show(name, [s for c, _ in enumerate(cameras) for s in _mog2(recording, cameras[c], c, truth, value)])


def _scores(silhouettes, frames, truth):
    """Precision, recall and quality of each view of some frames."""
    return [
        (*_score(s.mask, truth[k, s.camera.name]), s.quality)
        for k, views in zip(frames, silhouettes, strict=True)
        for s in views
    ]


def _mask(folder, camera, k):
    return cv2.imread(str(folder / camera / f"{k:06d}.png"), cv2.IMREAD_GRAYSCALE) > 0


def _score(found, true):
    """Precision and recall of a mask."""
    both = np.count_nonzero(found & true)
    return both / max(1, np.count_nonzero(found)), both / max(1, np.count_nonzero(true))


def _mog2(recording, source, camera, truth, least):
    """Scores of MOG2 that begins with the empty scene and does not learn the person."""
    model = cv2.createBackgroundSubtractorMOG2(detectShadows=True)
    for empty in background_frames(source):
        model.apply(empty, learningRate=1.0)
    for (k, name), true in truth.items():
        if name == source.camera.name:
            yield *_score(model.apply(recording.read_view(camera, k), learningRate=0) >= least, true), np.nan


def _show(name, scores):
    precision, recall, quality = np.mean(scores, axis=0)
    f1 = [2 * p * r / max(1e-9, p + r) for p, r, _ in scores]
    print(f"{name:<42} precision {precision:.3f}  recall {recall:.3f}  worst F1 {min(f1):.3f}  quality {quality:.2f}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
