"""Return the name of the person who annotates: the author of edits, tasks and comments.

One place says who it is, the environment variable `VARIABLE`: programs set it from their options for themselves and for
the programs that they start.
"""

import os

import msgspec

from tracker.errors import TrackerError
from tracker.validation import Name, quoted, same_form

VARIABLE = "QUADRILLE_ANNOTATOR"
"""Environment variable with the name of the annotator."""


def annotator(default: str = "") -> str:
    """Return the name of the annotator; the default where none is set.

    Raises:
        TrackerError: it is no name.
    """
    name = os.environ.get(VARIABLE, "")
    return checked_annotator(name) if name else default


def one_form(name: str) -> str:
    """Return a name in the form in which annotators are compared: without superfluous space, in one form of Unicode."""
    return " ".join(same_form(name).split())


def checked_annotator(name: str) -> str:
    """Return the name of an annotator, in `one_form`.

    Raises:
        TrackerError: it is no name.
    """
    try:
        return one_form(msgspec.convert(name, Name)) or name
    except msgspec.ValidationError as error:
        raise TrackerError(
            f"expected the annotator as a name of 1 to 200 characters on one line, found {quoted(name)}; choose another"
        ) from error
