"""Replace a tracked pose by one of its alternatives."""

from collections.abc import Callable, Mapping

import numpy as np

from app.control.session.activities import Activities
from app.control.session.session_state import SessionState
from app.state.state import Costs
from tracker.errors import TrackerError
from tracker.session.store.records import Alternative, PoseChange, PoseRecord


class Alternatives:
    """The stored alternatives of the shown frame."""

    def __init__(
        self, session_state: SessionState, activities: Activities, assess: Callable[[PoseChange, int | None], None]
    ) -> None:
        """Replace nothing yet.

        Args:
            session_state: holds the state.
            activities: ends jobs and gestures before an edit.
            assess: called with each row that was stored and its edit, None where it waits to be written.
        """
        self._session_state, self._activities, self._assess = session_state, activities, assess

    def take_alternative(self, person: int, frame: int | None = None, rank: int | None = None) -> None:
        """Replace a person's pose by an alternative, as a keyframe. The former pose becomes the last alternative.

        Both people of a possible identity swap are replaced. Repeated calls cycle through all alternatives. Then the
        pose is assessed.

        Args:
            person: index of the person; if there is no alternative, the first person with one.
            frame: the frame that the user saw, which a tracker may have left; None for the shown one.
            rank: of the alternative among those of the reason for the shown pose; None for the best that is stored.

        Raises:
            TrackerError: the frame has no such alternative that fits a present body.
        """
        with self._activities.editing():
            session_state = self._session_state
            session_state.go_to(frame)
            found = self._stored()
            at = 0
            if rank is not None:
                found, at = self._with_one_of_the_reason(found, person, rank)
            if not found:
                raise TrackerError(
                    f"expected an alternative pose on frame {session_state.state.frame}, found none; "
                    "go to a frame that the timeline marks as ambiguous"
                )
            first = person if person in found else min(found)
            taken = _together(found, first, at)
            costs = self._costs({i: found[i][k] for i, k in taken.items()})
            changes = [self._change(i, found[i], k, costs) for i, k in taken.items()]
            names = " and ".join(c.person for c in changes)
            whose = f" of {names}" if len(session_state.session.people) > 1 else ""
            label = f"take alternative pose{whose}, frame {session_state.state.frame}"
            edit = session_state.saver.write(label, changes, None, by_program=False)
            session_state.show_frame()
            session_state.refresh_saving()
        for change in changes:
            self._assess(change, edit)

    def _with_one_of_the_reason(
        self, found: dict[int, tuple[Alternative, ...]], person: int, rank: int
    ) -> tuple[dict[int, tuple[Alternative, ...]], int]:
        """Return alternatives with one of the reason's among them, by person, and its index.

        Raises:
            TrackerError: there is no reason for this pose, or it has fewer alternatives.
        """
        reason = self._session_state.state.reason
        ranked = () if reason is None or reason.person != person else reason.alternatives or ()
        if rank >= len(ranked):
            raise TrackerError(
                f"expected an alternative {rank + 1} of the shown pose, found none; show the reason of this frame first"
            )
        values, own = ranked[rank].values, found.get(person, ())
        for at, stored in enumerate(own):
            if np.array_equal(stored.values, values):
                return found, at
        searched = Alternative(values, self._session_state.state.revisions[person], None)
        return {**found, person: (*own, searched)}, len(own)

    def _stored(self) -> dict[int, tuple[Alternative, ...]]:
        """Return the alternatives of the frame by person, without people who have none."""
        frame = self._session_state.state.frame
        stored = {i: self._session_state.saver.alternatives(i, frame) for i in range(len(self._session_state.models))}
        return {i: poses for i, poses in stored.items() if poses}

    def _costs(self, taken: Mapping[int, Alternative]) -> Costs:
        """Return the costs of the frame with alternatives of some people."""
        session_state, state = self._session_state, self._session_state.state
        poses, models, bodies = [*state.poses], [*state.models], session_state.saver.revisions
        for i, other in taken.items():
            poses[i], models[i] = other.values, bodies.body(other.model_revision)
        return session_state.costs(tuple(poses), state.frame, tuple(models))

    def _change(self, person: int, stored: tuple[Alternative, ...], at: int, costs: Costs) -> PoseChange:
        """Return the change that stores one of the alternatives and appends the former pose to them."""
        session_state, frame = self._session_state, self._session_state.state.frame
        former, taken = session_state.saver.record(person, frame), stored[at]
        others = (*stored[:at], *stored[at + 1 :])
        assert former is not None  # alternatives are stored with a pose
        sources = ("manual",) * len(taken.values)
        record = PoseRecord(taken.values, sources, taken.model_revision, True, reviewed=True, **vars(costs))
        back = Alternative(former.values, former.model_revision, former.cost_px)
        return PoseChange(session_state.session.people[person].name, frame, record, (*others, back))


def _together(found: Mapping[int, tuple[Alternative, ...]], person: int, at: int = 0) -> dict[int, int]:
    """Return which alternatives are taken, by person: one of a person, and its partner in an identity swap.

    The alternatives of a swap have exactly equal costs: the cost of both people swapped.

    Args:
        found: alternatives of each person.
        person: index of the person.
        at: index among this person's alternatives; the best by default.
    """
    taken, cost_px = {person: at}, found[person][at].cost_px
    for other, stored in found.items():
        costs = [a.cost_px for a in stored]
        if other != person and cost_px is not None and cost_px in costs:
            taken[other] = costs.index(cost_px)
    return dict(sorted(taken.items()))
