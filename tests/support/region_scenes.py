"""A figure in its clothes that walks past two cameras, tracked with a leg that is wrong on some frames."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from staging import cameras_around, own_evidence, painted, posed

from tracker.body.limbs import limbs
from tracker.body.model import PosedBody
from tracker.estimation.appearance.region_model import LearningFrame, learn_regions

CAMERAS = [c.cropped((0, 0, 319, 239)) for c in cameras_around(2, size=(320, 240))]
"""Whole views, of odd width and height."""
REGIONS = (0, 0, 319, 239), (33, 5, 290, 236)
"""Region of each view, of which the second has odd borders."""
N_FRAMES = 12
WALL = (40, 90, 60)


def limb_of(model, name):
    return next(x for x in limbs(model) if x.name == name)


class Walk:
    """The recording, and what is learnt from it. The right leg is wrong on every fourth frame."""

    def __init__(self, model, suit):
        rng, leg = np.random.default_rng(0), limb_of(model, "right_calf")
        self.model = model
        self.true = [[PosedBody(model, self._pose(k))] for k in range(N_FRAMES)]
        self.wrong = np.arange(N_FRAMES) % 4 == 1
        self.tracked = [
            [PosedBody(model, model.clip(model.retract(body.values, -0.6 * wrong * leg.dofs)))]
            for (body,), wrong in zip(self.true, self.wrong, strict=True)
        ]
        self.views = [_filmed(bodies, suit, rng) for bodies in self.true]
        frames = [LearningFrame(v, b) for v, b in zip(self.views, self.tracked, strict=True)]
        self.known = learn_regions(frames, CAMERAS)

    def _pose(self, k):
        values = posed(self.model, k)
        values[:2] += np.array([0.9, 1.2]) * (k / (N_FRAMES - 1) - 0.5)
        return values

    def score(self, k, bodies):
        return self.known.score(self.known.frame(self.views[k], bodies), bodies)


class Filmed:
    """Gives the evidence of a walk, as an observer does."""

    working_cameras = CAMERAS

    def __init__(self, walk):
        self.walk, self.cameras = walk, [SimpleNamespace(camera=SimpleNamespace(name=n)) for n in ("LEFT", "RIGHT")]

    def ahead_frames(self, frame):
        return (0.0,) * len(CAMERAS)

    def empty_scenes(self):
        return (None,) * len(CAMERAS)

    def evidence(self, frame, regions, *args, **kwargs):
        return self.walk.views[frame]


def _filmed(bodies, suit, rng):
    """Evidence of the regions: contours, and colours with noise."""
    views = []
    for camera, (u0, v0, u1, v1) in zip(CAMERAS, REGIONS, strict=True):
        image = painted(bodies, camera, suit, WALL)[v0:v1, u0:u1].astype(int)
        colors = np.clip(image + rng.normal(0, 2, image.shape), 0, 255).astype(np.uint8)
        (view,) = own_evidence(bodies, [camera.cropped((u0, v0, u1, v1))])
        views.append(replace(view, colors=colors, corner_px=(u0, v0), image_size=camera.size))
    return tuple(views)
