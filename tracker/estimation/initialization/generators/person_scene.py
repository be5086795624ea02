"""One person on a frame before any pose is known, and the axes of the person's silhouettes."""

from collections.abc import Sequence
from typing import NamedTuple

from tracker.errors import Remedy, TrackerError
from tracker.estimation.initialization.generators.body_axis import MajorAxis, major_axis
from tracker.evidence.silhouettes import ViewSilhouette
from tracker.evidence.voxels.figure_masks import FigureMask
from tracker.evidence.voxels.voxel_grid import Voxels
from tracker.geometry.arrays import Array, Mask
from tracker.geometry.cameras import Camera
from tracker.geometry.ground_plane import GroundPlane


class PersonScene(NamedTuple):
    """One person on a frame before any pose is known."""

    figure: Voxels
    """Voxels of the person."""
    silhouettes: Sequence[ViewSilhouette]
    """Of all views."""
    masks: Sequence[FigureMask]
    """Silhouettes of the person, of all views."""
    floor: GroundPlane
    """The floor."""

    @property
    def up(self) -> Array:
        """Vertical axis of the world, (3,)."""
        return self.floor.normal

    @property
    def clear_views(self) -> list[tuple[Mask, Camera]]:
        """Masks and cameras of the views that show the person alone; of all views if fewer than two do."""
        pairs = list(zip(self.masks, self.silhouettes, strict=True))
        alone = [(m.mask, s.camera) for m, s in pairs if m.shows_figure_alone]
        return alone if len(alone) >= 2 else [(m.mask, s.camera) for m, s in pairs]


def silhouette_axes(scene: PersonScene) -> list[MajorAxis]:
    """Return the major axes of a person's silhouettes in the views that show the person alone.

    Raises:
        TrackerError: fewer than two views show the person.
    """
    axes = [a for mask, camera in scene.clear_views if (a := major_axis(mask, camera)) is not None]
    if len(axes) < 2:
        raise TrackerError(
            f"expected the person in at least 2 views, found {len(axes)}", Remedy("another_frame_or_background")
        )
    return axes
