"""The people on one session: they join by name, have a controller each, and find their place again.

Check the name that a person joins by, and compare names as eyes do.
"""

import re
import threading
import time
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple

from app.control.controller import Controller
from app.state.role import Role
from app.state.state import State
from tracker.errors import TrackerError
from tracker.session.store.annotator import checked_annotator, normalized_annotator
from tracker.validation import quoted

_MAX_PEOPLE = 12
"""People besides the host who can be on a session at a time: each has a dozen threads and some megabytes."""
_MAX_PLACES = 100
"""Number of people whose frame is remembered after they have left."""
_ABSENT_S = 300.0
"""Time after which the controller of a person without a page is closed; it can be opened again at the same frame."""


class Presence(NamedTuple):
    """A person on the session, as the others see them."""

    name: str
    role: Role
    frame: int
    person: int
    """Index of the selected person."""
    doing: str
    """Work on poses, as text: `drags on frame 12`; empty for none."""


@dataclass(eq=False)
class _Participant:
    name: str
    role: Role
    controller: Controller
    n_pages: int = 0
    left_at: float = field(default_factory=time.monotonic)
    seen: Presence | None = None
    """Place that was last sent to the others; None while no page is open."""
    unsubscribe: Callable[[], None] = lambda: None


class Visit(NamedTuple):
    """The controller that a page shows, and its rights."""

    controller: Controller
    role: Role
    """Its present role: a link without a name only looks."""
    name: str
    """Name of the one who has joined; empty for a page that watches the host."""
    link: Role
    """Role that its link gives once a name is given."""
    refusal: str = ""
    """Why the wanted name could not be had, or empty."""
    participant: _Participant | None = None
    """The participant of the page; None for one that watches the host."""

    @property
    def has_place(self) -> bool:
        """Whether it has a frame of its own, shared with other pages of the same person only."""
        return self.participant is not None


class Participants:
    """Those who have joined one session. The host is there from the beginning."""

    def __init__(self, host: Controller, absent_s: float = _ABSENT_S) -> None:
        """Begin with the host.

        Args:
            host: controller of the session.
            absent_s: time after which the controller of an absent person is closed.
        """
        self._absent_s = absent_s
        self._lock = threading.RLock()  # taken before that of the session, never within
        self._host = _Participant(host.author, "host", host)
        self._others: list[_Participant] = []
        self._places: dict[tuple[Role, str], tuple[int, int, str | None]] = {}
        self._listeners: list[Callable[[], None]] = []
        self._timer: threading.Timer | None = None
        self._closed = False
        self._follow(self._host)

    @property
    def host(self) -> Controller:
        """Controller of the host."""
        return self._host.controller

    def join(self, role: Role, text: str = "") -> Visit:
        """Join with a page, until `leave`.

        Args:
            role: that the page's link gives.
            text: name as typed; empty for none. Without one, a page of the host is the host's, and a link watches the
                host.
        """
        refusal = ""
        try:
            found = self._join(role, joined_name(text))
        except TrackerError as error:
            refusal, found = str(error), self._join(role, "")
        if found is None:
            return Visit(self.host, "look", "", role, refusal)
        return Visit(found.controller, found.role, found.name, role, refusal, found)

    def leave(self, visit: Visit) -> None:
        """Leave with a page. The controller stays for a while, so that a page that loads again finds its place."""
        participant = visit.participant
        if participant is None:
            return
        with self._lock:
            participant.n_pages -= 1
            participant.left_at = time.monotonic()
            self._note(participant)
            self._plan_drop()

    def present(self) -> tuple[Presence, ...]:
        """Return who has a page open: the host first, the others in the order in which they joined."""
        with self._lock:
            return tuple(p.seen for p in (self._host, *self._others) if p.n_pages and p.seen is not None)

    def subscribe(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call a function whenever `present` changes, from any thread; returns the function that ends this."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)

    def close(self) -> None:
        """Close the controllers of all but the host."""
        with self._lock:
            self._closed = True
            if self._timer is not None:
                self._timer.cancel()
            for participant in list(self._others):
                self._drop(participant)
        self._host.unsubscribe()

    def _join(self, role: Role, name: str) -> _Participant | None:
        """Return the participant of a page; None for one that only watches the host.

        Raises:
            TrackerError: somebody with another role has the name, or there are too many.
        """
        with self._lock:
            if role == "host" and (not name or is_same(name, self._host.name)):
                found = self._host
            elif not name:
                return None
            else:
                found = self._named("annotate" if role == "host" else role, name)
            found.n_pages += 1
            self._note(found)
            return found

    def _named(self, role: Role, name: str) -> _Participant:
        everybody = (self._host, *self._others)
        known = next((p for p in everybody if is_same(p.name, name)), None)
        if known is not None and known.role == role:
            return known
        found = "who has joined with another role"
        if known is None:
            known, found = next((p for p in everybody if looks_alike(p.name, name)), None), "which looks alike"
        if known is not None and (known is self._host or not _is_idle(known)):
            raise TrackerError(f"expected a name that nobody else has, found {known.name}, {found}; choose another")
        if known is not None:
            self._drop(known)
        if len(self._others) >= _MAX_PEOPLE:
            idle = [p for p in self._others if _is_idle(p)]
            if not idle:
                raise TrackerError(
                    f"expected at most {_MAX_PEOPLE} people besides the host, found as many; join when somebody leaves"
                )
            self._drop(min(idle, key=lambda p: p.left_at))
        made = _Participant(name, role, self.host.beside(name, writes=role != "look"))
        frame, person, point = self._places.get((role, name), (self.host.state.frame, self.host.state.person, None))
        made.controller.navigation.seek(frame)
        made.controller.navigation.select(person, point)
        self._others.append(made)
        self._follow(made)
        return made

    def _plan_drop(self) -> None:
        if self._timer is None and not self._closed and any(not p.n_pages for p in self._others):
            self._timer = threading.Timer(self._absent_s, self._drop_absent)
            self._timer.daemon = True
            self._timer.start()

    def _drop_absent(self) -> None:
        with self._lock:
            self._timer = None
            late = time.monotonic() - self._absent_s
            for participant in [p for p in self._others if _is_idle(p) and p.left_at <= late]:
                self._drop(participant)
            self._plan_drop()

    def _drop(self, participant: _Participant) -> None:
        self._others.remove(participant)
        participant.unsubscribe()
        state = participant.controller.state
        self._places.pop((participant.role, participant.name), None)
        self._places[participant.role, participant.name] = state.frame, state.person, state.point
        if len(self._places) > _MAX_PLACES:
            del self._places[next(iter(self._places))]
        participant.controller.close()

    def _follow(self, participant: _Participant) -> None:
        fields = ("frame", "person", "drag", "is_pin_held", "search", "track", "ranges", "finding")
        participant.unsubscribe = participant.controller.subscribe(lambda _: self._note(participant), *fields)

    def _note(self, participant: _Participant) -> None:
        """Tell the pages where a participant is, if that has changed; called under the session's lock or not."""
        seen = _presence(participant, participant.controller.state) if participant.n_pages else None
        if seen != participant.seen:
            participant.seen = seen
            for listener in list(self._listeners):
                listener()


def _is_idle(participant: _Participant) -> bool:
    return not participant.n_pages and participant.controller.state.pose_work is None


def _presence(participant: _Participant, state: State) -> Presence:
    work = state.pose_work
    return Presence(participant.name, participant.role, state.frame, state.person, "" if work is None else work.what)


MAX_CHARACTERS = 60
"""Length of a name at most: all pages show it in one line."""
_MAX_MARKS = 4
"""Marks on one letter at most (Unicode TS 39, 5.4)."""
_INVISIBLE = re.compile(
    "[\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u2800\u3164\ufe00-\ufe0f\uffa0\ufffc\U00016fe4\U0001d159"
    "\U000e0100-\U000e01ef]"
)
"""Characters that count as printable and show nothing: those of Unicode's Default_Ignorable_Code_Point, and blanks."""


def joined_name(text: str) -> str:
    """Return a name without superfluous space, in one form of Unicode; empty for none.

    Raises:
        TrackerError: it is too long, has no letter or digit, or has characters that nobody can see or tell apart.
    """
    name = normalized_annotator(text)
    if not name:
        return ""
    if len(name) > MAX_CHARACTERS:
        raise TrackerError(
            f"expected a name of at most {MAX_CHARACTERS} visible characters, found {quoted(name)}; choose another"
        )
    hidden = next((c for c in name if not c.isprintable() or _INVISIBLE.match(c)), None)
    if hidden is not None:
        raise TrackerError(f"expected a name of visible characters, found U+{ord(hidden):04X} in it; choose another")
    kinds = "".join(unicodedata.category(c)[0] for c in unicodedata.normalize("NFD", name))
    if not re.search("[LN]", kinds) or kinds[0] == "M" or "M" * (_MAX_MARKS + 1) in kinds:
        raise TrackerError(
            f"expected a name with a letter or digit and at most {_MAX_MARKS} marks on each, found {quoted(name)}; "
            "choose another"
        )
    return checked_annotator(name)


def is_same(one: str, other: str) -> bool:
    """Return whether two names are the same but for capitals and forms of letters."""
    return _folded(one) == _folded(other)


def looks_alike(one: str, other: str) -> bool:
    """Return whether people would take two names for the same: their letters look alike (Unicode TS 39, 4)."""
    return not _skeletons(one).isdisjoint(_skeletons(other))


def _folded(name: str) -> str:
    return unicodedata.normalize("NFKC", name).casefold()


def _skeletons(name: str) -> set[str]:
    """Return a name with each letter replaced by the one that it stands for, as it is and without capitals."""
    return {_skeleton(name).casefold(), _skeleton(_folded(name))}


def _skeleton(name: str) -> str:
    return unicodedata.normalize("NFD", "".join(map(_prototype, unicodedata.normalize("NFD", name))))


@cache
def _prototype(letter: str) -> str:
    """Return the letter or letters that represent all those that look like a letter."""
    from confusable_homoglyphs.confusables import confusables_data

    # The table has a letter with its prototype, and a prototype with all its letters.
    listed = [found["c"] for found in confusables_data.get(letter, ())]
    return max((letter, *listed), key=lambda c: (len(confusables_data.get(c, ())), len(c), c))
