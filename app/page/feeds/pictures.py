"""Pictures that a page shows and has not received yet, as sets that it shows together."""

import asyncio
import itertools

from app.control.controller import Controller
from app.drawing import overlays, pictures
from app.drawing.seen_bodies import bodies_in
from app.messages.base import encode_binary
from app.messages.binary_headers import ImageHeader
from app.state.identity import ObjectIdentity
from app.state.page_view import EVIDENCE, PictureLayer, View
from app.state.state import State

Key = tuple[PictureLayer, int]
"""Layer and camera."""


class PictureSets:
    """Remembers which pictures one page has received."""

    def __init__(self, controller: Controller) -> None:
        """Begin with nothing sent."""
        self._controller = controller
        self._sent: dict[Key, tuple[object, ...]] = {}
        self._numbers = itertools.count(1)

    async def missing(self, state: State, view: View) -> list[bytes]:
        """Make the pictures that the page lacks, and count them as sent.

        Pictures of evidence are included once the evidence is cached, so that footage does not wait for it. Returns
        nothing if the frame is not listed yet, or if the page has moved to another frame meanwhile. While a tracker
        runs the page always has, and gets the pictures all the same.
        """
        wanted = _wanted(state, view)
        if wanted == self._sent:
            return []
        wanted = self._available(wanted, state)
        missing = [key for key, content in wanted.items() if self._sent.get(key) != content]
        self._sent = wanted
        made = await asyncio.gather(*(self._made(key, state, view) for key in missing))
        now = self._controller.state
        if now.frame != state.frame and not now.track.running:
            self._sent = {}
            return []
        number = next(self._numbers)
        return [
            encode_binary(ImageHeader(layer, camera, state.frame, number, len(missing), limit_px), data)
            for (layer, camera), (data, limit_px) in zip(missing, made, strict=True)
        ]

    def _available(self, wanted: dict[Key, tuple[object, ...]], state: State) -> dict[Key, tuple[object, ...]]:
        """Select the pictures that can be made now or have been sent.

        While a tracker runs, evidence is computed for every shown frame: it would never be cached in time.
        """
        if not self._controller.frames.listed(state.frame):
            return {k: c for k, c in wanted.items() if self._sent.get(k) == c}
        if state.track.running or self._controller.frames.cached_evidence(state.frame) is not None:
            return wanted
        return {k: c for k, c in wanted.items() if k[0] not in EVIDENCE or self._sent.get(k) == c}

    async def _made(self, key: Key, state: State, view: View) -> tuple[bytes, float | None]:
        """Make a picture in a worker, unless it is cached: in playback, handing it over takes longer than that."""
        layer, camera = key
        cached = None
        if layer == "image":
            cached = self._controller.frames.cached_image(state.frame, camera, view.reductions[camera])
        return (cached, None) if cached is not None else await asyncio.to_thread(self._make, key, state, view)

    def _make(self, key: Key, state: State, view: View) -> tuple[bytes, float | None]:
        """Make a picture. Also return the distance that the darkest colour of a distance image stands for, px."""
        layer, camera = key
        reduction, session, frames = (
            view.reductions[camera],
            self._controller.session_of(state),
            self._controller.frames,
        )
        if layer == "image":
            return frames.image(state.frame, camera, reduction), None
        if layer == "parts":
            shown = [i for i in range(len(session.people)) if i not in state.people_not_drawn]
            time, everybody = session.cameras[camera].clock.offset_frames(state.frame), bodies_in(session, state.drawn)
            bodies = [everybody[i].ahead(time) for i in shown]
            colors = overlays.part_colors([session.people[i] for i in shown])
            return pictures.parts(bodies, session.cameras[camera].camera.pinhole, colors, reduction), None
        evidence = frames.evidence(state.frame)[camera]
        if layer == "silhouette":
            return pictures.silhouette(evidence), None
        return pictures.distance(evidence), pictures.distance_limit_px(evidence)


def _wanted(state: State, view: View) -> dict[Key, tuple[object, ...]]:
    """Return what each picture that the page shows depends on."""
    wanted: dict[Key, tuple[object, ...]] = {}
    for layer in view.pictures:
        for camera in sorted(view.cameras):
            # Evidence has the scale of matching, whatever the size of the pane.
            content = () if layer in EVIDENCE else (view.reductions[camera],)
            poses = (
                (state.revisions, state.people_not_drawn, *map(ObjectIdentity, state.drawn.poses))
                if layer == "parts"
                else ()
            )
            wanted[layer, camera] = (
                state.frame,
                state.footage.recoveries,
                state.calibration.n_changes,
                *content,
                *poses,
            )
    return wanted
