"""The command line: `quadrille COMMAND ...`; without a command, the page on the bundled sample."""

import errno
import os
import sys
from collections.abc import Callable
from contextlib import nullcontext, redirect_stdout
from typing import NoReturn, TextIO, cast

import tyro
from rich.console import Console

from app.cli import (
    acquire,
    audit,
    bench,
    body,
    doctor,
    evaluate,
    experiment,
    export,
    index,
    info,
    init,
    new,
    observability,
    relink,
    restore,
    simulate,
    track,
)
from app.cli import open as open_
from app.cli.annotation import assign, compare, merge, next_, share, tasks
from app.cli.arguments import gather_repeated
from app.cli.batches import batch
from app.cli.calibration import calibrate, check, sync
from app.cli.observations import detect, import_, judge
from app.remedies import command_line_text
from app.runtime import process_exit
from app.runtime.log_limit import limit_log
from app.runtime.malloc_trim import give_back_freed_memory
from app.runtime.plain_output import PlainOutput, printable
from tracker.compute.extensions import pass_over_unread_packages
from tracker.compute.installed_package import program_version
from tracker.errors import TrackerError

pass_over_unread_packages()  # as this module is imported, so that processes that it starts do, too

_COMMANDS: dict[str, Callable[..., None]] = {
    "open": open_.command,
    "new": new.command,
    "calibrate": calibrate.command,
    "import": import_.command,
    "detect": detect.command,
    "info": info.command,
    "relink": relink.command,
    "sync": sync.command,
    "index": index.command,
    "init": init.command,
    "body": body.command,
    "acquire": acquire.command,
    "track": track.command,
    "audit": audit.command,
    "next": next_.command,
    "judge": judge.command,
    "assign": assign.command,
    "tasks": tasks.command,
    "merge": merge.command,
    "check": check.command,
    "evaluate": evaluate.command,
    "compare": compare.command,
    "observability": observability.command,
    "export": export.command,
    "share": share.command,
    "restore": restore.command,
    "simulate": simulate.command,
    "batch": batch.command,
    "experiment": experiment.command,
    "bench": bench.command,
    "doctor": doctor.command,
}
_ADDED_HELP = {"evaluate": evaluate.added_help, "export": export.added_help}
"""Sentence about the extensions of other packages, which are loaded when help is asked for."""
_HELP = ("-h", "--help")
_OF_DISKS = (
    errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.ENAMETOOLONG
)  # fmt: skip
"""Errors of folders and disks, which commands meet in many places."""
_ABOUT = """Model-based human motion capture from several calibrated cameras.

Without a command, the page opens with a bundled sample; quadrille SESSION opens a session. quadrille COMMAND --help
describes a command, quadrille --version prints the version."""


def _command_line(words: list[str]) -> tyro.extras.SubcommandApp:
    """Register the commands. The list of all shows the first line of each."""
    app = tyro.extras.SubcommandApp()
    for name, command in _COMMANDS.items():
        summary = (command.__doc__ or "").partition("\n")[0]
        if name == words[0] and name in _ADDED_HELP and set(words) & {*_HELP}:
            command.__doc__ = f"{command.__doc__}\n    {_ADDED_HELP[name]()}\n    "
        app.command(name=name, help=summary if words[0] in _HELP else None)(command)
    return app


def main() -> None:
    """Run the command line. Errors of users and files are one sentence on standard error and status 1."""
    words = sys.argv[1:]
    if words[:1] == ["--version"]:
        print(f"quadrille {program_version()}")
        return
    if not words or (words[0] not in _COMMANDS and words[0] not in _HELP):
        words = ["open", *words]
    if not set(words) & {*_HELP}:
        from app.session.annotator import set_annotator

        set_annotator(None)
    # Help has colours, and shows nothing of a file.
    out = nullcontext() if set(words) & {*_HELP} else redirect_stdout(cast(TextIO, PlainOutput(sys.stdout)))
    try:
        with out:
            if words[0] in _COMMANDS:
                words = gather_repeated(words, _COMMANDS[words[0]])
            _command_line(words).cli(
                prog="quadrille", description=_ABOUT, args=words, config=(tyro.conf.FlagCreatePairsOff,)
            )
            sys.stdout.flush()
    except TrackerError as error:
        _refuse(command_line_text(error))
    except KeyboardInterrupt as stopped:
        sys.exit(stopped.status if isinstance(stopped, process_exit.TerminationError) else process_exit.INTERRUPTED)
    except BrokenPipeError:  # as in `quadrille evaluate S | head -1`: the reader has closed the pipe
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # discard what is still buffered
        sys.exit(141)
    except OSError as error:
        if error.errno not in _OF_DISKS:
            raise
        place = "a file" if error.filename is None else error.filename
        _refuse(f"cannot read or write {place}: {error.strerror}; check its name, your permissions and the room there")


def _refuse(sentence: str) -> NoReturn:
    """Show why the command ends, and end it."""
    text = printable(f"quadrille: {sentence}")
    Console(stderr=True).print(text, style="bold red", markup=False, highlight=False, soft_wrap=True)
    sys.exit(1)


def program() -> None:
    """Run `main` as a process of its own."""
    limit_log()
    give_back_freed_memory()
    process_exit.run(main)
