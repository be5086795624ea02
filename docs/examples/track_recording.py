"""Track a recording: find the person, acquire the sizes of the body, track, and write the joints."""

import sys

import quadrille


def main(folder: str, out: str) -> None:
    """Track a session and write its joints as TRC."""
    found = quadrille.find(folder)
    print(*found.sentences, sep="\n")
    done = quadrille.track(folder, acquire_sizes=True, progress=lambda stage, share: None)
    print(f"{done.frames} frames tracked from frame {done.first_frame}: {done.statuses}")
    quadrille.export(folder, out, overwrite=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
