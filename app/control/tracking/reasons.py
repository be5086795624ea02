"""Explain the shown pose in the background: what each view shows of each part, against what is usual in the run."""

import logging
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from app.control.session.session_state import SessionState
from app.control.session.watching_pages import WatchingPages
from app.control.tracking import track_settings
from app.control.tracking.poses_around import pose_in_run
from app.remedies import page_sentence
from app.runtime.jobs import LatestWinsWorker, StoppedError
from app.state.identity import ObjectIdentity
from app.state.reason import RankedPose, Reason
from app.state.state import State
from tracker.body.limbs import limb_display_name
from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.estimation.appearance.background_density import MIN_SEEN
from tracker.estimation.appearance.region_model import learning_frames
from tracker.estimation.by_frame.frame_problem import Bodies
from tracker.estimation.by_frame.part_evidence import UsualEvidence, contradiction, learn_usual_evidence, read_frame
from tracker.estimation.fitting.hypothesis import limbs_elsewhere
from tracker.evidence.observer import Observer
from tracker.geometry.arrays import Array
from tracker.pipeline.pose_check import compared_pose

_LOG = logging.getLogger(__name__)
_REST_S = 0.1
"""Minimum time between two reasons; the pose may change faster."""
_GIVE_WAY_S = 0.05
"""Time between two looks at whether a drag has ended, which goes first."""


@dataclass(frozen=True, eq=False)
class _Learnt:
    """The usual of a run, and the poses that it was learnt from."""

    run: UsualEvidence
    people: tuple[int, ...]
    poses: Mapping[int, tuple[Array, ...]]
    """Of these people in their present bodies by frame, (n_values,) each."""
    observer: Observer
    """Of the cameras that it was learnt with."""

    def holds(self, people: tuple[int, ...], poses: Mapping[int, tuple[Array, ...]], observer: Observer) -> bool:
        """Return whether most poses of a run, and the cameras, are still those that it was learnt from."""
        same = [k for k in poses.keys() & self.poses.keys() if all(map(np.array_equal, poses[k], self.poses[k]))]
        return people == self.people and observer is self.observer and 2 * len(same) > len(poses)


class Reasons:
    """Explains the newest pose while a page asks for it. The usual is learnt once for the poses of a run."""

    def __init__(self, session_state: SessionState) -> None:
        """Subscribe to the state; nothing is computed until a page asks."""
        self._session_state = session_state
        self._pages = WatchingPages[None](session_state, self._changed)
        self._stopping = threading.Event()
        self._learnt: _Learnt | None = None
        self._computed: tuple[object, ...] = ()
        self._latest = LatestWinsWorker(self._compute, "reasons", _REST_S)

    def watch(self, page: int, looks: bool) -> None:
        """Note whether a page shows the reason; the work begins where it does, and ends with the last page.

        Args:
            page: number of the page.
            looks: whether it shows the reason.
        """
        if not looks:
            self._pages.leave(page)
            if not self._pages:
                self._stopping.set()
            return
        self._pages.enter(page, None)
        self._stopping.clear()
        self._computed = ()
        self._latest.offer(self._session_state.state)

    def stop(self) -> None:
        """Stop the work until a page asks again, by `watch`."""
        self._stopping.set()

    def close(self) -> None:
        """End the thread."""
        self._stopping.set()
        self._latest.close()

    def _changed(self, state: State) -> None:
        if not self._stopping.is_set() and _ingredients(state) != self._computed:
            self._latest.offer(state)

    def _compute(self, _: State) -> None:
        session_state = self._session_state
        state = session_state.state  # the newest: work on the one that was offered may have waited
        ingredients = _ingredients(state)
        if not self._pages or self._stopping.is_set() or ingredients == self._computed:
            return
        if state.is_dragging or state.search.running:
            return  # offered again with the next state
        self._computed = ingredients
        try:
            self._set(running=True, stage="reading the frame", share=0.0, message="")
            people = self._people(state)
            found = self._explained(state, self._run(people), people)
            self._set(found=found, message="")
            self._set(found=self._with_alternatives(state, found))
        except StoppedError:
            if self._stopping.is_set():
                self._computed = ()
                self._set(message="Stopped.")
        except TrackerError as error:
            self._set(message=page_sentence(error))
        except Exception:
            _LOG.exception("a pose could not be explained")
            self._set(message="Expected to explain this pose, found a fault; the log of the program has more.")
        finally:
            self._set(running=False)

    def _set(self, **changes: object) -> None:
        session_state = self._session_state
        with session_state.lock:
            session_state.set(reasons=replace(session_state.state.reasons, **changes))  # pyrefly: ignore[bad-argument-type]

    def _report(self, stage: str, share: float, text: str = "", /) -> None:
        """Show progress, and let a drag go first."""
        session_state = self._session_state
        while session_state.state.is_dragging and not self._stopping.is_set():
            time.sleep(_GIVE_WAY_S)
        if self._stopping.is_set():
            raise StoppedError
        if session_state.state.track.running:
            raise TrackerError(_TRACKING)
        self._set(stage=stage, share=share)

    def _people(self, state: State) -> tuple[int, ...]:
        """Return the indices of the people who have a pose.

        Raises:
            TrackerError: the selected person has none, or other work is to end first.
        """
        if state.compiling is not None:
            raise TrackerError("expected compiled kernels, found that they are being compiled; the reason follows")
        if state.track.running:
            raise TrackerError(_TRACKING)
        if state.people[state.person].source is None:
            name = self._session_state.session.people[state.person].name
            raise TrackerError(f"expected a pose of {name} on frame {state.frame}, found none; place the body first")
        return tuple(i for i, p in enumerate(state.people) if p.source is not None)

    def _explained(self, state: State, run: UsualEvidence, people: tuple[int, ...]) -> Reason:
        """Return the reason for the pose of the selected person, without alternatives."""
        session_state, person = self._session_state, state.person
        seen = read_frame(session_state.frames.observer, state.frame, _bodies(state, people))
        table = run.table(seen, people.index(person))
        worst = contradiction(state.models[person], table, seen.thetas_px, session_state.session.camera_names)
        return Reason(state.frame, person, state.people[person].values, table, worst)

    def _with_alternatives(self, state: State, found: Reason) -> Reason:
        """Return a reason with the other poses that may be as likely, by the frames around."""
        session_state, person = self._session_state, found.person
        observer = session_state.frames.observer.at_nearest_times()
        pose = pose_in_run(session_state, person, found.frame, state.people[person].alternatives)
        is_comparable = len(observer.cameras) > 1 and len(pose.known) > 1 and found.frame in pose.known
        if not is_comparable or state.revisions[person] != state.present[person]:
            return replace(found, alternatives=())
        here = [*pose.known[found.frame]]
        here[person] = found.values
        settings = track_settings.of_estimates(state.settings, state.run_choices)
        pose = replace(pose, known={**pose.known, found.frame: here})
        run = compared_pose(session_state.session, observer, settings, pose, self._report)
        present = PosedBody(state.models[person], found.values)
        ranked = tuple(
            RankedPose(o.pose, o.cost, tuple(map(limb_display_name, limbs_elsewhere(present, o.body))))
            for o in run.others
        )
        return replace(found, alternatives=ranked)

    def _run(self, people: tuple[int, ...]) -> UsualEvidence:
        """Return what is usual in the run, learnt if that is to do."""
        session_state = self._session_state
        poses, observer = self._poses(people), session_state.frames.observer
        if self._learnt is None or not self._learnt.holds(people, poses, observer):
            if len(poses) < MIN_SEEN:
                raise TrackerError(
                    f"expected {MIN_SEEN} frames with poses or more, to learn what is usual in each view, found "
                    f"{len(poses)}; track the recording first"
                )
            models = session_state.present
            frames: list[tuple[int, Bodies]] = [
                (k, tuple(PosedBody(models[i], values) for i, values in zip(people, own, strict=True)))
                for k, own in poses.items()
            ]
            run = learn_usual_evidence(observer, frames, self._report)
            self._learnt = _Learnt(run, people, poses, observer)
        return self._learnt.run

    def _poses(self, people: tuple[int, ...]) -> dict[int, tuple[Array, ...]]:
        """Return poses of people in their present bodies, (n_values,) each, on frames on which all of them have one."""
        saver = self._session_state.saver
        with self._session_state.lock:
            common = sorted(set.intersection(*(set(saver.index.frames(i)) for i in people)))
        chosen = learning_frames(common)
        found: list[dict[int, Array]] = []
        for person in people:
            rows = [r for r in saver.pose_rows(person, chosen) if saver.revisions.fits(person, r.model_revision)]
            found.append({r.frame: saver.revisions.in_present_body(person, r.values, r.model_revision) for r in rows})
        return {k: tuple(own[k] for own in found) for k in chosen if all(k in own for own in found)}


_TRACKING = "expected no tracking run at work, found one; the reason follows at its end"


def _bodies(state: State, people: Sequence[int]) -> Bodies:
    return tuple(PosedBody(state.models[i], state.people[i].values, state.velocity(i)) for i in people)


def _ingredients(state: State) -> tuple[object, ...]:
    """Return what a reason is made from, for comparison. Poses are compared by identity."""
    shown = tuple(ObjectIdentity(p.values) for p in state.people)
    cameras = state.calibration.n_changes
    return state.frame, state.person, shown, state.revisions, cameras, state.track.running, state.compiling
