"""`quadrille batch`: track the recordings of a plan."""

import sys
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app.cli.arguments import OptionalName, OptionalPath, OptionalWhole
from app.remedies import command_line_text
from app.runtime.json_output import format_json
from app.runtime.progress import Reporter
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.batch.manifest import Manifest
    from tracker.batch.plan import BatchPlan

_SUFFIX = "_batch"


@dataclass(frozen=True)
class BatchArguments:
    """Arguments of `quadrille batch`."""

    plan: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="PLAN", help="TOML file; docs/batch.md")]
    """TOML file; docs/batch.md describes it."""
    out: OptionalPath = None
    """folder of the batch: tasks, their states and results. PLAN_batch beside the plan by default."""
    workers: OptionalWhole = None
    """number of processes; by default as many as cores and free memory allow."""
    check: bool = False
    """check all recordings and their settings, and write and run nothing."""
    slurm: bool = False
    """write the scripts of a job array and of the step after it, and run nothing."""
    dask: OptionalName = None
    """address of a running scheduler: its workers do the tasks. Needs quadrille[dask]."""
    work: bool = False
    """do tasks of --out in this process until none is left, as the jobs of an array do."""
    retry: bool = False
    """do failed tasks again."""
    table: bool = False
    """show the table of results, and run nothing."""
    report: OptionalPath = None
    """write the table to this HTML file, too."""
    json: bool = False
    """print one JSON object."""


def command(arguments: Annotated[BatchArguments, tyro.conf.arg(name="")]) -> None:
    """Track the recordings of a plan, and show which of them need a person.

    All recordings are checked before anything is written. Ctrl+C stops it; run it again to go on. Recordings that fail
    are listed with the reason, and the others go on.
    """
    from platformdirs import user_state_path

    from app.cli.batches import batch_summary, local
    from app.session.recent_sessions import TABLE_FILE, remember_batch
    from tracker.batch.manifest import Manifest
    from tracker.batch.plan import read_plan
    from tracker.files import write_text_atomic

    out = arguments.out or arguments.plan.with_name(arguments.plan.stem + _SUFFIX)
    _check(arguments)
    if arguments.work:
        local.work_here(out)
        return
    progress, is_stopped = Reporter(silent=arguments.json), False
    if arguments.table:
        has_plan = arguments.plan.exists()
        manifest = Manifest.load(out, read_plan(arguments.plan, out.resolve()) if has_plan else None)
    else:
        plan = read_plan(arguments.plan, out.resolve())
        _check_recordings(plan, out, arguments, progress)
        if arguments.check:
            return
        manifest = Manifest.create(plan, out.resolve())
    if arguments.retry:
        manifest.retry()
    if arguments.slurm:
        from app.cli.batches.slurm import write_scripts

        print(write_scripts(manifest, arguments.plan.resolve()))
        return
    if not arguments.table and not manifest.is_finished():
        is_stopped = _run(manifest, arguments, progress)
    found = batch_summary.record(manifest)
    with suppress(OSError) if arguments.table else nullcontext():  # a batch of others may be one to read only
        write_text_atomic(manifest.folder / TABLE_FILE, format_json(found))
    remember_batch(user_state_path("quadrille", appauthor=False), manifest.folder)
    if arguments.report is not None:
        from app.export.batch_report import write_batch_report

        write_batch_report(found, arguments.report)
    print(format_json(found) if arguments.json else batch_summary.format_table(found))
    if is_stopped:
        sys.exit(130)
    if found["totals"]["failed"]:
        sys.exit(1)


def _check(arguments: BatchArguments) -> None:
    ways = ("check", "slurm", "work", "table")
    given = [f"--{w}" for w in ways if getattr(arguments, w)] + ["--dask"] * (arguments.dask is not None)
    given += ["--workers"] * (arguments.workers is not None)
    if len(given) > 1:
        raise TrackerError(f"expected one of {', '.join(given)}, found all of them; choose one")
    if arguments.report is not None and not arguments.report.parent.is_dir():
        raise TrackerError(
            f"expected --report in a folder that exists, found none at {arguments.report.parent}; make it"
        )
    if arguments.workers is not None and arguments.workers < 1:
        raise TrackerError(f"expected --workers as a whole number from 1, found {arguments.workers}; correct it")


def _check_recordings(plan: "BatchPlan", out: Path, arguments: BatchArguments, progress: Reporter) -> None:
    """Check the recordings that are still to be tracked.

    Raises:
        TrackerError: some cannot be; the message has a line for each.
    """
    from tracker.batch.checks import problems
    from tracker.batch.manifest import ended_names

    ended = ended_names(out, arguments.retry)
    with progress.over(len(plan.recordings), "checking recordings") as tick:
        found = problems(plan, ended, tick)
    listed = [{"name": problem.name, "error": command_line_text(problem.error)} for problem in found]
    names = [recording.name for recording in plan.recordings]
    if arguments.check and arguments.json:
        print(format_json({"recordings": names, "problems": listed, "columns_not_read": plan.unread}))
        sys.exit(1 if found else 0)
    if found:
        lines = [f"expected recordings that can be tracked, found {len(found)} that cannot:"]
        lines += [f"{one['name']}: {one['error']}" for one in listed]
        raise TrackerError("\n".join([*lines, "correct them, or leave recordings out with skip = true"]))
    if plan.unread:
        progress.say(f"columns of the table that are not read: {', '.join(plan.unread)}")
    if arguments.check:
        print(f"all recordings can be tracked: {len(names)}, of which {len(ended & {*names})} have ended")


def _run(manifest: "Manifest", arguments: BatchArguments, progress: Reporter) -> bool:
    """Do the tasks; return whether the user stopped it."""
    if arguments.dask is not None:
        from app.cli.batches.dask_cluster import run_on_cluster

        return run_on_cluster(manifest, arguments.dask, progress)
    from app.cli.batches.local import run_locally

    return run_locally(manifest, arguments.workers, progress)
