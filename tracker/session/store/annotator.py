"""Return the name of the person who annotates: the author of edits, tasks and comments.

One place says who it is, the environment variable `VARIABLE`: programs set it from their options for themselves and for
the programs that they start.
"""

import os

import msgspec

from tracker.errors import TrackerError
from tracker.validation import Name, nfc_name, quoted

VARIABLE = "QUADRILLE_ANNOTATOR"
"""Environment variable with the name of the annotator."""


def annotator(default: str = "") -> str:
    """Return the name of the annotator; the default where none is set.

    Raises:
        TrackerError: it is no name.
    """
    name = os.environ.get(VARIABLE, "")
    return checked_annotator(name) if name else default


def normalized_annotator(name: str) -> str:
    """Return a name in the form in which annotators are compared: without superfluous space, in one form of Unicode."""
    return " ".join(nfc_name(name).split())


def checked_annotator(name: str) -> str:
    """Return the name of an annotator, in `normalized_annotator`.

    Raises:
        TrackerError: it is no name.
    """
    try:
        return normalized_annotator(msgspec.convert(name, Name)) or name
    except msgspec.ValidationError as error:
        raise TrackerError(
            f"expected the annotator as a name of 1 to 200 characters on one line, found {quoted(name)}; choose another"
        ) from error
