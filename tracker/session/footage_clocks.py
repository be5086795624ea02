"""Pair the footage of cameras by their clocks: those in video files, and the times in names of pictures."""

from collections.abc import Collection, Mapping, Sequence
from functools import reduce
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tracker.errors import RecordingError, Remedy
from tracker.footage.camera_source import LostFrames
from tracker.footage.chapters import Chapter, ChapteredVideo, next_chapter
from tracker.footage.frame_rates import same_rate
from tracker.footage.image_folder import ImageFolder
from tracker.footage.sound import SoundSettings, read_sound, sound_delay
from tracker.footage.start_times import CREATION_TIME, GPS_TIME, TIME_CODE, StartTime, read_start_times
from tracker.footage.video import Footage, VideoFile
from tracker.geometry.arrays import Array, IntArray
from tracker.session.row_placement import AGREE


class ClockStarts(NamedTuple):
    """The starts of all cameras by one kind of clock."""

    source: str
    """Of `tracker.footage.start_times`, or the time in names of pictures."""
    starts: Mapping[str, float]
    """`CameraSource.start_frames` by camera; the last camera to begin has 0."""
    doubt: str
    """Why the starts are not taken, as the end of a sentence; empty if they are."""
    text: str
    """The clock of each camera, for a sentence."""
    lost: Mapping[str, Sequence[LostFrames]] = {}
    """Frames that cameras lost, with frames of the footage."""
    is_against_numbers: bool = False
    """Whether the numbers in the names of pictures pair frames otherwise, or not at all."""

    @property
    def is_needed(self) -> bool:
        """Whether frames would be paired otherwise without these starts."""
        return any(self.starts.values()) or any(self.lost.values()) or self.is_against_numbers


def find_clock_starts(files: Mapping[str, Path], fps: float, declared: Collection[float] = ()) -> list[ClockStarts]:
    """Return the starts of cameras by each kind of clock that all their files have, the best kind first.

    Args:
        files: footage by camera name.
        fps: frame rate of the session, 1/s.
        declared: rates of the videos where they are not the session's, 1/s.
    """
    read = {name: read_start_times(path, f"camera '{name}'") for name, path in files.items()}
    out = []
    for source in (TIME_CODE, GPS_TIME, CREATION_TIME):
        times = {name: s for name, own in read.items() for s in own if s.source == source}
        if len(times) < len(files) or len(files) < 2:
            continue
        latest = max(times.values(), key=lambda s: _after(s, next(iter(times.values()))))
        starts = {name: round(-_after(s, latest) * fps, 3) + 0.0 for name, s in times.items()}  # no -0
        text = ", ".join(f"'{name}' {s.text}" for name, s in times.items())
        out.append(ClockStarts(source, starts, _doubt(list(times.values()), fps, declared), text))
    return out


def _after(time: StartTime, other: StartTime) -> float:
    """Return how much later a clock shows than another, s; of clocks that begin again, at most half a round."""
    apart = time.seconds - other.seconds
    return apart - time.period_s * round(apart / time.period_s) if np.isfinite(time.period_s) else apart


def _doubt(times: Sequence[StartTime], fps: float, declared: Collection[float]) -> str:
    step = max(s.step_s for s in times) * fps
    if times[0].source == TIME_CODE and any(not same_rate(rate, fps) for rate in declared):
        return f"it counts at another rate than the session's {fps:g} per second"
    if times[0].source == TIME_CODE and len({s.text[8] == ":" for s in times}) > 1:
        return "it leaves out numbers (drop-frame) in some cameras only"
    if step > 1 + AGREE:
        return f"it is known to {step:.0f} frames only"
    if all(s.may_count_pairs for s in times) and len({s.text for s in times}) > 1:
        return "it may count each two pictures as one, since no frame in it is in the upper half of its rate"
    return ""


def clock_notes(found: Sequence[ClockStarts], n_frames: Mapping[str, int]) -> tuple[ClockStarts | None, list[str]]:
    """Choose the clocks by which cameras are paired, and say so.

    Args:
        found: by `find_clock_starts`.
        n_frames: number of frames of each camera's footage.

    Returns:
        The clocks whose starts are to be taken, if any; sentences on them and on others that disagree.
    """
    chosen, notes = None, []
    for clocks in found:
        differs, doubt = max(clocks.starts.values()) > 1 + AGREE, clocks.doubt
        if any(start > n_frames[name] - 1 for name, start in clocks.starts.items()):
            doubt = doubt or "by it the cameras have no frame in common"
        listed = listed_starts(clocks.starts)
        if chosen is None and not doubt:
            chosen = clocks
            if clocks.is_needed:
                notes.append(f"the {clocks.source} of all cameras pairs frames ({clocks.text}): offsets {listed}")
            notes += [
                f"camera '{name}': frames lost by it: {sum(r.n for r in rows)}, first before its frame {rows[0].since}"
                for name, rows in clocks.lost.items()
                if rows
            ]
        elif chosen is not None and not doubt:
            notes += disagreement(chosen.source, chosen.starts, clocks.source, clocks.starts)
        elif chosen is None and (differs or clocks.is_against_numbers):
            notes.append(
                f"by the {clocks.source} ({clocks.text}) the offsets would be {listed}; they are not taken: {doubt}"
            )
    return chosen, notes


def listed_starts(starts: Mapping[str, float]) -> str:
    """List the starts of cameras as offsets: `front=12 left=0`."""
    return " ".join(f"{name}={start:.6g}" for name, start in starts.items())


def disagreement(one: str, starts: Mapping[str, float], other: str, others: Mapping[str, float]) -> list[str]:
    """Return a sentence if two ways to find the starts of cameras differ by a frame or more; both are named."""
    both = [name for name in starts if name in others]
    apart = np.array([starts[name] - others[name] for name in both])
    # A clock that counts frames shows each start to less than a frame.
    if len(both) < 2 or np.ptp(apart) < 1 - 1e-6:
        return []
    first = min(others[name] for name in both)
    return [
        f"the {one} and the {other} disagree by up to {np.ptp(apart):.1f} frames: offsets "
        f"{listed_starts({name: starts[name] for name in both})} by the {one}, "
        f"{listed_starts({name: others[name] - first for name in both})} by the {other}; look which is right"
    ]


def sound_disagreement(clocks: ClockStarts, files: Mapping[str, Path], fps: float) -> list[str]:
    """Return a sentence if the sound of the videos, where it is clear, contradicts their clocks or cannot be read."""
    settings = SoundSettings(max_s=120.0)  # nobody has asked for sound: it is to cost seconds
    try:
        sounds = {name: read_sound(path, name, settings) for name, path in files.items()}
    except RecordingError as error:
        return [str(error)]
    with_sound = {name: sound for name, sound in sounds.items() if sound is not None}
    first, *others = with_sound or [""]
    heard = {first: 0.0}
    for name in others:
        delay = sound_delay(with_sound[first], with_sound[name])
        if delay is not None and delay.is_clear:
            heard[name] = round(delay.delay_s * fps, 2)
    return disagreement(clocks.source, clocks.starts, "sound", heard)


def check_chapters(footage: Mapping[str, Footage]) -> list[str]:
    """Check that the files of each recording that is cut follow one another, and return sentences on them.

    A video whose next chapter lies beside it is noted too.

    Raises:
        RecordingError: files in one folder do not follow one another, or have no clock that shows it; or two cameras
            have files of one recording.
    """
    notes, camera_of = [], {f.path: name for name, f in footage.items()}
    for name, f in footage.items():
        if isinstance(f, ChapteredVideo) and len(f.chapters) > 1:
            sources = {_followed_by(one, other, name, f.path) for one, other in pairwise(f.chapters)}
            files = ", ".join(c.path.name for c in f.chapters)
            notes.append(f"camera '{name}': {files} follow one another by their {' and '.join(sorted(sources))}")
        following = next_chapter(f.path) if isinstance(f, VideoFile) else None
        gap = _gap(f, following) if isinstance(f, VideoFile) and following is not None else None
        if following is not None and (gap.is_none if gap is not None else following.stem[0] in "Gg"):
            if following in camera_of:
                raise RecordingError(
                    f"cameras '{name}' and '{camera_of[following]}' have chapters of one recording, {f.path.name} and "
                    f"{following.name}; give each camera its own recording"
                )
            notes.append(
                f"camera '{name}': {following.name} beside {f.path.name} is the next chapter of its recording and is "
                "not used; put the chapters alone into a folder, and give that as the footage"
            )
    return notes


class _Gap(NamedTuple):
    """The time between two files of a recording."""

    source: str
    """Clock by which it is known."""
    seconds: float
    is_none: bool
    """Whether it is none at the resolution of the clock."""


def _gap(one: Chapter, path: Path) -> _Gap | None:
    """Return the time from the end of a video to the start of another; None if no clock of both shows it."""
    starts, others = ({s.source: s for s in read_start_times(p, p.name)} for p in (one.path, path))
    for source in (TIME_CODE, GPS_TIME, CREATION_TIME):
        if source in starts and source in others:
            gap_s = _after(others[source], starts[source]) - one.n_frames / one.fps
            step_s = max(starts[source].step_s, others[source].step_s, 1 / one.fps)
            return _Gap(source, gap_s, abs(gap_s) <= (1 + AGREE) * step_s)
    return None


def _followed_by(one: Chapter, other: Chapter, camera: str, folder: Path) -> str:
    gap = _gap(one, other.path)
    if gap is not None and gap.is_none:
        return gap.source
    reason = "no clock in both that shows it"
    if gap is not None:
        apart = f"{float(f'{abs(gap.seconds):.3g}'):g} s {'after' if gap.seconds > 0 else 'before'}"
        reason = f"that {other.path.name} begins {apart} "
        reason += f"{one.path.name} ends by its {gap.source}"
    raise RecordingError(
        f"camera '{camera}': expected the videos in {folder} to follow one another, found {reason}; give one file, or "
        "join them without a gap"
    )


def find_name_starts(footage: Mapping[str, Footage]) -> ClockStarts | None:
    """Return the starts of folders of pictures by the times in their names; None where numbers or order pair them.

    Raises:
        RecordingError: the names do not show which pictures are of one instant.
    """
    folders = {name: f for name, f in footage.items() if isinstance(f, ImageFolder) and f.n_frames > 1}
    if len(folders) < 2:
        return None
    times = {name: np.array(f.named.times) for name, f in folders.items() if f.named.times is not None}
    if all(f.numbers is not None for f in folders.values()):
        for name, own in times.items():
            _check_numbers(name, folders[name], own)
        return _against_numbers(folders, times) if len(times) == len(footage) else None
    if len(times) < len(footage):
        if len({f.named.readings for f in folders.values()} | {f.numbers is None for f in folders.values()}) > 2:
            name, folder = next((n, f) for n, f in folders.items() if f.numbers is None)
            raise RecordingError(
                f"camera '{name}': expected names of pictures in {folder.path} with one number that rises by one: "
                f"{folder.named.reason}",
                Remedy("pair_images"),
            )
        return None
    if len({f.n_frames for f in folders.values()}) == 1:
        apart = np.ptp(np.stack([*times.values()]), axis=0)
        if apart.max() < AGREE * np.diff(next(iter(times.values()))).min():
            return None  # pictures of one instant have one place in the order
    return _paired_by_time(folders, times)


def _steps(times: Array, interval: float) -> IntArray | None:
    """Return the number of frames from each picture to the next; None if times are too uneven to show it."""
    if interval <= 0:  # times of whole seconds
        return None
    steps = np.maximum(np.round(np.diff(times) / interval), 0).astype(np.int64)
    n = np.concatenate([[0], np.cumsum(steps)])
    if not steps.all() or n[-1] > 2 * len(times):
        return None
    slope, first = np.polyfit(n, times - times[0], 1) if len(n) > 2 else (interval, 0.0)
    return steps if np.abs(times - times[0] - first - slope * n).max() <= AGREE * interval else None


def _check_numbers(name: str, folder: ImageFolder, times: Array) -> None:
    """Check that no picture is missing by the times in names whose numbers rise by one.

    Raises:
        RecordingError: one is.
    """
    steps = _steps(times, float(np.median(np.diff(times))))
    numbers = np.array(folder.numbers)
    if steps is not None and (gaps := np.flatnonzero((steps > 1) & (np.diff(numbers) == np.diff(numbers).min()))).size:
        before, after = folder.files[gaps[0]].name, folder.files[gaps[0] + 1].name
        raise RecordingError(
            f"camera '{name}': by their numbers {before} and {after} follow one another, by their times "
            f"{steps[gaps[0]] - 1} pictures are missing between them",
            Remedy("pair_images"),
        )


def _against_numbers(folders: Mapping[str, ImageFolder], times: Mapping[str, Array]) -> ClockStarts | None:
    """Return the starts by times where numbers have none in common, else in doubt where they contradict the numbers.

    None where times have no common span, or confirm the numbers.
    """
    try:
        clocks = _paired_by_time(folders, times)
    except RecordingError:
        return None
    numbers = {name: np.array(f.numbers) for name, f in folders.items()}
    if not reduce(np.intersect1d, numbers.values()).size:  # each camera counts from a beginning of its own
        return clocks._replace(is_against_numbers=True)
    begin = max(own[0] for own in numbers.values())
    starts = {name: float((begin - own[0]) / np.diff(own).min()) for name, own in numbers.items()}
    contradicts = disagreement("numbers", starts, clocks.source, clocks.starts)
    doubt = "the numbers in the names pair frames"
    return clocks._replace(doubt=doubt, is_against_numbers=True) if contradicts else None


def _paired_by_time(folders: Mapping[str, ImageFolder], times: Mapping[str, Array]) -> ClockStarts:
    interval = float(np.median(np.concatenate([np.diff(own) for own in times.values()])))
    steps = {name: _steps(own, interval) for name, own in times.items()}
    latest = max(times.values(), key=lambda own: float(own[0]))
    nearest = {n: np.minimum(np.searchsorted(t, latest - interval / 2), len(t) - 1) for n, t in times.items()}
    apart = np.stack([np.abs(own[nearest[name]] - latest) for name, own in times.items()])
    common = np.flatnonzero(apart.max(axis=0) < interval / 2)  # pictures near which no camera lost one
    starts, lost = {}, {}
    for name, own in times.items():
        own_steps = steps[name]
        if own_steps is None or not len(common):
            reason = "too uneven to show" if own_steps is None else "without a common span, which would show"
            raise RecordingError(
                f"camera '{name}': the times in the names of {folders[name].path} are {reason} which pictures are of "
                "one instant",
                Remedy("pair_images"),
            )
        first, begin = int(nearest[name][common[0]]), latest[common[0]]
        starts[name] = round(first - (own[first] - begin) / interval, 3)
        lost[name] = [
            LostFrames(int(k) + 1, int(own_steps[k]) - 1) for k in np.flatnonzero(own_steps > 1) if k >= first
        ]
    text = ", ".join(f"'{name}' from {folders[name].files[0].name} on" for name in folders)
    return ClockStarts("time in the names of the pictures", starts, "", text, lost)
