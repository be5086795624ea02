"""Find and set when cameras of a session began, to a fraction of a frame."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil
from typing import NamedTuple

from tracker.compute.progress import Report, unreported
from tracker.errors import RecordingError, Remedy, SessionError
from tracker.footage.camera_source import CameraSource, missing_files
from tracker.footage.flash import Flash, find_flash
from tracker.footage.recording import Recording
from tracker.footage.sound import read_sound, sound_delay
from tracker.footage.start_times import read_start_times
from tracker.footage.video import open_footage
from tracker.session.footage_clocks import (
    ClockStarts,
    clock_notes,
    disagreement,
    find_clock_starts,
    find_name_starts,
    sound_disagreement,
)
from tracker.session.matching import check_names
from tracker.session.session import Session, check_content


class FoundStart(NamedTuple):
    """The start of a camera against that of the first one, by a sound or a flash, or against all others, by motion."""

    camera: str
    start_frames: float | None
    """See `CameraSource.start_frames`; None where nothing was found."""
    sigma_ms: float | None
    """Its standard deviation, ms; None where it is not known."""
    ratio: float | None
    """How much the peak or the flash stands out from the next largest."""
    is_clear: bool
    """Whether it stands out enough to be taken."""
    rate: float | None = None
    """Drift of the clock, see `Clock`; None where it was not estimated."""


def require_footage(session: Session) -> None:
    """Check that there are two cameras to compare, and that their footage is there.

    Raises:
        SessionError: one camera, or a file is missing.
    """
    if len(session.cameras) < 2:
        raise SessionError("expected two cameras or more, found one, which has nothing to be compared with")
    for missing in missing_files(session.cameras):
        if missing.kind == "footage":
            raise SessionError(
                f"camera '{missing.camera}': its footage {missing.path} is not there",
                Remedy("relink", session=session.folder),
            )


def find_starts(session: Session, way: str, report: Report = unreported) -> tuple[list[FoundStart], list[str]]:
    """Find the starts of the cameras in their footage.

    Args:
        session: of the cameras.
        way: `sound`, `flash` or `time code`.
        report: shows progress. An exception that it raises ends the search.

    Returns:
        The starts, and sentences on clocks that disagree with them.

    Raises:
        SessionError: footage is missing or has nothing to compare.
        RecordingError: footage cannot be read.
    """
    require_footage(session)
    report(f"comparing by {way}", 0.0)
    if way == "time code":
        return starts_by_clock(session)
    if way == "sound":
        starts = starts_by_sound(session)
    else:
        with Recording(session.cameras) as recording:
            starts = starts_by_flash(session, recording, report)
    return starts, clock_disagreement(session, way, starts)


def starts_by_sound(session: Session) -> list[FoundStart]:
    """Return the starts of all cameras but the first one with sound, by the sound of their videos.

    Raises:
        RecordingError: a video cannot be read.
        SessionError: fewer than two cameras have sound, or a video declares another frame rate than the session's.
    """
    for source in session.cameras:
        if source.declared_fps is not None:
            raise SessionError(
                f"camera '{source.camera.name}': expected a video of {session.fps:g} frames per second, found one that "
                f"declares {source.declared_fps:g}; its sound has another clock, so measure the offset by hand"
            )
    heard = [(c, read_sound(c.footage, c.camera.name)) for c in session.cameras]
    with_sound = [(c, sound) for c, sound in heard if sound is not None]
    if len(with_sound) < 2:
        raise SessionError(
            f"expected sound in the videos of two cameras or more, found it in {len(with_sound)}; give offsets, or "
            "use a flash"
        )
    (first, sound_of_first), out = with_sound[0], []
    for source, sound in heard:
        if source is first:
            continue
        delay = None if sound is None else sound_delay(sound_of_first, sound)
        if delay is None:
            out.append(FoundStart(source.camera.name, None, None, None, False))
            continue
        start = first.start_frames + delay.delay_s * session.fps
        out.append(FoundStart(source.camera.name, start, 1000 * delay.sigma_s, delay.ratio, delay.is_clear))
    return out


def starts_by_flash(session: Session, recording: Recording, report: Report = unreported) -> list[FoundStart]:
    """Return the starts of all cameras but the first, by a light that goes on in all pictures.

    Args:
        session: of the cameras.
        recording: their footage.
        report: shows progress. An exception that it raises ends the search.

    Raises:
        RecordingError: footage cannot be read.
    """
    flashes, n = list[Flash | None](), len(session.cameras)
    for i in range(n):
        report("comparing by flash", i / n)
        flashes.append(find_flash(recording, i, session.n_frames))
    first, seen = session.cameras[0], flashes[0]
    if seen is None or not seen.is_clear:
        return [FoundStart(c.camera.name, None, None, None, False) for c in session.cameras[1:]]
    out = []
    for source, flash in zip(session.cameras[1:], flashes[1:], strict=True):
        if flash is None:
            out.append(FoundStart(source.camera.name, None, None, None, False))
            continue
        in_footage, in_first = flash.frame + source.offset, seen.frame + first.offset
        start = first.start_frames + in_footage - in_first
        out.append(FoundStart(source.camera.name, start, None, flash.ratio, flash.is_clear))
    return out


def starts_by_clock(session: Session) -> tuple[list[FoundStart], list[str]]:
    """Return the starts of all cameras by the clocks of their footage, and sentences on clocks that disagree.

    Raises:
        SessionError: not all footage has a clock of one kind, or it does not show the starts.
        RecordingError: footage cannot be read, or the names of pictures do not show which are of one instant.
    """
    chosen, notes = _clocks(session)
    if chosen is None:
        kinds = "a time code, a GPS time or a creation time in the videos of all of two cameras or more"
        raise SessionError(f"{notes[0] if notes else f'expected {kinds}'}; give offsets, or use sound or a flash")
    files = {c.camera.name: c.footage for c in session.cameras}
    first = session.cameras[0]
    shift = first.start_frames - chosen.starts[first.camera.name]
    shift += ceil(max(0.0, -shift - min(chosen.starts.values())))  # footage has no frame before its first
    out = [FoundStart(name, start + shift, None, None, True) for name, start in chosen.starts.items()]
    return out, [*notes, *sound_disagreement(chosen, files, session.fps)]


def clock_disagreement(session: Session, source: str, found: Sequence[FoundStart]) -> list[str]:
    """Return a sentence if starts that were found otherwise contradict the clocks of the footage.

    Args:
        session: of the cameras.
        source: names the way in which they were found, such as `sound`.
        found: those that are not clear do not count.
    """
    try:
        chosen = _clocks(session)[0]
    except RecordingError:  # names of pictures that show nothing contradict nothing
        return []
    clear = {f.camera: f.start_frames for f in found if f.is_clear and f.start_frames is not None}
    if chosen is None or not clear:
        return []
    reference = next(c for c in session.cameras if c.camera.name not in {f.camera for f in found})
    starts = {reference.camera.name: reference.start_frames} | clear
    return disagreement(source, starts, chosen.source, chosen.starts)


def footage_clocks(session: Session, starts_by: str = "session") -> tuple[dict[str, str], list[str]]:
    """Return the best clock of each camera's footage, for a person, and sentences on them.

    Sentences name clocks that contradict the session, or that show other starts and are not to be taken.

    Args:
        session: of the cameras.
        starts_by: names what its starts are from, for the sentence.

    Raises:
        RecordingError: images cannot be read, or their names do not show which are of one instant.
    """
    read = {c.camera.name: read_start_times(c.footage, c.camera.name) for c in session.cameras}
    sources = {name: f"{starts[0].source} {starts[0].text}" for name, starts in read.items() if starts}
    chosen, notes = _clocks(session)
    if chosen is None:
        return sources, notes
    sources = {name: sources.get(name, chosen.source) for name in chosen.starts}
    starts = {c.camera.name: c.start_frames for c in session.cameras}
    return sources, disagreement(starts_by, starts, chosen.source, chosen.starts)


def _clocks(session: Session) -> tuple[ClockStarts | None, list[str]]:
    files = {c.camera.name: c.footage for c in session.cameras}
    n_frames = {c.camera.name: c.offset + session.n_frames for c in session.cameras}
    by_names = None
    if all(path.is_dir() for path in files.values()):
        by_names = find_name_starts({name: open_footage(path, name) for name, path in files.items()})
    declared = [c.declared_fps for c in session.cameras if c.declared_fps is not None]
    starts = find_clock_starts(files, session.fps, declared) if by_names is None else [by_names]
    return clock_notes(starts, n_frames)


def with_starts(session: Session, starts: Mapping[str, float], rates: Mapping[str, float]) -> Session:
    """Give cameras of a session other starts and drifts. Nothing is stored.

    Poses stay as they are: those tracked before are at the former times.

    Args:
        session: as it was loaded.
        starts: `CameraSource.start_frames` by camera name.
        rates: drift by camera name, see `Clock.rate`.

    Returns:
        The session with those clocks.

    Raises:
        SessionError: an unknown camera, or a start before its footage or too late for all frames of the session.
        RecordingError: footage cannot be read.
    """
    names = [c.camera.name for c in session.cameras]
    check_names([*starts, *rates], names, "camera", "the offsets")
    changed = replace(session, cameras=tuple(_started(session, c, starts, rates) for c in session.cameras))
    check_content(changed)
    return changed


def _started(
    session: Session, source: CameraSource, starts: Mapping[str, float], rates: Mapping[str, float]
) -> CameraSource:
    name = source.camera.name
    if name not in starts and name not in rates:
        return source
    out = source.starting_at(starts.get(name, source.start_frames), rates.get(name))
    if out.offset != source.offset:
        footage = open_footage(source.footage, name)
        n_frames = footage.n_frames
        footage.close()
        if out.offset + session.n_frames > n_frames:
            raise SessionError(
                f"camera '{name}': expected an offset of at most {n_frames - session.n_frames}, since the session has "
                f"{session.n_frames} of its {n_frames} frames, found {out.offset}; make another "
                "session of the frames that all cameras then have"
            )
    return out
