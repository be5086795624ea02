"""Parse lists of frames."""

from collections.abc import Sequence

from tracker.errors import TrackerError


def parse_frame_list(text: str, n_frames: int, name: str) -> Sequence[int]:
    """Parse `A:B`, half open, with either end optional, or a list such as `3,7,12`.

    Args:
        text: what a user gave.
        n_frames: number of frames of the session.
        name: of the option, for messages.

    Returns:
        The frames, ascending; a range for `A:B`.

    Raises:
        TrackerError: it is neither, or a frame is not of the session.
    """
    frames: Sequence[int] = ()
    words = text.split(",")
    first, colon, last = text.partition(":")
    if colon and _is_whole(first or "0") and _is_whole(last or "0"):
        frames = range(int(first or 0), int(last or n_frames))
    elif all(map(_is_whole, words)):
        frames = sorted({int(word) for word in words})
    if frames and frames[-1] < n_frames:
        return frames
    raise TrackerError(
        f"expected {name} as A:B within 0:{n_frames} (A included, B not), or as a list such as 0,{n_frames - 1}, found "
        f"'{text[:40]}'"
    )


def parse_frames_and_ranges(text: str, n_frames: int, name: str) -> list[int]:
    """Parse frames and half-open ranges, such as `0,40,100:110`; returns the frames, ascending.

    Args:
        text: what a user gave.
        n_frames: number of frames of the session.
        name: of the option, for messages.

    Raises:
        TrackerError: they are none of the session.
    """
    found = set[int]()
    for word in text.split(","):
        first, colon, last = word.partition(":")
        is_number = _is_whole(first) and (not colon or _is_whole(last))
        frames = range(int(first), int(last) if colon else int(first) + 1) if is_number else range(0)
        if not frames or frames.stop > n_frames:
            raise TrackerError(
                f"expected {name} such as 0,40,100:110 within 0:{n_frames}, found '{word[:40]}'; correct it"
            )
        found |= set(frames)
    return sorted(found)


def _is_whole(word: str) -> bool:
    return word.strip().isascii() and word.strip().isdigit() and len(word) < 10
