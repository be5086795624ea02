"""Another of the poses that a tracker found about as good, taken in place of the one that it chose."""

from collections.abc import Mapping

from app.control.session.activities import Activities
from app.control.session.session_state import SessionState
from tracker.errors import TrackerError
from tracker.store.records import Alternative, PoseChange, PoseRecord


class Alternatives:
    """Chooses among the poses that the store keeps for a frame."""

    def __init__(self, session_state: SessionState, activities: Activities) -> None:
        """Choose on this screen.

        Args:
            screen: holds the state.
            activities: ends jobs and gestures before an edit.
        """
        self._session_state, self._activities = session_state, activities

    def take_alternative(self, person: int, frame: int | None = None) -> None:
        """Take the best of the other poses of a person, who vouches for it: a keyframe. The former one is kept with it.

        Where two people may be each other both are exchanged. Taken again and again, all poses come round.

        Args:
            person: index of whom; where there is nothing to choose from, the next person of whom there is.
            frame: the frame that the user saw, which a tracker may have left meanwhile; None for the one shown.

        Raises:
            TrackerError: no other pose is kept of anybody on the frame, or it is of a body of other joints.
        """
        with self._activities.editing():
            session_state = self._session_state
            session_state.go_to(frame)
            found = self._kept()
            if not found:
                raise TrackerError(
                    f"expected another pose to take on frame {session_state.state.frame}, found none kept; "
                    "a tracker keeps them where it cannot tell"
                )
            first = person if person in found else min(found)
            changes = [self._change(i, found[i], at) for i, at in _together(found, first).items()]
            names = " and ".join(c.person for c in changes)
            whose = f" of {names}" if len(session_state.session.people) > 1 else ""
            label = f"take the other pose{whose}, frame {session_state.state.frame}"
            session_state.saver.write(label, changes, None, by_program=False)
            session_state.refresh_saving()
            session_state.show_frame(session_state.state.frame)

    def _kept(self) -> dict[int, tuple[Alternative, ...]]:
        """The other poses of everybody who has some on the frame, by index."""
        frame = self._session_state.state.frame
        kept = {i: self._session_state.saver.alternatives(i, frame) for i in range(len(self._session_state.models))}
        return {i: poses for i, poses in kept.items() if poses}

    def _change(self, person: int, kept: tuple[Alternative, ...], at: int) -> PoseChange:
        """One of the poses kept in place of the one that is stored, which goes to their end."""
        session_state, frame = self._session_state, self._session_state.state.frame
        former, taken = session_state.saver.record(person, frame), kept[at]
        others = (*kept[:at], *kept[at + 1 :])
        assert former is not None  # poses are kept with the one that they could take the place of
        sources = ("manual",) * len(taken.values)
        record = PoseRecord(taken.values, sources, taken.model_revision, True, cost_px=taken.cost_px, reviewed=True)
        back = Alternative(former.values, former.model_revision, former.cost_px)
        return PoseChange(session_state.session.people[person].name, frame, record, (*others, back))


def _together(found: Mapping[int, tuple[Alternative, ...]], person: int) -> dict[int, int]:
    """Which of the poses kept are taken, by person: the best of one, and those that belong to it.

    People who may be each other are given the same cost, to the last digit: that of both exchanged.
    """
    taken, cost_px = {person: 0}, found[person][0].cost_px
    for other, kept in found.items():
        costs = [a.cost_px for a in kept]
        if other != person and cost_px is not None and cost_px in costs:
            taken[other] = costs.index(cost_px)
    return dict(sorted(taken.items()))
