"""The table of situations: all that can hold of a session, the most urgent first."""

from collections.abc import Callable, Iterator, Sequence

from app.advice.stored_work import StoredWork
from app.advice.work_under_way import work_under_way
from app.messages.advice import Action, Advice
from app.state.state import State
from tracker.body.limbs import display_name, limb_display_name

_Situation = Callable[[State, StoredWork], Iterator[Advice]]


def advise(state: State, stored: StoredWork) -> list[Advice]:
    """List what holds, the most urgent first: the first is what the line says, and the next if that is dismissed.

    Args:
        state: of the page.
        stored: what the session stores; not read while work runs.
    """
    return [advice for situation in SITUATIONS for advice in situation(state, stored)]


def _unsaved(state: State, _: StoredWork) -> Iterator[Advice]:
    if state.save_error is not None:
        text = f"Not saved: {state.save_error}. Edits are kept in memory until saving succeeds."
        yield Advice("unsaved", text, (Action("retry", "Retry"),), "fault")


def _damaged(state: State, _: StoredWork) -> Iterator[Advice]:
    if state.footage.error is not None:
        yield Advice("damaged", _sentence(state.footage.error), level="fault")


def _not_found(state: State, stored: StoredWork) -> Iterator[Advice]:
    finding = state.finding
    if not finding.failed or not stored.unplaced:
        return
    reason = finding.message.split(";")[0].rstrip(".")
    text = f"People were not found: {reason[:1].lower()}{reason[1:]}."
    person, frame = stored.unplaced[0], finding.tried
    by_hand = Action("place", "Place by hand", frame, person)
    if frame is None:
        yield Advice("not_found", text, (by_hand, _section("find")), "fault")
        return
    look = Action("show_silhouettes", f"Show silhouettes of frame {frame}", frame, camera=finding.camera)
    yield Advice("not_found", text, (by_hand, look, _section("find")), "fault")


def _failed(state: State, _: StoredWork) -> Iterator[Advice]:
    parts = {"sizes": state.acquisition, "calibration": state.calibration, "clocks": state.clocks}
    parts |= {"observations": state.observations}
    for section, work in parts.items():
        if work.failed and work.message:
            yield Advice("failed", _sentence(work.message), (_section(section),), "fault")
    if state.search.failed:
        yield Advice("search_failed", _sentence(state.search.message), level="fault")
    if state.track.failed and state.track.notice:
        yield Advice("run_failed", _sentence(state.track.notice), level="fault")


def _no_depth(state: State, stored: StoredWork) -> Iterator[Advice]:
    note = state.undetermined_depth
    if note is None:
        return
    view, (point, *others) = stored.cameras[note.unseen.camera], note.unseen.points
    joints = f"{display_name(point)} and {len(others)} more are" if others else f"{display_name(point)} is"
    text = f"The views so far do not show how far away the {joints}. Drag it in {view}, too."
    yield Advice("no_depth", text, (Action("show_view", f"Show {view}", camera=note.unseen.camera),))


def _nobody(state: State, stored: StoredWork) -> Iterator[Advice]:
    unplaced = stored.unplaced
    if not unplaced:
        return
    is_anybody = len(unplaced) == len(stored.people)
    who = "Nobody is placed yet" if is_anybody else f"{_are(stored, unplaced)} not placed yet"
    by_hand = Action("place", "Place by hand", person=unplaced[0])
    points = next((s.name for s in state.observations.sets if not s.problem and not s.is_in_space), None)
    if points is not None:
        text, how = f"{who}, and the session has key points.", Action("by_key_points", "Find by key points", of=points)
    elif stored.has_outlines:
        text, how = f"{who}. Find people, or drag bodies onto them.", Action("find", "Find people")
    else:
        text = f"{who}, and no camera has a background or masks. Let a network find the people, or place them by hand."
        how = Action("detect", "Detect and track")
    yield Advice("nobody", text, (how, by_hand))


def _elsewhere(state: State, stored: StoredWork) -> Iterator[Advice]:
    """The start is on another frame, and nothing is tracked yet."""
    if stored.is_tracked or stored.unplaced or all(p.source is not None for p in state.people):
        return
    missing = [i for i, p in enumerate(state.people) if p.source is None]
    frame = stored.people[missing[0]].first
    text = f"{_are(stored, missing)} placed on frame {frame}, not here."
    yield Advice("elsewhere", text, (Action("go_to", f"Go to frame {frame}", frame),))


def _start(state: State, stored: StoredWork) -> Iterator[Advice]:
    """Everybody has a pose here, and nothing is tracked yet: search, fit, track."""
    if stored.is_tracked or stored.unplaced or any(p.source is None for p in state.people):
        return
    sources = {p.source for p in state.people}
    search, fit, track = Action("search", "Search"), Action("fit", "Fit"), Action("track", "Track from here")
    if "fitted" in sources or "tracked" in sources:
        if state.compared is None or state.compared.work != "fit":
            text = "The pose here is fitted. Track, or drag what is off and fit again."
            yield Advice("fitted", text, (track, fit))
    elif "searched" in sources:
        text = "The search is done. Drag what is off, then fit the body to the contours."
        yield Advice("searched", text, (fit, track))
    else:
        yield Advice("placed", "Everybody is placed here. Search for the pose around, then fit it.", (search, fit))


def _fitted(state: State, stored: StoredWork) -> Iterator[Advice]:
    """The shown pose is the result of the last fit or search."""
    last = state.compared
    if last is None:
        return
    before = Action("show_before", "Show result" if last.is_before_shown else "Show before")
    back = tuple[Action, ...]()
    if last.moved:
        limb = limb_display_name(last.moved[0][1].limb.name)
        back = (Action("take_back", f"Take back {limb}", state.frame),)
        if len(last.moved) > 1:
            back = (*back, Action("take_all_back", "Take back all", state.frame))
    moved = ", ".join(
        f"{limb_display_name(m.limb.name)}{_whose(stored, i)} {100 * m.distance_m:.0f} cm" for i, m in last.moved
    )
    n = len(last.moved)
    also = f" It moved {n} {'limb' if n == 1 else 'limbs'} that you had not placed: {moved}." if n else ""
    if last.warning:
        yield Advice("contradicted", f"{_sentence(last.warning)}{also}", (before, *back), "doubt")
    elif last.filled.is_refused:
        view = last.filled.worst_camera or ""
        share = f"{last.filled.overlaps.min():.0%} of their area in {view}"
        text = f"Bodies and silhouettes share only {share}. Drag what is off there, then fit again.{also}"
        show = Action("show_view", f"Show {view}", camera=stored.cameras.index(view))
        yield Advice("unfilled", text, (show, Action("fit", "Fit"), before, *back), "doubt")
    elif last.work == "fit" and not stored.is_tracked and not stored.unplaced:
        n_views = len(last.filled.overlaps)
        fits = (
            f"The fit fills the silhouettes of {n_views} views." if n_views else "The fit is done: look at each view."
        )
        actions = (Action("track", "Track from here"), before, *back)
        yield Advice("fitted", f"{fits}{also or ' Track from here.'}", actions)
    elif n:
        yield Advice("moved", f"The fit is done.{also}", (before, *back))


def _sizes_drafted(state: State, stored: StoredWork) -> Iterator[Advice]:
    draft = state.draft
    if draft is not None and draft.poses:
        text = f"The sizes of {stored.people[draft.person].name} are acquired. Apply them, then track again."
        yield Advice("drafted", text, (Action("apply_sizes", "Apply", person=draft.person), _section("sizes")))


def _outdated(state: State, stored: StoredWork) -> Iterator[Advice]:
    n = sum(map(len, state.calibration.outdated.values()))
    if n:
        text = f"{n:,} {'pose is' if n == 1 else 'poses are'} of an earlier calibration. Track them again."
        yield Advice("outdated", text, (Action("track_again", "Track again"), _section("calibration")))
    resized = [i for i, (shown, now) in enumerate(zip(state.revisions, state.present, strict=True)) if shown != now]
    if resized and stored.is_tracked:
        text = f"{_are(stored, resized)} shown with former sizes here. Track again from here."
        yield Advice("resized", text, (Action("track", "Track from here"), _section("sizes")))


def _camera_off(state: State, _: StoredWork) -> Iterator[Advice]:
    check = state.calibration.check
    if check is not None and check.named:
        apply = () if state.calibration.refused else (Action("apply_correction", "Apply correction"),)
        yield Advice("camera_off", _sentence(check.contradictions[0]), (*apply, _section("calibration")), "doubt")
    elif check is None and state.track.notice and not state.track.failed:
        check_cameras = Action("check_cameras", "Check the cameras")
        yield Advice("camera_doubt", _sentence(state.track.notice.partition(";")[0]), (check_cameras,), "doubt")


def _untracked(_: State, stored: StoredWork) -> Iterator[Advice]:
    """A part of the recording before the first pose, or behind the last one, has none."""
    if not stored.is_tracked or stored.unplaced:
        return
    first = max(p.first or 0 for p in stored.people)
    last = min(p.last or 0 for p in stored.people)
    step = max(p.step for p in stored.people)
    end = stored.n_frames - 1
    for one, other, frame, way in ((last + 1, end, last, "forward"), (0, first - 1, first, "backward")):
        if other - one + 1 >= step:
            track = Action("track", f"Track {way} from frame {frame}", frame, of=way)
            yield Advice("untracked", f"{_span(one, other)} have no pose yet.", (track,))


def _unsure(state: State, stored: StoredWork) -> Iterator[Advice]:
    """Poses of a run are in doubt, and nobody has looked at them."""
    n = sum(p.n_unsure for p in stored.people)
    if not n or not stored.is_tracked:
        return
    in_doubt = [(p.unsure[0], i) for i, p in enumerate(stored.people) if p.unsure]
    worst, person = max(in_doubt, key=lambda one: one[0].severity)
    places = sum(len(p.unsure) for p in stored.people) - 1
    more = f", and {places} more {'place' if places == 1 else 'places'}" if places else ""
    good = f"{stored.n_poses - n:,} of {stored.n_poses:,} {'frames' if len(stored.people) == 1 else 'poses'} are good"
    how = f"{_whose(stored, person)} {'lost' if worst.status == 'lost' else 'unsure'}"
    text = f"{good}. {_span(worst.first, worst.last)}: {worst.limb or 'pose'}{how}{more}."
    look, accept = Action("show_doubt", "Look", worst.worst, person), Action("accept", "It is right")
    actions = (accept, look) if worst.first <= state.frame <= worst.last else (look,)
    yield Advice("unsure", text, actions, "doubt")


def _usual_sizes(_: State, stored: StoredWork) -> Iterator[Advice]:
    usual = [i for i, p in enumerate(stored.people) if p.has_usual_sizes]
    if usual and stored.is_tracked and not stored.unplaced:
        text = f"{_are(stored, usual)} tracked with usual proportions. Acquire their own, then track again."
        yield Advice("usual_sizes", text, (Action("acquire", "Acquire sizes", person=usual[0]),))


def _done(_: State, stored: StoredWork) -> Iterator[Advice]:
    if stored.is_tracked and not stored.unplaced and not any(p.n_unsure for p in stored.people):
        yield Advice("done", f"All {stored.n_poses:,} poses are good or looked at.", (Action("export", "Export…"),))


SITUATIONS: Sequence[_Situation] = (
    _unsaved, _damaged, work_under_way, _not_found, _failed, _no_depth, _nobody, _elsewhere, _fitted, _start,
    _sizes_drafted, _outdated, _camera_off, _untracked, _usual_sizes, _unsure, _done,
)  # fmt: skip
"""In order of urgency. Sizes come before doubts: a run with a person's own sizes has fewer."""


def _section(name: str) -> Action:
    return Action("show_section", "Details", of=name)


def _are(stored: StoredWork, people: Sequence[int]) -> str:
    names = " and ".join(stored.people[i].name for i in people)
    return f"{names} is" if len(people) == 1 else f"{names} are"


def _whose(stored: StoredWork, person: int) -> str:
    return f" of {stored.people[person].name}" if len(stored.people) > 1 else ""


def _span(first: int, last: int) -> str:
    return f"Frame {first}" if first == last else f"Frames {first} to {last}"


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:].rstrip('.')}."
