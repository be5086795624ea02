"""`quadrille observability`: how well the cameras constrain each degree of freedom, and where one more would help."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from app.cli.arguments import OptionalName, OptionalRange, OptionalWhole, SessionArg
from app.cli.target import Target, load_target, parse_frames
from app.remedies import command_line_text
from app.runtime.json_output import format_json
from tracker.errors import SessionError, TrackerError

if TYPE_CHECKING:
    from tracker.body.model import BodyModel, PosedBody
    from tracker.estimation.fitting.observability import Observability
    from tracker.geometry.arrays import Array
    from tracker.geometry.cameras import Camera

_MAX_FRAMES = 50
"""Frames of a range that are looked at, evenly spread; poses of neighbouring frames are alike."""
_SPREADS = ("mean_before", "mean_after", "largest_before", "largest_after")
"""Standard deviations of the angles without and with another camera, radians."""
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
    """name; all people with a pose by default."""
    another_camera: bool = False
    """also answer where one more camera would help most."""
    json: bool = False
    """print one JSON object."""


def command(arguments: Annotated[ObservabilityArguments, tyro.conf.arg(name="")]) -> None:
    """Show how well the cameras constrain each degree of freedom of a stored pose.

    The standard deviations follow from the contours of the posed body in the views, with the noise of real contours.
    No image is read.
    """
    at = load_target(arguments.session, arguments.person, several=True)
    if arguments.frame is not None and arguments.frames is not None:
        raise TrackerError("expected --frame or --frames, found both; leave one out")
    found, missing = list[dict[str, Any]](), list[SessionError]()
    for index in at.people:
        try:
            one = Target(at.session, (index,))
            found.append(observability(one, arguments.frame, arguments.frames, arguments.another_camera))
        except SessionError as error:
            missing.append(error)
    if not found:
        raise missing[0]
    if arguments.json:
        print(format_json(found[0] if len(at.people) == 1 else {"people": found}))
    else:
        print(*map(_format, found), *map(command_line_text, missing), sep="\n")


def observability(at: Target, frame: int | None, frames: str | None, another_camera: bool = False) -> dict[str, Any]:
    """Return what the views tell of one person's stored poses.

    Raises:
        SessionError: there is no stored pose.
        TrackerError: the frames are not within the session.
    """
    from tracker.estimation.fitting.observability import observe_pose
    from tracker.evidence.images.working_view import working_scale
    from tracker.geometry.ground_plane import up_rotation

    session, (index,) = at
    scenes = _scenes(at, range(frame, frame + 1) if frame is not None else parse_frames(frames, session))
    if not scenes:
        where = f"frame {frame}" if frame is not None else "the frames" if frames else "the session"
        raise SessionError(
            f"expected a stored pose of '{session.people[index].name}' in {where}, found none; "
            "place the body in the page, or use init and track"
        )
    if frames is None:
        scenes = dict([next(iter(scenes.items()))])
    cameras = [s.camera.pinhole.scaled(working_scale(s.camera)) for s in session.cameras]
    found = {k: observe_pose(bodies, cameras, 0) for k, bodies in scenes.items()}  # the person comes first
    out = _summary(session.people[index].name, scenes, cameras, found)
    if another_camera:
        up = up_rotation(session.up, session.floor)[:, 2]
        out["another_camera"] = _another_camera([*scenes.values()], cameras, up)
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
    best = [int(np.bincount(views).argmax()) for views in np.transpose([o.best_views for o in alike])]
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
            **{f"{name}_deg": float(np.degrees(getattr(c, name))) for name in _SPREADS},
            "gains_most": [model.dof_names[i] for i in np.argsort(np.where(model.dof_is_length, np.inf, -c.gains))[:3]],
        }
        for c in rank_added_cameras(alike, cameras, up)
    ]


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
