"""The errors that the library raises for unusable input of users and files.

Internal mistakes are asserted instead. Every message states what was expected, what was found, and what to do. The
command line prints the message and exits with status 1; the page shows it as a notice.
"""


class TrackerError(Exception):
    """Input of a user or a file cannot be used; the message states what to do."""


class CalibrationError(TrackerError):
    """A calibration file is unreadable or describes impossible cameras."""


class RecordingError(TrackerError):
    """A video or image folder is missing, unreadable, or does not fit the others."""


class ModelError(TrackerError):
    """A body model file is malformed."""


class SessionError(TrackerError):
    """A session folder is malformed, newer than this program, or in use."""


class DamagedStoreError(SessionError):
    """A store of annotations is not as it was written."""


class FormatError(TrackerError):
    """A foreign file (TRC, CSV, ...) is malformed."""
