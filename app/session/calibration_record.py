"""The record of a calibration by a board, for the command line and the page, and the file that is written."""

import os
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import TYPE_CHECKING, Any

import numpy as np

from tracker.errors import Remedy, TrackerError
from tracker.formats.anipose import write_calibration
from tracker.formats.calibrations.writing import write_layout
from tracker.geometry.cameras import Camera

if TYPE_CHECKING:
    from tracker.calibration.boards.expected_error import VolumeAccuracy
    from tracker.calibration.boards.footage_calibration import FilmedCalibration
    from tracker.calibration.check.held_out import HeldOut
    from tracker.calibration.check.rig_adjustment import RigFit


def check_out(out: Path, overwrite: bool = False) -> None:
    """Check that a calibration can be written to a file.

    Args:
        out: the file.
        overwrite: whether a file that exists is replaced.

    Raises:
        TrackerError: there is something already, or no folder for it that may be written to.
    """
    if os.path.isdir(out):
        raise TrackerError(f"expected {out} not to exist, found a folder", Remedy("another_file"))
    if os.path.exists(out) and not overwrite:
        raise TrackerError(f"expected {out} not to exist, found a file", Remedy("another_file_or_overwrite"))
    if not os.path.isdir(out.parent):
        raise TrackerError(f"expected {out} in a folder that exists, found none; make it first")
    with _writing(out):
        NamedTemporaryFile(prefix=f".{out.name}.", dir=out.parent).close()


def write_cameras(out: Path, cameras: Sequence[Camera], layout: str = "quadrille") -> None:
    """Write a calibration in one of the layouts that `quadrille calibrate` offers.

    Raises:
        TrackerError: the file cannot be written.
    """
    with _writing(out):
        if layout == "quadrille":
            write_calibration(out, cameras)
        else:
            write_layout(out, layout, cameras)


@contextmanager
def _writing(out: Path) -> Generator[None, None, None]:
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise TrackerError(f"cannot write {out}: {reason}; choose a folder that you may write to") from error


def board_record(calibrated: "FilmedCalibration") -> dict[str, Any]:
    """Return the result as plain data; docs/log/calibration.md lists its keys."""
    views, board, rig = calibrated.views, calibrated.found, calibrated.found.rig
    cameras = [
        {
            "depth_ratio": lens.depth_ratio,
            "views": np.unique(views.seen.frames[views.seen.cameras == i]).size,
            "noise_px": float(rig.fit.sigmas_px[i]),
            "covered_share": calibrated.covered_share(i),
        }
        for i, lens in enumerate(board.lenses)
    ]
    return {
        "frames": views.n_frames,
        "views": views.n_views,
        "views_from_behind": views.n_from_behind,
        "corners": len(views.seen.px),
        "adjusted_frames": len(rig.frames),
        "held_out_frames": board.held_out.frames.tolist(),
        "notes": list(board.notes),
        **shared_record(cameras, rig.fit, board.held_out, rig.volume, rig.points_world),
    }


def error_words(record: dict[str, Any]) -> str:
    """Return the expected error of a calibration by a board, in words."""
    size, (low, high) = " x ".join(f"{side:.1f}" for side in record["volume_m"]), record["interval_mm"]
    return (
        f"expected error in the volume of the board ({size} m): {record['expected_error_mm']:.2f} mm, with 90% between "
        f"{low:.2f} and {high:.2f} mm"
    )


def shared_record(
    rows: Sequence[dict[str, Any]], fit: "RigFit", held_out: "HeldOut", volume: "VolumeAccuracy",
    points_world: np.ndarray,
) -> dict[str, Any]:  # fmt: skip
    """Return the entries that calibrations by boards and by people share.

    Args:
        rows: further entries of each camera.
        fit: of all cameras.
        held_out: errors on frames held out.
        volume: error in the volume.
        points_world: points in it, (P, 3), metres.
    """
    return {
        "cameras": [
            {
                "name": c.name,
                "size": list(c.size),
                "focal_px": [float(c.K[0, 0]), float(c.K[1, 1])],
                "focal_sigma_percent": 100 * float(sigma),
                **row,
                "held_out_px": held_out.rms_px(i),
            }
            for i, (c, row, sigma) in enumerate(zip(fit.rig.cameras, rows, fit.focal_sigmas, strict=True))
        ],
        "held_out_px": held_out.rms_px(),
        "held_out_median_px": float(np.median(held_out.px)) if len(held_out.px) else None,
        "volume_m": np.ptp(points_world, axis=0).tolist(),
        "expected_error_mm": 1000 * volume.expected_m,
        "interval_mm": [1000 * volume.low_m, 1000 * volume.high_m],
    }
