"""Bound the steps of a query, so that odd rows cannot keep the program busy for ever, and let signals end it."""

import sqlite3
from collections.abc import Callable, Generator
from contextlib import contextmanager

_TICK_STEPS = 10_000
"""Steps of SQLite's virtual machine between two looks at the limit: less than a millisecond."""
_FREE_STEPS = 20_000_000
"""Steps that any query may take: about a second."""
_STEPS_PER_BYTE = 50
"""Steps that a query may take for each byte of the file. Queries of the program visit each row a few times."""


class EndlessQueryError(Exception):
    """A query took more steps than the rows of the store can need."""


@contextmanager
def limited(db: sqlite3.Connection, n_bytes: Callable[[], int]) -> Generator[None, None, None]:
    """Limit the steps of the queries within a `with` block, together.

    Args:
        db: connection that runs them.
        n_bytes: returns the size of the store; called once if they take long.

    Raises:
        EndlessQueryError: they took too many steps.
        BaseException: that a signal raised meanwhile, which SQLite would hide.
    """
    n_ticks, raised = 0, list[BaseException]()

    def tick() -> int:
        nonlocal n_ticks
        try:
            n_ticks += 1
            n_steps = n_ticks * _TICK_STEPS
            return int(n_steps > _FREE_STEPS and n_steps > _FREE_STEPS + _STEPS_PER_BYTE * n_bytes())
        except BaseException as error:
            raised.append(error)
            return 1

    db.set_progress_handler(tick, _TICK_STEPS)
    try:
        yield
    except sqlite3.OperationalError as error:
        if raised:
            raise raised[0] from error
        if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_INTERRUPT:
            raise EndlessQueryError("a query took more steps than its rows can need") from error
        raise
    finally:
        db.set_progress_handler(None, 0)
