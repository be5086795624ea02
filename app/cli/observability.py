"""`quadrille observability`: how well the cameras constrain each degree of freedom, and where one more would help."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from app.cli.arguments import OptionalName, OptionalRange, OptionalWhole, SessionArg
from app.cli.target import Target, load_target, parse_frames
from app.runtime.json_output import format_json
from tracker.errors import SessionError, TrackerError

if TYPE_CHECKING:
    from tracker.body.model import BodyModel, PosedBody
    from tracker.estimation.fitting.observability import Observability
    from tracker.geometry.arrays import Array, IntArray
    from tracker.geometry.cameras import Camera

_MAX_FRAMES = 50
"""Frames of a range that are looked at, evenly spread; poses of neighbouring frames are alike."""
_N_POSITIONS = 3
"""Positions of another camera that are printed."""


@dataclass(frozen=True)
class ObservabilityArguments:
    """Arguments of `quadrille observability`."""

    session: SessionArg
    """session folder."""
    frame: OptionalWhole = None
    """one frame, with a sentence for each degree of freedom; the first posed frame by default."""
    frames: OptionalRange = None
    """A:B, half open: medians over these frames instead."""
    person: OptionalName = None
    """name; needed in a session of several people."""
    another_camera: bool = False
    """also answer where one more camera would help most."""
    json: bool = False
    """print one JSON object."""


def command(arguments: Annotated[ObservabilityArguments, tyro.conf.arg(name="")]) -> None:
    """Show how well the cameras constrain each degree of freedom of a stored pose.

    The standard deviations follow from the contours of the posed body in the views, with the noise of real contours.
    No image is read.
    """
    at = load_target(arguments.session, arguments.person, several=False)
    if arguments.frame is not None and arguments.frames is not None:
        raise TrackerError("expected --frame or --frames, found both; leave one out")
    found = observability(at, arguments.frame, arguments.frames, arguments.another_camera)
    print(format_json(found) if arguments.json else _format(found))


def observability(at: Target, frame: int | None, frames: str | None, another_camera: bool = False) -> dict[str, Any]:
    """Return what the views tell of one person's stored poses.

    Raises:
        SessionError: there is no stored pose.
        TrackerError: the frames are not within the session.
    """
    from tracker.estimation.fitting.observability import observe_pose
    from tracker.geometry.ground_plane import up_rotation

    session, (index,) = at
    wanted = range(frame, frame + 1) if frame is not None else parse_frames(frames, session)
    scenes = _scenes(at, wanted)
    if not scenes:
        where = f"frame {frame}" if frame is not None else "the frames" if frames else "the session"
        raise SessionError(
            f"expected a stored pose of '{session.people[index].name}' in {where}, found none; "
            "place the body in the page, or use init and track"
        )
    if frames is None:
        scenes = dict([next(iter(scenes.items()))])
    cameras, person = _working_cameras(at), 0  # the person comes first
    found = {k: observe_pose(bodies, cameras, person) for k, bodies in scenes.items()}
    out = _summary(session.people[index].name, scenes, cameras, found)
    if another_camera:
        out["another_camera"] = _another_camera(
            list(scenes.values()), cameras, up_rotation(session.up, session.floor)[:, 2]
        )
    return out


def _scenes(at: Target, wanted: range) -> "dict[int, list[PosedBody]]":
    """Return the bodies of some frames on which the person has a pose, the person first."""
    from tracker.session.store.stored_poses import read_stored_poses

    session, (index,) = at
    people = [session.people[index], *(p for i, p in enumerate(session.people) if i != index)]
    poses = [read_stored_poses(session.annotations_path, p.name, p.model, wanted) for p in people]
    posed = sorted(poses[0])
    posed = posed[:: -(-len(posed) // _MAX_FRAMES)] if posed else []
    return {k: [of_one[k].body for of_one in poses if k in of_one] for k in posed}


def _working_cameras(at: Target) -> "list[Camera]":
    from tracker.evidence.images.working_view import working_scale

    return [s.camera.pinhole.scaled(working_scale(s.camera)) for s in at.session.cameras]


def _summary(
    name: str, scenes: "dict[int, list[PosedBody]]", cameras: "list[Camera]", found: "dict[int, Observability]"
) -> dict[str, Any]:
    import numpy as np

    from tracker.estimation.fitting.observability_reasons import describe_all

    first = next(iter(found))
    model = scenes[first][0].model
    # Bodies of other frames may have other sizes, but the same degrees of freedom.
    alike = [o for o in found.values() if o.model.dof_names == model.dof_names]
    sigmas = np.median([o.sigmas for o in alike], axis=0)
    shares = np.mean([o.is_observable for o in alike], axis=0)
    votes = np.array([o.best_views for o in alike])
    best = [int(np.bincount(column).argmax()) for column in votes.T]
    sentences = describe_all(scenes[first], cameras, found[first]) if len(found) == 1 else None
    return {
        "person": name,
        "frames": list(found),
        "rank": min(o.rank for o in alike),
        "dofs": [
            {
                "name": dof,
                "unit": "m" if model.dof_is_length[i] else "rad",
                "sigma": float(sigmas[i]),
                "observable": float(shares[i]),
                "best_view": cameras[best[i]].name,
                **({} if sentences is None else {"sentence": sentences[i]}),
            }
            for i, dof in enumerate(model.dof_names)
        ],
    }


def _another_camera(frames: "list[list[PosedBody]]", cameras: "list[Camera]", up: "Array") -> list[dict[str, Any]]:
    import numpy as np

    from tracker.estimation.fitting.added_camera import rank_added_cameras

    model: BodyModel = frames[0][0].model
    alike = [f for f in frames if f[0].model.dof_names == model.dof_names]
    return [
        {
            "position_m": [float(v) for v in c.camera.center_world],
            "direction_deg": float(np.degrees(c.direction_rad)),
            "elevation_deg": float(np.degrees(c.elevation_rad)),
            "mean_before_deg": float(np.degrees(c.mean_before)),
            "mean_after_deg": float(np.degrees(c.mean_after)),
            "largest_before_deg": float(np.degrees(c.largest_before)),
            "largest_after_deg": float(np.degrees(c.largest_after)),
            "gains_most": [model.dof_names[int(i)] for i in _largest_gains(c.gains, model)],
        }
        for c in rank_added_cameras(alike, cameras, up)
    ]


def _largest_gains(gains: "Array", model: "BodyModel") -> "IntArray":
    import numpy as np

    return np.argsort(np.where(model.dof_is_length, -np.inf, gains))[::-1][:3]


def _format(found: dict[str, Any]) -> str:
    frames = found["frames"]
    head = f"frame {frames[0]}" if len(frames) == 1 else f"medians over {len(frames)} frames"
    dofs = found["dofs"]
    seen = sum(d["observable"] > 0.5 for d in dofs)
    lines = [f"{found['person']}, {head}: {seen} of {len(dofs)} degrees of freedom observable, rank {found['rank']}"]
    for d in dofs:
        amount = f"{100 * d['sigma']:6.1f} cm " if d["unit"] == "m" else f"{57.29578 * d['sigma']:6.1f} deg"
        rest = d.get("sentence") or f"observable on {100 * d['observable']:.0f}%, most of all by view {d['best_view']}"
        lines.append(f"  {d['name'].replace('_', ' '):28} {amount}  {rest.partition(': ')[2] or rest}")
    for c in found.get("another_camera", [])[:_N_POSITIONS]:
        x, y, z = c["position_m"]
        lines.append(
            f"another camera at ({x:.1f}, {y:.1f}, {z:.1f}) m: mean {c['mean_before_deg']:.1f} to "
            f"{c['mean_after_deg']:.1f} deg, largest {c['largest_before_deg']:.1f} to {c['largest_after_deg']:.1f}; "
            f"most for {', '.join(n.replace('_', ' ').replace('.', ' ') for n in c['gains_most'])}"
        )
    return "\n".join(lines)
