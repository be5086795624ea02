"""Normal equations of residual blocks, and derivatives by differences that they are compared with."""

import numpy as np

from tracker.body.model import PosedBody


def normal(block, body):
    """The normal equations of a residual block at the pose of a body."""
    return block.linearize(body.model, body.values, body.model.kinematics(body.values))


def slopes(function, body, step=1e-6):
    """Derivatives of a function of a body by its degrees of freedom, the first axis: central differences."""
    moved = [[body.model.retract(body.values, s * e) for s in (step, -step)] for e in np.eye(body.model.n_dofs)]
    sides = [[function(PosedBody(body.model, values)) for values in both] for both in moved]
    return np.array([ahead - behind for ahead, behind in sides]) / (2 * step)
