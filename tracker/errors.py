"""What the library raises when a user or a file gave it something it cannot use.

Internal mistakes are asserted; these exceptions are for people. Every message says what was expected,
what was found, and what to do. The command line prints the message and exits with status 1; the page
shows it as a notice.
"""


class TrackerError(Exception):
    """Something that a user or a file gave cannot be used; the message says what to do."""


class CalibrationError(TrackerError):
    """A calibration file is unreadable or describes impossible cameras."""


class RecordingError(TrackerError):
    """A video or image folder is missing, unreadable, or does not fit the others."""


class ModelError(TrackerError):
    """A body model file is malformed."""


class SessionError(TrackerError):
    """A session folder is malformed, newer than this program, or in use."""


class FormatError(TrackerError):
    """A foreign file (TRC, CSV, ...) is malformed."""
