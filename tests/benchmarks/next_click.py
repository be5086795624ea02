"""Count actions until a recording is good enough: `python tests/benchmarks/next_click.py SESSION... --data DIR`.

Each SESSION has bodies and a start. It is named as a recording in `--data DIR`, or as a folder in
`--scenes DIR`. A scripted annotator sees the true joints with 3 px of noise and corrects copies. An action corrects one
limb of one frame by pins in two views and a fit, as *Fit* in the page does. The frame becomes a keyframe, and the
stretches beside it are tracked again. He follows the proposals of `quadrille next`, the list of doubts, or corrects
everything on keyframes at equal distances. It is counted how many actions it takes until the mean error is at most
20 mm (30 for two people) and no frame is lost. A folder NAME@plain is the session NAME, tracked by first passes.
"""

import shutil
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from between_keyframes import LOST_MM, errors
from doc_tables import Conditions, benchmark_parser, read_words, show, table
from joint_errors import references_of

from tracker.annotation.expected_error import contradicted_keyframes, correctable_joints
from tracker.annotation.next_click import Proposals, propose
from tracker.api.work import ProgressSink
from tracker.body.limbs import limb_display_name, limbs
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.posing.grab import Constraints
from tracker.estimation.posing.pinned_fit import fit_frame
from tracker.evaluation.references import read_joints
from tracker.geometry.triangulation import PointObservation
from tracker.pipeline.automatic_run import open_stored_session
from tracker.pipeline.stored_run import TrackPlan
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange
from tracker.session.store.stored_poses import StoredPose, read_stored_poses

NOISE_PX = 3.0
MAX_ACTIONS = 16
SHOWN = (0, 1, 2, 4, 8, 16)
"""Numbers of actions of which the table has the error."""
TARGETS_MM = (20.0, 30.0)
"""Of one person, and of two."""
EQUAL = (1, 2, 3, 5)
"""Numbers of keyframes at equal distances."""
TABLES = ("next_click",)
HEADS = ("actions until good", *(f"{n}" for n in SHOWN), "at the end")
CONDITIONS = Conditions(
    footage="recordings and simulated people at 10 frames/s, four cameras with backgrounds; seed 1603",
    body="`gavrila38`, acquired from the joints of frame 0",
    start="tracked again from the pose fitted to the joints of frame 0, which is a keyframe",
    settings=f"an action corrects one limb of one frame in two views, with {NOISE_PX:g} px of noise. Good: at most 20 "
    "mm (two people 30 mm) and no frame lost. Mean error over the limb joints, mm, and lost frames after so many "
    f"actions; at most {MAX_ACTIONS} actions. *At the end:* actions, error, and the expected error with its interval",
    chosen="rules of tracking on the recordings; none of the proposals",
    command="python tests/benchmarks/next_click.py SESSION... --data DIR --scenes DIR --write docs/log/annotation.md",
)


class Action(NamedTuple):
    """A limb of a frame that is corrected."""

    frame: int
    person: int
    unit: str
    views: tuple[int, ...]


class Measured(NamedTuple):
    """Errors after some actions."""

    actions: int
    mean_mm: float
    n_lost: int


class Annotator:
    """The scripted annotator, at work on a copy of a session."""

    def __init__(self, folder: Path, references: Sequence[Path], seed: int, is_plain: bool) -> None:
        self.folder, self.references, self.rng = folder, references, np.random.default_rng(seed)
        self.session = load_session(folder)
        self.settings = TrackSettings(whole_run=not is_plain)
        self.target_mm = TARGETS_MM[len(self.session.people) > 1]
        self.actions, self.curve = 0, list[Measured]()

    def poses(self) -> list[dict[int, StoredPose]]:
        """The stored poses of each person."""
        return [read_stored_poses(self.session.annotations_path, p.name, p.model) for p in self.session.people]

    def proposals(self) -> Proposals:
        """What is proposed now."""
        with AnnotationStore(self.session.annotations_path, read_only=True) as store:
            contradicted = [contradicted_keyframes(store, p.name) for p in self.session.people]
        return propose(self.session, self.poses(), contradicted=contradicted)

    def measure(self) -> Measured:
        """Add the present errors to the curve."""
        of_frames = []
        for own, reference in zip(self.poses(), self.references, strict=True):
            of_frames.append(errors({k: p.body for k, p in own.items()}, reference, self.session.fps))
        lost = sum(int((np.nanmax(e, axis=1) > LOST_MM).sum()) for e in of_frames)
        mean = float(np.mean([np.nanmean(e) for e in of_frames]))
        self.curve.append(Measured(self.actions, mean, lost))
        return self.curve[-1]

    @property
    def is_good(self) -> bool:
        """Whether the recording is good enough by now."""
        return self.curve[-1].mean_mm <= self.target_mm and self.curve[-1].n_lost == 0

    def correct(self, action: Action) -> None:
        """Put the joints of a limb where they are seen in two views, and make the frame a keyframe."""
        own, cameras = self.poses(), [c.camera.pinhole for c in self.session.cameras]
        pose, model = own[action.person][action.frame], self.session.people[action.person].model
        names, active = unit_of(model, action.unit)
        joints = read_joints(self.references[action.person], self.session.fps)
        row = joints.points[np.flatnonzero(joints.frames == action.frame)[0]]
        truth = dict(zip(joints.names, row, strict=True))
        pins = [
            PointObservation(n, v, tuple(cameras[v].project(truth[n]) + NOISE_PX * self.rng.standard_normal(2)))
            for n in names
            for v in action.views
            if np.isfinite(truth[n]).all()
        ]
        with open_stored_session(self.session) as opened:
            views = opened.observer.evidence(action.frame)
        bodies = [person[action.frame].body for person in own]
        of_all = [pins if i == action.person else [] for i in range(len(bodies))]
        limits = [Constraints(active if i == action.person else None) for i in range(len(bodies))]
        fit = fit_frame(bodies, of_all, cameras, views, TrackSettings(), [action.person], limits)
        values, pinned = fit.poses[action.person], fit.pinned[action.person]
        moved = np.where(values != pose.record.values, "fitted", pose.record.sources)
        sources = tuple(np.where(pinned, "pinned", moved).tolist())
        record = replace(pose.record, values=values, sources=sources, keyframe=True, reviewed=True, errors=None,
                         limbs_lost=(), status="", remark="", trace=None)  # fmt: skip
        with AnnotationStore(self.session.annotations_path) as store:
            store.commit("correct", [PoseChange(self.session.people[action.person].name, action.frame, record)])
        self.actions += 1

    def track_beside(self, person: int, frame: int) -> None:
        """Track the frames up to the keyframes on either side again, or up to the end."""
        keyframes = [k for k, p in self.poses()[person].items() if p.record.keyframe]
        first = max((k for k in keyframes if k < frame), default=frame)
        last = min((k for k in keyframes if k > frame), default=self.session.n_frames - 1)
        self.track(range(first, last + 1), (person,))

    def track(self, frames: range, people: tuple[int, ...]) -> None:
        """Track people again."""
        with open_stored_session(self.session) as opened:
            opened.track(TrackPlan(frames, people, self.settings), ProgressSink(None))


def unit_of(model, unit: str) -> tuple[list[str], np.ndarray]:
    """Return the joints of a limb or of the trunk, and the degrees of freedom that move them."""
    known = correctable_joints(model)
    names = [n for n, u in zip(known.joints, known.unit_of, strict=True) if known.units[u] == unit]
    limb = next((x for x in limbs(model) if limb_display_name(x.name) == unit), None)
    return names, ~np.any([x.dofs for x in limbs(model)], axis=0) if limb is None else limb.dofs


def proposed(at: Annotator) -> Action | None:
    """Return what `quadrille next` proposes."""
    found = at.proposals()
    names = [c.camera.name for c in at.session.cameras]
    if not found.clicks:
        return None
    click = found.clicks[0]
    return Action(click.frame, click.person, click.limb, tuple(names.index(v) for v in click.views))


def most_doubtful(at: Annotator) -> Action | None:
    """Return the limb that is most likely lost of all that are no keyframes, in the first two views."""
    best, out = 0.0, None
    for person, own in enumerate(at.poses()):
        model = at.session.people[person].model
        for frame, pose in own.items():
            for limb, p in zip(limbs(model), pose.record.limbs_lost, strict=False):
                name = limb_display_name(limb.name)
                if not pose.record.keyframe and p > best and unit_of(model, name)[0]:
                    best, out = p, Action(frame, person, name, (0, 1))
    return out


def followed(at: Annotator, choose: Callable[[Annotator], Action | None], most: int, goes_on: bool) -> None:
    """Correct what is chosen until the recording is good, until nothing is chosen, or at most so often."""
    at.measure()
    while at.actions < most and (goes_on or not at.is_good):
        action = choose(at)
        if action is None:
            break
        at.correct(action)
        at.track_beside(action.person, action.frame)
        at.measure()


def spread(at: Annotator, n: int) -> None:
    """Correct everything on keyframes at equal distances, and track all."""
    frames = np.linspace(0, at.session.n_frames, n + 2).round().astype(int)[1:-1]
    for person, who in enumerate(at.session.people):
        for frame in frames:
            for unit in correctable_joints(who.model).units:
                at.correct(Action(int(frame), person, unit, (0, 1)))
    at.track(range(at.session.n_frames), tuple(range(len(at.session.people))))
    at.measure()


def cells(curve: Sequence[Measured], target_mm: float, end: str = "") -> list[str]:
    """Return the cells of a row."""
    good = [m.actions for m in curve if m.mean_mm <= target_mm and m.n_lost == 0]
    of_shown = []
    for n in SHOWN:
        now = [m for m in curve if m.actions == n]
        of_shown.append(f"{now[0].mean_mm:.1f} / {now[0].n_lost}" if now else "")
    return [str(good[0]) if good else f"> {curve[-1].actions}", *of_shown, end]


def rows_of(folder: Path, references: list[Path], seed: int, most: int) -> dict[str, list[str]]:
    """Annotate copies of a session in all ways."""
    out, (name, *plain) = {}, folder.name.replace("_", " ").split("@")
    name += ", first pass alone" * bool(plain)
    with tempfile.TemporaryDirectory() as scratch:
        new = Annotator(Path(shutil.copytree(folder, Path(scratch) / "new")), references, seed, bool(plain))
        new.track(range(new.session.n_frames), tuple(range(len(new.session.people))))  # by the program as it is now

        def begin(way: str) -> Annotator:
            at = Path(shutil.copytree(new.folder, Path(scratch) / way))
            return Annotator(at, references, seed, bool(plain))

        at = begin("next")
        followed(at, proposed, most, True)
        found, last = at.proposals(), at.curve[-1]
        low, high = found.interval_mm
        end = f"{last.actions}, {last.mean_mm:.1f}; expected {found.error_mm:.1f} ({low:.1f} to {high:.1f})"
        out[f"{name}: next"] = cells(at.curve, at.target_mm, end)
        print(f"{name}: next: {at.curve}", flush=True)
        start = at.curve[0]
        at = begin("doubts")
        followed(at, most_doubtful, most, False)
        end = f"{at.curve[-1].actions}, {at.curve[-1].mean_mm:.1f}"
        out[f"{name}: doubts"] = cells(at.curve, at.target_mm, end)
        print(f"{name}: doubts: {at.curve}", flush=True)
        curve = [start]
        for n in EQUAL if most == MAX_ACTIONS else ():
            if curve[-1].mean_mm <= at.target_mm and curve[-1].n_lost == 0:
                break
            at = begin(f"equal-{n}")
            spread(at, n)
            curve += at.curve
        end = f"{curve[-1].actions}, {curve[-1].mean_mm:.1f}"
        if most == MAX_ACTIONS:
            out[f"{name}: equal distances"] = cells(curve, at.target_mm, end)
            print(f"{name}: equal distances: {curve}", flush=True)
    return out


def main() -> None:
    """Annotate all recordings, and write the table."""
    scenes = "folder of the simulated recordings"
    parser = benchmark_parser(__doc__, ["data"], data="folder of the recordings", scenes=scenes)
    parser.add_argument("sessions", type=Path, nargs="+")
    parser.add_argument("--most", type=int, default=MAX_ACTIONS, help="actions; with fewer, no equal distances")
    parser.add_argument("--seed", type=int, default=0, help="of the hand that corrects the first session")
    given = read_words(parser, TABLES)
    rows: dict[str, list[str]] = {}
    for seed, folder in enumerate(given.sessions, given.seed):
        references = references_of(folder.name, given.data, given.scenes)
        rows |= rows_of(folder, references, seed, given.most)
    show(given.write, TABLES[0], CONDITIONS, table(HEADS, rows, "recording"))


if __name__ == "__main__":
    main()
