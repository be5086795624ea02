"""The best poses that the footage shows near imported observations, tracked without a change of the session."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from tracker.estimation.tracking.tracker import TrackerSettings
from tracker.evidence.observer import Observer
from tracker.interchange.observations.stored import save_observations, source_path
from tracker.pipeline.chain import ChainPlan, Sink, StoredSession, run_chain
from tracker.pipeline.find_people import FindSettings
from tracker.pipeline.keypoint_evidence import assigned_observations
from tracker.pipeline.stored_run import TrackPlan
from tracker.session.session import Session, create_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.stored_poses import StoredPose, read_stored_poses


def best_motion(
    session: Session, observer: Observer, name: str, people: tuple[int, ...], settings: TrackerSettings, sink: Sink
) -> dict[int, dict[int, StoredPose]]:
    """Track people from the key points' start, with acquired sizes, by contours and key points together.

    Everything is stored in a temporary folder; the session stays as it is.

    Args:
        session: the session.
        observer: of its recording.
        name: of the observations.
        people: indices of the people.
        settings: of the tracker.
        sink: receives progress. An exception that it raises ends the work.

    Returns:
        The poses of each person, by index and frame.

    Raises:
        TrackerError: see `run_chain`.
    """
    with TemporaryDirectory(prefix="quadrille-judge-") as folder:
        twin = create_session(
            Path(folder) / "judged", cameras=session.cameras, people=session.people, fps=session.fps,
            n_frames=session.n_frames, up=session.up,
        )  # fmt: skip
        twin = replace(twin, floor=session.floor)
        observations = assigned_observations(session, name)
        files = {s.path: source_path(session, name, s) for s in observations.sources}
        save_observations(twin, observations, files)
        plan = ChainPlan(
            TrackPlan(range(session.n_frames), people, settings, keypoints=name), FindSettings(keypoints=name), people
        )
        with AnnotationStore(twin.annotations_path) as store:
            opened = StoredSession(twin, store, observer)
            run_chain(plan, opened, sink)
        bodies = opened.session.people
        return {i: read_stored_poses(twin.annotations_path, bodies[i].name, bodies[i].model) for i in people}
