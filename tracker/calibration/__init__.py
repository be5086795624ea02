"""The cameras: whether they are calibrated well, and their calibration by a board or by people.

The wing may import those up to `interchange`. Files of calibrations are in `formats.calibrations`; a change of those of
a session is an entry of its history (`pipeline.calibration_revisions`).
"""
