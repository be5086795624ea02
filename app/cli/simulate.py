"""`quadrille simulate`: make a session of a simulated recording."""

from pathlib import Path
from typing import Annotated, Literal

import tyro

from app.runtime.progress import Reporter


def command(
    out: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="OUT")],
    /,
    scene: str = "elbow_rotation",
    cameras: int = 4,
    frames: int = 50,
    seed: int = 0,
    masks: bool = False,
    body: Literal["skinned", "model"] = "skinned",
    size: tuple[int, int] = (640, 480),
    person: str = "",
    fisheye: tuple[str, ...] = (),
    room: str = "laboratory",
) -> None:
    """Make a session of a simulated recording with known truth.

    Args:
        out: folder to make.
        scene: motion of the person or the people.
        cameras: number of cameras.
        frames: number of frames.
        seed: seed of everything random.
        masks: write true masks too.
        body: skinned, a smooth body unlike the model; model, the very shapes that are fitted.
        size: width and height of the images, px, both even.
        person: who plays a scene of one person, such as child_6 or heavy_man; the usual adult by default.
        fisheye: names of cameras to give a fisheye lens of 120 degrees, such as FRONT; all for all of them.
        room: laboratory, full of things; studio, empty and gray; theater, dark.
    """
    from tracker.simulate import Simulation, simulate

    reporter = Reporter()
    with reporter.over(frames * cameras, "rendering") as tick:  # one tick per image
        simulation = Simulation(
            scene, cameras, frames, seed, size, body=body, masks=masks, person=person, fisheyes=fisheye, room=room
        )
        simulate(out, simulation, progress=lambda *_: tick())
    print(f"made {out}")
