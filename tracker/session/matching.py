"""Match loose footage to calibrated cameras, and check that the footage of all cameras fits together."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path

from tracker.errors import RecordingError, Remedy, SessionError
from tracker.files import paths_in
from tracker.footage.frame_rates import same_rate, usual_rate
from tracker.footage.image_folder import ImageFolder, missing_numbers
from tracker.footage.video import Footage
from tracker.validation import FrameRate, check, nfc_name

_NOTED_JITTER = 0.04
"""Share of the interval between frames from which jitter is reported. Ticks of a millisecond, as of Matroska, shift
stamps by up to 3% at 30 frames per second."""


def match_footage(
    names: Sequence[str], videos: Sequence[Path], camera_paths: Mapping[str, Path], unused: Collection[str] = ()
) -> dict[str, Path]:
    """Find the footage of each camera: by the option, else by the name of the file or folder.

    Args:
        names: the cameras of the session.
        videos: files and folders, each named after its camera.
        camera_paths: footage by camera name.
        unused: calibrated cameras that the session leaves out; their footage in `videos` is left out too.

    Raises:
        SessionError: footage without a camera or for two, or a camera without footage or with two.
    """
    check_names(camera_paths, names, "camera", "the footage by camera")
    paths = dict(camera_paths)
    for video in videos:
        name = camera_name(video)
        if name in camera_paths or video in camera_paths.values() or name in unused:
            continue
        if name not in names:
            raise SessionError(
                f"video {video} belongs to no calibrated camera: expected one named {', '.join([*names, *unused])}",
                Remedy("name_footage", video=video),
            )
        if name in paths:
            raise SessionError(f"camera '{name}' has two videos, {paths[name]} and {video}; leave one out")
        paths[name] = video
    missing = [n for n in names if n not in paths]
    if missing:
        raise SessionError(f"no video for camera {', '.join(missing)}", Remedy("give_footage", camera=missing[0]))
    return paths


def shared_footage(paths: Mapping[str, Path]) -> list[str]:
    """Return a sentence for each camera that has the footage of another one, by the paths of all."""
    first: dict[Path, str] = {}
    pairs = [(first.setdefault(path.resolve(), name), name) for name, path in paths.items()]
    return [
        f"Cameras '{other}' and '{name}' have one video: check that each has its own."
        for other, name in pairs
        if other != name
    ]


def camera_name(video: Path) -> str:
    """Return the camera after which a video file or an image folder is named."""
    return nfc_name(video.name if video.is_dir() else video.stem)


def find_entry(folder: Path, name: str) -> Path:
    """Return the path of a file or folder by its name, in whichever Unicode form the system stores it."""
    path = folder / name
    if not path.exists() and folder.is_dir():
        wanted = nfc_name(name)
        return next(iter(paths_in(folder, SessionError, lambda entry: nfc_name(entry) == wanted)), path)
    return path


def common_rate(footage: Mapping[str, Footage], fps: float | None) -> float:
    """Return the frame rate of all cameras, 1/s.

    Args:
        footage: of each camera by name.
        fps: rate that overrides what the videos declare, as for high-speed footage; None for none.

    Raises:
        RecordingError: a rate varies, or the rates differ, or none is known.
    """
    rates = {name: f.fps for name, f in footage.items() if f.fps is not None}
    for name, f in footage.items():
        if fps is None and not f.has_constant_rate:
            assert f.stamps is not None
            raise RecordingError(
                f"camera '{name}': {f.path} has a variable frame rate, expected a constant one: {_irregularity(f)}",
                Remedy("give_constant_rate", fps=f"{usual_rate(f.stamps.usual_rate):g}"),
            )
    wanted = fps if fps is not None else next(iter(rates.values()), None)
    if wanted is None:
        raise RecordingError("folders of images have no frame rate", Remedy("give_rate"))
    check(wanted, FrameRate, "the given rate" if fps is not None else "footage", RecordingError)
    if fps is None and any(not same_rate(rate, wanted) for rate in rates.values()):
        listed = ", ".join(f"'{name}' {rate:.6g}" for name, rate in rates.items())
        shaky = [f"'{name}': {_irregularity(f)}" for name, f in footage.items() if _jitter(f) > _NOTED_JITTER]
        raise RecordingError(
            f"expected one frame rate for all cameras, found {listed}{''.join(f' ({s})' for s in shaky)}",
            Remedy("give_common_rate", fps=f"{usual_rate(wanted):g}"),
        )
    return wanted


def _jitter(footage: Footage) -> float:
    return 0.0 if footage.stamps is None else footage.stamps.jitter


def _irregularity(footage: Footage) -> str:
    """Say how far the time stamps of a video are from even ones."""
    assert footage.stamps is not None
    jitter, n_gaps = footage.stamps.jitter, footage.stamps.n_gaps
    text = f"its time stamps lie up to {100 * jitter:.0f}% of a frame from even ones"
    return text + (f", with {n_gaps} gaps in which frames may be missing" if n_gaps else "")


def footage_notes(footage: Mapping[str, Footage], fps: float, offsets: Mapping[str, int]) -> list[str]:
    """Return sentences on what a person should know: a lone camera, jitter, late starts, mirrored pictures.

    Args:
        footage: of each camera by name.
        fps: frame rate of the session, 1/s.
        offsets: shifts by camera name; with any, starts are not compared.
    """
    notes = []
    if len(footage) == 1:
        notes.append(
            "one camera shows no depth: bodies can be placed by hand or from known joints, exported and evaluated; "
            "people are found by two cameras or more, and tracked poses will be lost"
        )
    for name, f in footage.items():
        if _jitter(f) > _NOTED_JITTER:
            notes.append(f"camera '{name}': {_irregularity(f)}; its frames are taken as they are, {fps:g} per second")
        if f.is_mirrored:
            notes.append(
                f"camera '{name}': the video's display matrix mirrors the picture, which is applied, as players do; "
                "the calibration must be of mirrored pictures too"
            )
    starts = {name: f.stamps.start_s for name, f in footage.items() if f.stamps is not None}
    first = min(starts.values(), default=0.0)
    late = {name: round((start - first) * fps) for name, start in starts.items()}
    if len(starts) == len(footage) and any(n > 1 for n in late.values()) and not offsets:
        listed = ", ".join(f"'{name}' {starts[name] - first:.3g} s ({n} frames)" for name, n in late.items() if n > 1)
        last = max(late.values())
        needed = " ".join(f"{name}={last - n}" for name, n in late.items() if last > n)
        notes.append(
            f"by their time stamps, some cameras start later than others: {listed}. Frames are paired by their number; "
            f"to pair them by their stamps, make the session with the offsets {needed}"
        )
    return notes


def common_length(footage: Mapping[str, Footage], offsets: Mapping[str, int], shorten: bool = False) -> int:
    """Return the number of frames that all cameras have.

    Args:
        footage: of each camera by name.
        offsets: shifts by camera name.
        shorten: leave out frames at the end that some cameras lack; otherwise lengths may differ by the offsets alone.

    Raises:
        RecordingError: the lengths differ otherwise, or nothing is left.
    """
    rest = {name: f.n_frames - offsets.get(name, 0) for name, f in footage.items()}
    for name, n in rest.items():
        if n < 1:
            raise RecordingError(
                f"camera '{name}': expected an offset below its {footage[name].n_frames} frames, found "
                f"{offsets[name]}; check the footage and the offsets"
            )
    if not shorten and len({f.n_frames for f in footage.values()}) > 1 and len(set(rest.values())) > 1:
        listed = ", ".join(f"'{name}' {f.n_frames}" for name, f in footage.items())
        raise RecordingError(
            f"expected videos of the same number of frames, found {listed}",
            Remedy("give_frame_offset", n=min(rest.values())),
        )
    return min(rest.values())


def common_offsets(footage: Mapping[str, Footage], offsets: Mapping[str, int]) -> dict[str, int]:
    """Return the offsets at which numbered image folders begin with the first number that all have.

    Given offsets, and those of other footage, stay.
    """
    firsts = {name: f.numbers[0] for name, f in footage.items() if isinstance(f, ImageFolder) and f.numbers is not None}
    if offsets or len(firsts) < len(footage):
        return dict(offsets)
    begin = max(firsts.values())
    matched = {}
    for name, f in footage.items():
        assert isinstance(f, ImageFolder)
        assert f.numbers is not None
        matched[name] = sum(n < begin for n in f.numbers)
    return {name: n for name, n in matched.items() if n}


def check_image_numbers(footage: Mapping[str, Footage], offsets: Mapping[str, int], shorten: bool = False) -> None:
    """Check that images with equal numbers are frames of the same instant, if the folders are numbered.

    Args:
        footage: of each camera by name.
        offsets: shifts by camera name, set by the user; they replace the comparison between cameras.
        shorten: whether numbers at the ends may be missing in some folders; see `common_offsets`.

    Raises:
        RecordingError: a number is missing in a folder, or in the folder of one camera only.
    """
    numbered = {
        name: (f.path, f.numbers) for name, f in footage.items() if isinstance(f, ImageFolder) and f.numbers is not None
    }
    for name, (path, numbers) in numbered.items():
        if gaps := missing_numbers(numbers):
            raise RecordingError(
                f"camera '{name}': {path} has no image with number {_listed(gaps)}, expected every number from "
                f"{numbers[0]} to {numbers[-1]}; restore it, or put a copy of its neighbour there"
            )
    if offsets or shorten or len(numbered) < 2:
        return
    every = set().union(*(numbers for _, numbers in numbered.values()))
    for name, (path, numbers) in numbered.items():
        if gaps := sorted(every.difference(numbers)):
            raise RecordingError(
                f"camera '{name}': {path} has no image with number {_listed(gaps)}, which other cameras have: images "
                "of one instant need equal numbers",
                Remedy("give_image_offset"),
            )


def check_names(given: Iterable[str], known: Sequence[str], what: str, among: str) -> list[str]:
    """Check that given names are known; `what` and `among` are for the message, such as "camera" and "the offsets".

    Raises:
        SessionError: one is not; the message lists those that are.
    """
    given, compared = list(given), {nfc_name(name): name for name in known}
    unknown = [n for n in given if nfc_name(n) not in compared]
    if unknown:
        raise SessionError(f"unknown {what} '{unknown[0]}' among {among}; expected one of {', '.join(known)}")
    return [compared[nfc_name(n)] for n in given]


def _listed(numbers: Sequence[int]) -> str:
    """List the first few numbers."""
    return ", ".join(map(str, numbers[:4])) + (", ..." if len(numbers) > 4 else "")
