"""Editing the sizes of bodies: a draft that the views show, then a new revision of the model, undone as edits are."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from app.control.search.search_runs import Runs
from app.control.session.session_state import Screen
from app.state.state import SizeDraft
from tracker.body.dimensions import BodyDimensions, PartDimensions, dimensions_of, mirror_part, scaled, with_dimensions
from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.posing.retarget import retarget_pose
from tracker.session.session import save_model
from tracker.store.records import Change, PoseChange

_KEY = "sizes_edits"
"""Setting of the session: by entry of the history the name of the person whose sizes it changed, and the revisions
before and after it."""


class _Refitted(NamedTuple):
    """Keyframes taken over into another body."""

    changes: list[Change]
    off_m: float
    """Mean distance of their joints from where they were, metres."""


class Sizing:
    """The sizes of everybody in the session; at most one person's are being edited."""

    def __init__(self, screen: Screen, runs: Runs, editing: Callable[[], AbstractContextManager[None]]) -> None:
        """Edit the sizes of who is on this screen.

        Args:
            screen: holds the state.
            runs: searches as they went; of other sizes they mean nothing any more.
            editing: gives the lock with nothing at work and no gesture at hand (`Controller.editing`).
        """
        self._screen, self._runs, self._editing = screen, runs, editing

    def model(self, person: int) -> BodyModel:
        """The body of a person as it is being edited, else the present one."""
        draft = self._screen.state.draft
        return draft.model if draft is not None and draft.person == person else self._screen.present[person]

    def couple(self, alike: bool) -> None:
        """Edit both sides at once from now on, or each by itself."""
        self._screen.set(sides_alike=alike)

    def set_height(self, person: int, height_m: float) -> None:
        """Scale the draft as a whole to another body height, metres.

        Raises:
            TrackerError: nobody is that tall.
        """
        with self._screen.lock:
            sizes = self._sizes(person)
            # Lengths are checked against the height, which a wrong number must not divide by.
            wrong = not (np.isfinite(height_m) and height_m > 0)
            self._draft(person, sizes._replace(height_m=height_m) if wrong else scaled(sizes, height_m))

    def set_part(self, person: int, part: str, sizes: PartDimensions) -> None:
        """Give a part of the draft other sizes, and its twin where both sides are edited at once.

        Raises:
            TrackerError: no part has such sizes.
        """
        with self._screen.lock:
            before = self._sizes(person)
            other = mirror_part(part) if self._screen.state.sides_alike else None
            both = {name: sizes for name in (part, other) if name is not None and name in before.parts}
            self._draft(person, before._replace(parts={**before.parts, **both}))

    def set_width(self, person: int, girdle: str, width_m: float) -> None:
        """Set the hips, or shoulders, of the draft apart, metres.

        Raises:
            TrackerError: no body is that wide.
        """
        with self._screen.lock:
            before = self._sizes(person)
            self._draft(person, before._replace(widths_m={**before.widths_m, girdle: width_m}))

    def recall(self, person: int) -> None:
        """Take the sizes before the present ones as the draft.

        Raises:
            TrackerError: the person has always had these.
        """
        with self._screen.lock:
            former = self._screen.saver.former_body(person)
            if former is None:
                name = self._screen.session.people[person].name
                raise TrackerError(f"expected sizes that {name} had before, found none; these are the first")
            self._screen.set(draft=SizeDraft(person, former), sizes_message="")

    def discard(self) -> None:
        """Edit no more; the sizes stay as they are."""
        self._screen.set(draft=None, sizes_message="")

    def apply(self, person: int, refit: bool) -> None:
        """Make the draft the present body: a new revision, on disk when this returns, and one entry of the history.

        Args:
            person: index of whose.
            refit: take the person's keyframes over into it, to their joints and pins; else every stored pose stays
                what it is, of the body that it was made with.

        Raises:
            TrackerError: there is nothing to change, or it cannot be written.
        """
        with self._editing():
            screen, name = self._screen, self._screen.session.people[person].name
            before, model = screen.saver.revision(person), self.model(person)
            same = model is screen.present[person] or dimensions_of(model) == dimensions_of(screen.present[person])
            if not same:
                screen.embody(save_model(screen.session, person, model))
            refitted = self._refit(person) if refit else _Refitted([], 0.0)
            if same and not refitted.changes:
                raise TrackerError(
                    f"expected other sizes of {name}, or keyframes made with others, found neither; "
                    "enter a length in the panel first"
                )
            n = len(refitted.changes)
            counted = f", {n} keyframe{'' if n == 1 else 's'} refitted" if n else ""
            told = counted if refit else ", poses kept"
            edit = screen.saver.write(
                f"sizes of {name}{told}", refitted.changes, None, by_program=False, even_empty=True
            )
            if edit is not None and screen.saver.error is None:
                edits = screen.saver.setting(_KEY, {})
                screen.saver.keep_setting(_KEY, {**edits, str(edit): [name, before, screen.saver.revision(person)]})
            off = f", joints {refitted.off_m * 1000:.0f} mm off on average" if n else ""
            self._runs.clear()
            screen.refresh_saving()
            screen.show(screen.state.frame, draft=None, sizes_message=f"Applied{told}{off}.")

    def follow(self) -> None:
        """Bring back the bodies that belong to where the history has just been moved.

        Raises:
            TrackerError: a body cannot be written.
        """
        screen, saver = self._screen, self._screen.saver
        edits = saver.setting(_KEY, {})
        latest = next((e for e in saver.history(1) if not e.undone), None)
        for edit in saver.passed:
            name, before, after = edits.get(str(edit), (None, 0, 0))
            person = next((i for i, p in enumerate(screen.session.people) if p.name == name), None)
            if person is None:
                continue
            # A move goes one way: where its last entry is done now, all of them are.
            done = latest is not None and latest.edit == saver.passed[-1]
            model = saver.body(after if done else before)
            if model is not screen.present[person]:
                screen.embody(save_model(screen.session, person, model))
            self._runs.clear()
            screen.set(draft=None, sizes_message="")

    def _sizes(self, person: int) -> BodyDimensions:
        return dimensions_of(self.model(person))

    def _draft(self, person: int, sizes: BodyDimensions) -> None:
        if sizes == self._sizes(person):
            return
        model = with_dimensions(self._screen.present[person], sizes)
        self._screen.set(draft=SizeDraft(person, model), sizes_message="")

    def _refit(self, person: int) -> _Refitted:
        """The keyframes of a person that were made with another body, taken over into the present one."""
        screen, saver = self._screen, self._screen.saver
        cameras = [c.camera for c in screen.session.cameras]
        becomes, revision, name = screen.present[person], saver.revision(person), screen.session.people[person].name
        changes: list[Change] = []
        off_m: list[float] = []
        for row in saver.rows(person, range(screen.session.n_frames)):
            record = saver.record(person, row.frame) if row.keyframe else None
            if record is None or record.model_revision == revision or not saver.fits(person, record.model_revision):
                continue
            was, pins = saver.body(record.model_revision), saver.pins(person, row.frame)
            values = retarget_pose(record.values, was, becomes, pins, cameras, screen.free(person))
            told = {"method": "refit", "model_revision": record.model_revision}
            pose = replace(
                record, values=values, model_revision=revision, status="", cost_px=None, settings=told,
                view_costs_px=(), part_costs_px=(), remark="refitted to other sizes",
            )  # fmt: skip
            changes.append(PoseChange(name, row.frame, pose))
            moved = becomes.points_world(values) - was.points_world(record.values)
            off_m.append(float(np.linalg.norm(moved, axis=1).mean()))
        return _Refitted(changes, float(np.mean(off_m)) if off_m else 0.0)
