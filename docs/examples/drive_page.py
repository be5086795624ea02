"""Drive the page from a notebook: serve a session in a thread, set a pose, and take a picture."""

import sys
from pathlib import Path

import quadrille


def main(folder: str, out: str) -> None:
    """Raise an arm of the first person, and save the picture of the first camera."""
    with quadrille.serve(folder) as page:
        print(f"the page is at {page.address}")
        session = page.session
        person = session.people[0]
        values = page.pose(person.name).copy()
        values[person.model.value_names.index("left_shoulder.abduction")] += 0.5
        page.set_pose(person.name, values)
        Path(out).write_bytes(page.png(session.camera_names[0]))


if __name__ == "__main__":
    main(*sys.argv[1:])
