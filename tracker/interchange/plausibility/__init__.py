"""Whether points are the joints of a person of the recording: bones, posture, and the people in its pictures.

One score in nats compares what a file says with other names, axes, units and frames. Imports
`interchange.observations` of its wing. Callers use `examine.plan_examined_import` and `examine.examine_joints`.
"""

__all__ = ["body_likelihood", "examine", "lags", "readings"]
