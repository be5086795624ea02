"""`quadrille track --init auto --acquire`: find people, acquire their sizes, and track in both directions."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from typing import TYPE_CHECKING, Any

from app.cli.init_silhouettes import unplaced
from app.cli.target import Target, load_target
from app.runtime.progress import Reporter
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.pipeline.find_people import FoundPeople
    from tracker.session.session import Session
    from tracker.store.annotation_store import AnnotationStore

_CHAIN = "find people"
"""Setting of the store: the first frame of a chain that was interrupted while tracking, and the directions that are
done."""


Track = Callable[[Target, Sequence[int]], dict[str, Any]]
"""Tracks people over frames, given in the order of tracking; see `app.cli.track.track`."""


def track_found(at: Target, frames: range, acquire: bool, progress: Reporter, track: Track) -> dict[str, Any]:
    """Find the people who have no pose, track from there to the begin of a range, and then over the whole range.

    Each stage is stored when it is done. An interrupted run goes on where it was when it is run again.

    Args:
        at: the session and the people.
        frames: to track, ascending.
        acquire: whether sizes are acquired from the contours before tracking.
        progress: shows how far it is, with a sentence for each stage.
        track: tracks people who were found.

    Returns:
        What `track` returns of the last direction, and `first_frame`.

    Raises:
        TrackerError: no frame shows the people well enough; nothing is stored then.
    """
    first_frame, done = _find(at, frames, acquire, progress)
    # Bodies may have changed.
    name = at.session.people[at.people[0]].name if len(at.people) < len(at.session.people) else None
    at = load_target(at.session.folder, name, several=True)
    # The way back only leads to the first frame. The way forward then covers the whole range as one motion.
    ways = {"backward": [k for k in frames if k <= first_frame][::-1], "forward": list(frames)}
    if len(ways["backward"]) < 2:
        del ways["backward"]
    results: list[dict[str, Any]] = []
    for way, own in ways.items():
        if not own or way in done:
            continue
        progress.say(f"tracking {way} from frame {own[0]} to {own[-1]}")
        found = track(at, own)
        results.append(found)
        if found["stopped_at"] is not None:
            break
        done = [*done, way]
        _note(at.session, {"frame": first_frame, "done": done} if set(done) < set(ways) else None)
    if not results:
        raise TrackerError("expected frames to track, found none; give a longer range with --frames")
    return {**results[-1], "first_frame": first_frame}


def _find(at: Target, frames: range, acquire: bool, progress: Reporter) -> tuple[int, list[str]]:
    """Find the people without a pose and store them; return the first frame and the directions that are tracked."""
    from tracker.session.lock import SessionLock
    from tracker.session.relink import require_files
    from tracker.store.annotation_store import AnnotationStore

    session = at.session
    require_files(session)
    with SessionLock(session.folder), closing(AnnotationStore(session.annotations_path)) as store:
        chain = store.setting(_CHAIN)
        missing = unplaced(session, store, at.people)
        if chain is not None and not missing and chain["frame"] in frames:
            progress.say(f"going on from frame {chain['frame']}, where all people were found")
            return chain["frame"], list(chain["done"])
        if not missing:
            return _placed_frame(session, store, at.people, frames, progress), []
        found = _found(session, missing, frames, acquire, progress)
        from tracker.pipeline.find_people import sentences, store_found

        store_found(session, store, found)
        for sentence in sentences(session, found):
            progress.say(sentence)
        store.set_setting(_CHAIN, {"frame": found.frame, "done": []})
        return found.frame, []


def _placed_frame(
    session: "Session", store: "AnnotationStore", people: Sequence[int], frames: range, progress: Reporter
) -> int:
    """Return the first frame on which all people have a pose.

    Raises:
        TrackerError: there is none.
    """
    placed = [{row.frame for row in store.frames(session.people[i].name)} for i in people]
    both = sorted(set.intersection(*placed) & set(frames))
    if not both:
        raise TrackerError(
            "expected a frame on which all people have a pose, found none; clear those of one person, or track without "
            "--init"
        )
    progress.say(f"all people have a pose on frame {both[0]}: tracking starts there")
    return both[0]


def _found(
    session: "Session", people: Sequence[int], frames: range, acquire: bool, progress: Reporter
) -> "FoundPeople":
    from tracker.evidence.observer import Observer
    from tracker.footage.recording import Recording
    from tracker.pipeline.find_people import FindSettings, find_people

    stage_now = ""
    with Recording(session.cameras) as recording, progress.share("finding people") as advance:

        def report(stage: str, share: float, text: str) -> None:
            nonlocal stage_now
            if stage not in (stage_now, "done"):
                stage_now = stage
                progress.say(stage)
            if text:
                progress.say(text)
            advance(share)

        observer = Observer(session.cameras, recording)
        return find_people(session, observer, people, frames, FindSettings(acquire=acquire), report)


def _note(session: "Session", chain: Mapping[str, Any] | None) -> None:
    from tracker.session.lock import SessionLock
    from tracker.store.annotation_store import AnnotationStore

    with SessionLock(session.folder), closing(AnnotationStore(session.annotations_path)) as store:
        store.set_setting(_CHAIN, chain)
