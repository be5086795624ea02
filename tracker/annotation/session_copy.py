"""Write a session folder with the annotations of others: it appears whole or not at all."""

import os
import shutil
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from tracker.annotation.numbered_settings import Numbered, renumbered
from tracker.annotation.observation_copies import copy_observations
from tracker.files import sync_folder
from tracker.pipeline.calibration_revisions import follow_history
from tracker.session.folder import appearing, require_free, tidy_path
from tracker.session.session import CALIBRATION_FILE, Session, load_session, save_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.edit_log import EditLog


def write_session_copy(
    folder: Path, session: Session, log: EditLog, numbered: Numbered, observed: Sequence[Path]
) -> list[str]:
    """Write a session with the cameras and people of another one.

    Args:
        folder: to write; must not exist, or be empty.
        session: whose cameras, people and floor it gets; the calibration follows the log.
        log: the annotations, its settings those without numbers.
        numbered: the settings with numbers.
        observed: session folders whose imported observations are copied.

    Returns:
        Notes on observations of equal names with other content: those of a later folder get another name.

    Raises:
        SessionError: the folder is in use or cannot be written.
    """
    folder = tidy_path(folder)
    require_free(folder)
    with _appearing_on_disk(folder) as temporary:
        save_session(replace(session, folder=temporary))
        if (session.folder / CALIBRATION_FILE).exists():  # to the bit: writing rounds, and each rounding is a revision
            shutil.copyfile(session.folder / CALIBRATION_FILE, temporary / CALIBRATION_FILE)
        with AnnotationStore(temporary / session.annotations_path.name) as store:
            written = store.write_log(log)
            for key, value in renumbered(numbered, [e.uid for e in log.edits], log.done, written).items():
                store.set_setting(key, value)
            follow_history(load_session(temporary), store)
        return [note for source in observed for note in copy_observations(source, temporary)]


@contextmanager
def _appearing_on_disk(folder: Path) -> Generator[Path, None, None]:
    """Yield a folder as `appearing` does; what is written reaches the disk before the folder appears."""
    with appearing(folder) as temporary:
        yield temporary
        for path, _, names in os.walk(temporary):
            for name in names:
                with (Path(path) / name).open("rb") as file:
                    os.fsync(file.fileno())
    sync_folder(folder.parent)
