"""Make a demo that needs no installation: `python tests/recipes/demo.py OUT`, or `make demo`.

OUT/index.html opens from a file or from any web server: a tango placed by hand, a man walking whom the program found by
itself, and a dance filmed by three cameras without empty backgrounds, with the doubts of its run. All is simulated.
"""

import argparse
import html
import shutil
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from tracker.session.session import load_session, save_session

ROOT = Path(__file__).resolve().parents[2]
TANGO = ROOT / "sample_sessions" / "tango"
PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8" />
<meta name="viewport" content="width=device-width, initial-scale=1" />
<link rel="icon" href="data:," />
<title>Quadrille: what it does, without installing it</title>
<style>
  :root {{ color-scheme: dark light; font: 16px/1.5 system-ui, sans-serif; }}
  body {{ max-width: 60rem; margin: 3rem auto; padding: 0 1rem; }}
  ul {{ display: grid; grid-template-columns: repeat(auto-fit, minmax(16rem, 1fr)); gap: 1.5rem; }}
  ul {{ padding: 0; list-style: none; }}
  img {{ width: 100%; border-radius: 6px; display: block; }}
  a {{ color: inherit; }}
</style>
<h1>Quadrille</h1>
<p>Bodies in 3-D from several calibrated cameras. Each page below has the views, the bodies and curves of one recording:
drag the 3-D view, press Space to play, and click a doubt to see it. All people are simulated.</p>
<ul>
{cards}
</ul>
</html>
"""
CARD = """<li><a href="{name}/index.html"><img src="{picture}" alt="" /><strong>{title}</strong></a><br />{text}</li>"""


class Part(NamedTuple):
    """A recording of the demo."""

    name: str
    title: str
    text: str
    frame: int
    """The frame whose picture stands on the first page."""


PARTS = (
    Part("tango", "Tango", "Two people in a close hold, placed by hand on one frame and tracked.", 20),
    Part("walk", "Walk in place", "Found, measured and tracked with nobody's help.", 25),
    Part("doubts", "Dance with doubts", "Three cameras, no empty background: which limbs are unsure, and when.", 15),
)


def run(*words: object) -> None:
    """Run the command line; its output is that of the recipe."""
    subprocess.run([sys.executable, "-m", "quadrille", *map(str, words)], check=True)


def make_tango(folder: Path) -> None:
    """Track the bundled tango from the poses that a user's drags gave."""
    shutil.copytree(TANGO, folder)
    for person in ("woman", "man"):
        run("init", folder, "--method", "poses", "--poses", TANGO / f"first_pose_{person}.csv", "--person", person)
    run("track", folder)


def make_walk(folder: Path) -> None:
    """Film a man and track him from nothing."""
    run("simulate", folder, "--scene", "walk_in_place", "--frames", 50, "--seed", 3)
    run("track", folder, "--init", "auto", "--acquire")


def film_dance(folder: Path) -> None:
    """Film a dance by three cameras, without pictures of the empty room."""
    run("simulate", folder, "--scene", "dance", "--cameras", 3, "--frames", 40, "--seed", 5)
    session = load_session(folder)
    save_session(replace(session, cameras=tuple(replace(c, background=None) for c in session.cameras)))


def make_doubts(folder: Path) -> None:
    """Track the dance from its true first pose."""
    film_dance(folder)
    run("init", folder, "--method", "joints", "--joints", folder / "truth.trc")
    run("track", folder)


def make_demo(out: Path, parts: tuple[Part, ...] = PARTS) -> None:
    """Make the demo in a folder, which is replaced."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    cards = []
    with tempfile.TemporaryDirectory() as temporary:
        for part in parts:
            session = Path(temporary) / part.name
            {"tango": make_tango, "walk": make_walk, "doubts": make_doubts}[part.name](session)
            run("share", session, "--out", out / part.name, "--size", 8)
            picture = sorted((out / part.name / "pictures" / "0").iterdir())[part.frame].relative_to(out).as_posix()
            texts = {key: html.escape(value) for key, value in part._asdict().items() if isinstance(value, str)}
            cards.append(CARD.format(picture=picture, **texts))
    (out / "index.html").write_text(PAGE.format(cards="\n".join(cards)), "utf-8")
    print(f"open {out / 'index.html'} in a browser")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    make_demo(parser.parse_args().out.resolve())
