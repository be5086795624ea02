"""Calibrate cameras by footage of a board that a user has described in the page."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
from msgspec import Meta

from app.remedies import page_sentence, page_text
from app.session.calibration_record import board_record, check_out, error_words, write_cameras
from app.session.new_session import MAX_CAMERAS, Report
from app.session.path_choice import TypedPath, typed_path
from tracker.errors import TrackerError
from tracker.session.footage_files import footage_in
from tracker.session.matching import camera_name
from tracker.validation import Name

if TYPE_CHECKING:
    from tracker.calibration.boards.footage_calibration import FilmedBoard, FilmedCalibration


class BoardForm(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Footage of a board, and the board, as a user types them."""

    footage: TypedPath
    """Folder with a video or a folder of images for each camera."""
    board: TypedPath | dict[str, bool | int | float | str]
    """File of the board, or its description as in such a file."""
    out: TypedPath
    """File to write."""
    fisheye: Annotated[list[Name], Meta(max_length=MAX_CAMERAS)] = []
    """Names of the cameras with fisheye lenses."""
    offsets: Annotated[dict[Name, int], Meta(max_length=MAX_CAMERAS)] = {}
    """Frame k of all is frame k + offset of a camera."""
    common_frames: bool = False
    """Whether frames at the end that some cameras lack are left out."""
    floor_frame: int | None = None
    """Frame on which the board lies on the floor; null for the world of the first camera, with y down."""


def calibrate_cameras(form: BoardForm, report: Report) -> None:
    """Calibrate cameras and write the calibration. Nothing is written before the end, and no file is replaced.

    Args:
        form: footage and board.
        report: called with `progress`, the share that is done and a text; at the end with `failed` and a sentence, or
            `calibrated` and the result. It may raise to end the work.
    """
    from app.runtime.progress import time_left_text
    from tracker.calibration.boards.footage_calibration import calibrate_footage

    began = time.monotonic()

    def advance(stage: str, share: float, text: str = "", /) -> None:
        left = time_left_text(share, time.monotonic() - began)
        report("progress", {"share": share, "text": f"{stage.capitalize()}: {100 * share:.0f}%{left}"})

    try:
        out = typed_path(form.out)
        filmed = _filmed(form)
        check_out(out)
        found = calibrate_footage(filmed, advance)
        check_out(out)
        write_cameras(out, found.cameras)
    except TrackerError as error:
        report("failed", page_text(error))
        return
    report("calibrated", _shown(out, filmed, found))


def _filmed(form: BoardForm) -> "FilmedBoard":
    from tracker.calibration.boards.board_description import described_board, read_board
    from tracker.calibration.boards.footage_calibration import FilmedBoard

    board = read_board(typed_path(form.board)) if isinstance(form.board, str) else described_board(form.board)
    return FilmedBoard(
        board,
        footage_in(typed_path(form.footage)),
        fisheye=form.fisheye,
        offsets=form.offsets,
        common_frames=form.common_frames,
        floor_frame=form.floor_frame,
    )


def _shown(out: Path, filmed: "FilmedBoard", found: "FilmedCalibration") -> dict[str, Any]:
    """Return a result as the page shows it; corners are flat lists of whole original pixels, x and y in turn."""
    record, seen, is_gross = board_record(found), found.views.seen, found.is_gross
    paths = {camera_name(path): str(path) for path in filmed.videos}

    def corners(chosen: Any) -> list[int]:
        return seen.px[chosen].round().astype(int).ravel().tolist()

    cameras = [
        {
            **{key: camera[key] for key in ("name", "size", "views", "covered_share", "held_out_px")},
            "footage": paths[camera["name"]],
            "corners": corners((seen.cameras == i) & ~is_gross),
            "gross": corners((seen.cameras == i) & is_gross),
        }
        for i, camera in enumerate(record["cameras"])
    ]
    return {
        "out": str(out),
        "up": "-y" if filmed.floor_frame is None else "z",
        "sentence": page_sentence(error_words(record)),
        "doubts": [page_sentence(note) for note in record["notes"]],
        "cameras": cameras,
    }
