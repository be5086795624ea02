"""The errors that the library raises for unusable input of users and files.

Internal mistakes are asserted instead. Every message states what was expected, what was found, and what to do. A remedy
that differs between programs is a `Remedy`, a code with fields; the message then ends before it. The command line and
the page phrase it each in their own words (`app.remedies`), so that no message here names an option or a button. The
command line prints message and remedy and exits with status 1; the page shows them as a notice.
"""

from typing import Self


class Remedy:
    """A way out of an error or a warning, for a program to phrase."""

    def __init__(self, code: str, /, **fields: object) -> None:
        """Name a remedy.

        Args:
            code: one of `app.remedies`, such as `another_frame`.
            fields: what its phrases mention, such as `condition="all stand apart"`.
        """
        self.code = code
        self.fields = fields

    def __eq__(self, other: object) -> bool:
        """Return whether code and fields are equal."""
        return isinstance(other, Remedy) and (self.code, self.fields) == (other.code, other.fields)

    def __hash__(self) -> int:
        """Return a hash of the code; fields may be of any kind."""
        return hash(self.code)

    def __repr__(self) -> str:
        """Return the call that makes it."""
        return f"Remedy({', '.join([repr(self.code), *(f'{k}={v!r}' for k, v in self.fields.items())])})"


class TrackerError(Exception):
    """Input of a user or a file cannot be used; the message, with the remedy if there is one, states what to do."""

    def __init__(self, message: str, remedy: Remedy | None = None, camera: str | None = None) -> None:
        """State what was expected and found.

        Args:
            message: one sentence. It ends with what to do, unless `remedy` is given.
            remedy: what to do, where the command line and the page offer different ways.
            camera: name of the camera whose picture shows the fault best; None without one.
        """
        super().__init__(message)
        self.remedy = remedy
        self.camera = camera

    @classmethod
    def mismatch(cls, where: object, expected: object, found: object, advice: str | Remedy = "export it again") -> Self:
        """Return the error of input that is another than expected.

        Args:
            where: names the input; empty if `expected` does.
            expected: what was expected.
            found: what is there instead.
            advice: what to do, or its remedy.
        """
        place = f"{where}: " if where else ""
        message = f"{place}expected {expected}, found {found}"
        return cls(message, advice) if isinstance(advice, Remedy) else cls(f"{message}; {advice}")


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


class OvertakenEditError(SessionError):
    """An entry of the history cannot be added to any more: others have changed its poses since, or it is undone."""


class FormatError(TrackerError):
    """A foreign file (TRC, CSV, ...) is malformed."""
