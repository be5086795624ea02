"""Track a recording: find the person, acquire the sizes of the body, track, and write the joints."""

import sys

import tracker


def main(folder: str, out: str) -> None:
    """Track a session and write its joints as TRC."""
    found = tracker.find(folder)
    print(*found.sentences, sep="\n")
    done = tracker.track(folder, acquire_sizes=True, progress=lambda stage, share: None)
    print(f"{done.frames} frames tracked from frame {done.first_frame}: {done.statuses}")
    tracker.export(folder, out, overwrite=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
