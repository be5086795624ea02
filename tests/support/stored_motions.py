"""Sessions with random poses in the store: several people, gaps, lost frames, distorted views and a fisheye."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from fisheye import with_fisheye
from staging import cameras_around

from tracker.body.model import PosedBody
from tracker.footage.camera_source import CameraSource
from tracker.formats.model_toml import format_model
from tracker.session.session import Person, create_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange, PoseRecord

K1 = -0.3
FPS = 25.0


def distorted_cameras():
    """Three views of 640x480, two with barrel distortion and one of a fisheye lens."""
    first, second, third = cameras_around(3, size=(640, 480))
    return [*(replace(c, distortion=np.array([K1, 0.0, 0.0, 0.0])) for c in (first, second)), with_fisheye(third)]


def random_poses(model, n, seed, sigma_rad=0.5):
    """Poses within the joint limits in a smooth motion, (n, n_values)."""
    rng = np.random.default_rng(seed)
    sigma = np.where(model.dof_is_length, 0.2, sigma_rad)
    start, end = (sigma * rng.normal(size=model.n_dofs) for _ in range(2))
    shares = np.linspace(0.0, 1.0, n)
    return np.array([model.clip(model.retract(model.neutral(), start + t * (end - start))) for t in shares])


def put_poses(store, person, poses, source="manual", label="put", **more):
    """Store poses of a person by frame; `more` are further fields of each."""
    revision = store.add_model_revision(person.name, format_model(person.model))
    records = {k: PoseRecord(values, (source,) * len(values), revision, **more) for k, values in poses.items()}
    store.commit(label, [PoseChange(person.name, k, record) for k, record in records.items()])


def store_poses(session, poses, person=None, **more):
    """Store poses of a person, by default of the first one, in the annotations of a session; see `put_poses`."""
    with AnnotationStore(session.annotations_path) as store:
        put_poses(store, person or session.people[0], poses, **more)


def store_motion(folder, models, n_frames=8, gaps=(), lost=(), seed=0, up="z", names=("ann", "bob", "cid")):
    """Make a session of people with random poses.

    Args:
        folder: of the session.
        models: body of each person.
        n_frames: number of frames.
        gaps: (person, frame) without a pose.
        lost: (person, frame) whose status is lost.
        seed: of the poses.
        up: world axis that points up.
        names: of the people.

    Returns:
        The session and, for each person, the body by frame.
    """
    cameras = [CameraSource(c, Path(folder).parent / f"{c.name}.mp4") for c in distorted_cameras()]
    people = [Person(n, m, "#f2a33a") for n, m in zip(names, models, strict=False)]
    session = create_session(folder, cameras=cameras, people=people, fps=FPS, n_frames=n_frames, up=up)
    store = AnnotationStore(session.annotations_path)
    truth = []
    for i, person in enumerate(session.people):
        revision = store.add_model_revision(person.name, format_model(person.model))
        poses = random_poses(person.model, n_frames, 10 * seed + i)
        frames = [f for f in range(n_frames) if (i, f) not in gaps]
        changes = [
            PoseChange(
                person.name, f,
                PoseRecord(
                    poses[f], ("tracked",) * (len(poses[f]) - 1) + ("manual",), revision, keyframe=f == 1,
                    status="lost" if (i, f) in lost else "good", cost_px=2.5, view_costs_px=(1.0, None, 3.0),
                ),
            )
            for f in frames
        ]  # fmt: skip
        store.commit("Poses", changes)
        truth.append({f: PosedBody(person.model, poses[f]) for f in frames})
    store.close()
    return session, truth


def filmed(session, tmp_path):
    """Give each camera gray pictures with a bright dot at (150, 120); frame 0 of the session is their number 5."""
    cameras = []
    for source in session.cameras:
        folder = tmp_path / f"shots_{source.camera.name}"
        folder.mkdir()
        for i in range(5 + session.n_frames):
            picture = np.full((*source.camera.size[::-1], 3), 90, np.uint8)
            cv2.circle(picture, (150, 120), 4, (255, 255, 255), -1)
            cv2.imwrite(str(folder / f"{i:03d}.png"), picture)
        cameras.append(replace(source, footage=folder, offset=5))
    return replace(session, cameras=tuple(cameras))
