"""Masks of other programs in the folder of a session, in the form in which footage has masks.

    observations/NAME/
      masks.toml           format, cameras, notes, the files that were imported, with their checksums
      masks/CAM/000012.png by picture of the footage: 0 background, 255 anyone, k person k

The folder appears complete or not at all. session.toml names the masks that its cameras use.
"""

import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.errors import TrackerError
from tracker.interchange.observations import stored
from tracker.session.session import Session, save_camera_files
from tracker.validation import FileStem

if TYPE_CHECKING:  # it decodes videos
    from tracker.interchange.observations.plans import MaskPlan

MASKS_FILE, _MASKS = "masks.toml", "masks"


class StoredMasks(stored.Description, forbid_unknown_fields=True, kw_only=True):
    """Masks that were imported."""

    cameras: dict[FileStem, int]
    """Number of masks by camera."""


def masks_folder(session: Session, name: str) -> Path:
    """Return the folder of imported masks, which has a folder for each camera."""
    return session.folder / stored.FOLDER / name / _MASKS


def describe_masks(session: Session, name: str, format_name: str, options: Mapping[str, str]) -> None:
    """Describe masks that lie in the folder of a name, so that it counts as that of stored masks.

    Args:
        session: the session, which this process has locked.
        name: of the masks.
        format_name: names their source.
        options: names and values of the choices by which they were made.

    Raises:
        SessionError: the description cannot be written.
    """
    folder = masks_folder(session, name)
    cameras = {name: len(list((folder / name).glob("*.png"))) for name in session.camera_names}
    content = StoredMasks(name=name, format=format_name, cameras=cameras, options=dict(options))
    stored.write_description(folder.parent / MASKS_FILE, f"masks {name}", content)


def list_masks(session: Session) -> list[str]:
    """Return the names of the masks that were imported into a session, in order."""
    return stored.list_observations(session, MASKS_FILE)


def load_masks(session: Session, name: str) -> StoredMasks:
    """Read what masks were imported under a name.

    Raises:
        SessionError: the file is missing, damaged or newer.
    """
    path = session.folder / stored.FOLDER / name / MASKS_FILE
    return stored.read_description(path, f"masks {path}", StoredMasks)


def mask_users(session: Session, name: str) -> tuple[str, ...]:
    """Return the cameras of a session that use the masks of a name."""
    folder = masks_folder(session, name)
    return tuple(c.camera.name for c in session.cameras if c.masks is not None and c.masks.parent == folder)


def store_masks(session: Session, plan: "MaskPlan") -> Session:
    """Store masks with a session, whose cameras then use them.

    Returns:
        The session with these cameras.

    Raises:
        TrackerError: the first of the plan's problems, or a file changed since it was read.
        SessionError: there are observations of this name, or the folder cannot be written.
    """
    if plan.problems:
        raise plan.problems[0]
    with stored.appearing_folder(session, plan.name) as temporary:
        for source in plan.sources:
            stored.read_unchanged(plan.files[source.path], source)
        sizes = {c.camera.name: c.camera.size for c in session.cameras}
        for camera in plan.masks:
            _write_masks(plan, camera, sizes[camera], temporary / _MASKS / camera)
        content = StoredMasks(
            name=plan.name,
            format=plan.format,
            cameras={name: int((own >= 0).sum()) for name, own in plan.pictures.items()},
            notes=plan.notes,
            options=dict(plan.options),
            sources=plan.sources,
        )
        stored.write_description(temporary / MASKS_FILE, f"masks {plan.name}", content)
    folder = masks_folder(session, plan.name)
    try:
        return save_camera_files(
            session,
            [replace(c, masks=folder / c.camera.name) if c.camera.name in plan.masks else c for c in session.cameras],
        )
    except TrackerError:
        shutil.rmtree(folder.parent, ignore_errors=True)
        raise


def _write_masks(plan: "MaskPlan", camera: str, size: tuple[int, int], folder: Path) -> None:
    folder.mkdir(parents=True)
    for i, picture in enumerate(plan.pictures[camera].tolist()):
        if picture >= 0:
            write_mask(folder, picture, plan.mask(camera, i, size))


def write_mask(folder: Path, picture: int, mask: NDArray[np.uint8]) -> None:
    """Write the mask of a picture of footage, (H, W), where `tracker.footage.recording.read_mask` reads it."""
    (folder / f"{picture:06d}.png").write_bytes(cv2.imencode(".png", mask)[1].tobytes())
