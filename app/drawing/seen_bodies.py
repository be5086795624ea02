"""The people of a state as the cameras see them, each picture at its own time."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from app.state.state import State
from tracker.body.model import PosedBody
from tracker.geometry.arrays import Array
from tracker.session.session import Session


def bodies_in(session: Session, state: State, poses: Sequence[Array] | None = None) -> list[PosedBody]:
    """Return all people with their velocities on the shown frame, in the shown poses or in others, (n_values,) each."""
    shown = state.poses if poses is None else poses
    pairs = zip(session.people, shown, strict=True)
    return [PosedBody(person.model, pose, state.velocity(i)) for i, (person, pose) in enumerate(pairs)]


def picture_times(session: Session, frame: int, cameras: Iterable[int]) -> dict[int, float]:
    """Return by how many frames the pictures of some cameras, by index, were taken later than a frame."""
    return {index: session.cameras[index].clock.offset_frames(frame) for index in sorted(cameras)}


def at_one_time(times: Mapping[int, float]) -> Iterator[tuple[float, list[int]]]:
    """Yield each time with the cameras whose pictures were taken then."""
    for time in dict.fromkeys(times.values()):
        yield time, [index for index, other in times.items() if other == time]
