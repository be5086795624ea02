"""Names of the conventions of poses, without what tests them: the command line lists them before numpy is loaded."""

from typing import Literal, get_args

PoseConvention = Literal[
    "world-to-camera",
    "camera-to-world",
    "row-vectors",
    "camera-position",
    "world-to-camera-opengl",
    "camera-to-world-opengl",
    "row-vectors-opengl",
    "camera-position-opengl",
]
CONVENTIONS: tuple[PoseConvention, ...] = get_args(PoseConvention)
