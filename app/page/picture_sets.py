"""The pictures that a page shows and does not have yet, as sets that it puts on the screen at once."""

import asyncio
import itertools

from app.control.controller import Controller
from app.drawing import overlays, pictures
from app.page import messages
from app.state.page_view import EVIDENCE, Picture, View
from app.state.state import State
from tracker.body.model import PosedBody

Key = tuple[Picture, int]
"""Layer and camera."""


class PictureSets:
    """What one page has been sent."""

    def __init__(self, controller: Controller) -> None:
        """Begin with nothing."""
        self._controller = controller
        self._sent: dict[Key, tuple[object, ...]] = {}
        self._numbers = itertools.count(1)

    async def missing(self, state: State, view: View) -> list[bytes]:
        """Make the pictures that the page lacks; they count as sent.

        Pictures of evidence are among them when it is at hand: those of the footage do not wait for it. None where the
        page is on another frame by the time that they are made (a tracker always is, and is to be watched), or the
        frame is not listed yet.
        """
        wanted = self._at_hand(_wanted(state, view), state)
        missing = [key for key, content in wanted.items() if self._sent.get(key) != content]
        self._sent = wanted
        made = await asyncio.gather(*(asyncio.to_thread(self._make, key, state, view) for key in missing))
        now = self._controller.state
        if now.frame != state.frame and not now.track.running:
            self._sent = {}
            return []
        number = next(self._numbers)
        common = {"type": "image", "frame": state.frame, "set": number, "of": len(missing)}
        return [
            messages.binary(common | {"layer": layer, "camera": camera, "limit_px": limit_px}, data)
            for (layer, camera), (data, limit_px) in zip(missing, made, strict=True)
        ]

    def _at_hand(self, wanted: dict[Key, tuple[object, ...]], state: State) -> dict[Key, tuple[object, ...]]:
        """Those of the pictures that can be made now, or have been sent already.

        Who follows a tracker sees all of each frame that is shown: none of them rests for long enough.
        """
        if not self._controller.frames.listed(state.frame):
            return {k: c for k, c in wanted.items() if self._sent.get(k) == c}
        if state.track.running or self._controller.frames.cached_evidence(state.frame) is not None:
            return wanted
        return {k: c for k, c in wanted.items() if k[0] not in EVIDENCE or self._sent.get(k) == c}

    def _make(self, key: Key, state: State, view: View) -> tuple[bytes, float | None]:
        """A picture, and what the darkest colour of a distance image means, px."""
        layer, camera = key
        reduction, session, frames = (
            view.reductions[camera],
            self._controller.session_of(state),
            self._controller.frames,
        )
        if layer == "image":
            return frames.image(state.frame, camera, reduction), None
        if layer == "parts":
            shown = [i for i in range(len(session.people)) if i not in state.visibility.hidden]
            bodies = [PosedBody(session.people[i].model, state.drawn.poses[i]) for i in shown]
            colors = overlays.part_colors([session.people[i] for i in shown])
            return pictures.parts(bodies, session.cameras[camera].camera.pinhole, colors, reduction), None
        evidence = frames.evidence(state.frame)[camera]
        if layer == "silhouette":
            return pictures.silhouette(evidence), None
        return pictures.distance(evidence), pictures.distance_limit_px(evidence)


def _wanted(state: State, view: View) -> dict[Key, tuple[object, ...]]:
    """What the page shows, and what each picture depends on."""
    wanted: dict[Key, tuple[object, ...]] = {}
    for layer in view.pictures:
        for camera in sorted(view.cameras):
            # Evidence comes at the scale of matching, whatever the pane.
            content = () if layer in EVIDENCE else (view.reductions[camera],)
            poses = (state.revisions, state.visibility.hidden, *map(id, state.drawn.poses)) if layer == "parts" else ()
            wanted[layer, camera] = (state.frame, *content, *poses)
    return wanted
