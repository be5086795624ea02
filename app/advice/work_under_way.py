"""Work that runs: what it is, how much is done, and Stop."""

from collections.abc import Iterator

import msgspec

from app.advice.stored_work import StoredWork
from app.messages.advice import Action, Advice
from app.state.progress import FindState, RangeState, TrackState, WorkState
from app.state.search import SearchState
from app.state.state import State

_STAGES = {"tracking": "Tracking", "back": "Tracking backward", "solve": "Estimating all frames together"}


def work_under_way(state: State, stored: StoredWork) -> Iterator[Advice]:
    """List all work, that first which a user waits for."""
    if state.track.first is not None:
        advice = _tracking(state.track, "find" if state.finding.running else "track")
        waits = state.compiling is not None and state.track.done == 0
        advice = msgspec.structs.replace(advice, done="waiting for compilation") if waits else advice
        yield _in_chain(advice, state.finding, "estimate" if state.track.stage == "solve" else "track")
    elif state.finding.running:
        yield _finding(state.finding)
    if state.acquisition.running:
        text = f"Acquiring the sizes of {stored.people[state.acquisition.person].name}"
        yield msgspec.structs.replace(_work(text, state.acquisition, "sizes"), is_timed=False)
    for of, (text, work) in {
        "calibration": ("Checking the cameras", state.calibration),
        "clocks": ("Working on the clocks", state.clocks),
        "observations": ("Working on observations", state.observations),
    }.items():
        if work.running:
            yield _work(text, work, of)
    if state.ranges.running:
        yield _on_range(state.ranges)
    if state.search.kind is not None or state.search.running:
        yield _searching(state.search)
    if state.compiling is not None:
        text = f"Compiling {state.compiling.replace('_', ' ')}, once after installation: you can go on"
        yield Advice("compiling", text, level="work")
    if state.footage.listed is not None:
        text = "Indexing the footage, once: frames can be shown as soon as they are indexed"
        yield Advice("indexing", text, (), "work", state.footage.listed, f"{state.footage.listed:.0%}")


def _stop(of: str) -> Action:
    return Action("stop", "Stop", of=of)


def _finding(finding: FindState) -> Advice:
    if not finding.trying:
        # Sizes are fitted until nothing moves.
        advice = msgspec.structs.replace(_work("Finding people", finding, "find"), is_timed=False)
        return _in_chain(advice, finding, finding.step)
    take = () if finding.takable is None else (Action("take_found", "Take this pose", finding.takable),)
    text = finding.trying[:1].upper() + finding.trying[1:]
    advice = Advice("find", text, (*take, _stop("find")), "work", finding.share, at_most_s=finding.left_s)
    return _in_chain(advice, finding, finding.step)


def _in_chain(advice: Advice, finding: FindState, step: str) -> Advice:
    """Return advice with the steps of the chain that the work belongs to, if there is one."""
    if not finding.running or step not in finding.steps:
        return advice
    return msgspec.structs.replace(advice, steps=finding.steps, step=finding.steps.index(step))


def _work(text: str, work: WorkState, of: str) -> Advice:
    stage = f": {work.stage}" if work.stage else ""
    return Advice(of, f"{text}{stage}", (_stop(of),), "work", work.share, f"{work.share:.0%}")


def _searching(search: SearchState) -> Advice:
    best = "" if search.best_px is None else f", best {search.best_px:.2f} px"
    done = f"{search.evaluations:,} poses scored{best}"
    if search.running:
        return Advice("searching", f"Searching: {search.stage or 'starting'}", (_stop("search"),), "work", done=done)
    go_on = Action("search", "Search on"), _stop("search")
    return Advice("search_paused", f"The search is paused: {search.stage}", go_on, "work", done=done)


def _tracking(track: TrackState, of: str) -> Advice:
    share = track.done / max(1, track.total)
    counts = [f"{n} {word}" for n, word in ((track.doubtful, "doubtful"), (track.lost, "lost")) if n]
    rate = [f"{track.per_second:.1f} a second"] if track.per_second else []
    frames = ", ".join([f"{track.done:,} of {track.total:,} frames", *rate, *counts])
    done = frames if track.stage == "tracking" else "you can go on"
    if track.running:
        is_timed = track.stage != "solve"  # the estimate ends when nothing moves
        return Advice("tracking", _STAGES[track.stage], (_stop(of),), "work", share, done, is_timed=is_timed)
    text = "Tracking is paused" + ("" if track.at is None else f" at frame {track.at}")
    return Advice("paused", text, (Action("resume", "Go on"), _stop(of)), "work", share, done)


def _on_range(ranges: RangeState) -> Advice:
    text, done = ranges.what[:1].upper() + ranges.what[1:], f"{ranges.done:,} of {ranges.total:,}"
    return Advice("range", text, (_stop("range"),), "work", ranges.done / max(1, ranges.total), done)
