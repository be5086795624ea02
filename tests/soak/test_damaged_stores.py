"""Stores that were damaged in many ways are refused by one error, or show exactly what was written into them."""

from collections import Counter

import numpy as np
import pytest
from damage import damaged, shown, written_store

from tracker.errors import TrackerError
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PinChange

pytestmark = pytest.mark.slow


def test_a_damaged_store_is_refused_or_shows_what_was_written(tmp_path, cases, report, monkeypatch):
    for name in ("edit_tree.now", "annotation_store.edit_tree.now"):
        monkeypatch.setattr(f"tracker.session.store.{name}", lambda: "2026-03-01T10:00:00.000+00:00")
    monkeypatch.setattr("tracker.session.store.annotation_store.secrets.token_hex", lambda n: "ab" * n)
    path = tmp_path / "annotations.sqlite"
    written_store(path)
    older = path.read_bytes()
    with AnnotationStore(path) as store:
        store.commit("late pins", [PinChange("bo", f, "head", "front", (f, 1.0)) for f in range(40)])
    data = path.read_bytes()
    with AnnotationStore(path) as store:
        expected = shown(store)
    rng = np.random.default_rng(21)
    outcomes, uncaught, different, unclear = Counter(), [], [], []
    n = cases(500)
    for case in range(n):
        bytes_now, kind = damaged(data, older, rng)
        path.write_bytes(bytes_now)
        for backup in (tmp_path / "backups").glob("*"):
            backup.unlink()
        path.with_name(path.name + "-journal").unlink(missing_ok=True)
        try:
            with AnnotationStore(path, read_only=bool(case % 3 == 0)) as store:
                found = shown_or_read(store, case % 3 == 0, expected)
            outcomes["same"] += 1
            if found:
                different.append((case, kind))
        except TrackerError as error:
            outcomes["refused"] += 1
            unclear += [str(error)] if str(path) not in str(error) or ";" not in str(error) else []
        except Exception as error:
            uncaught.append((case, kind, repr(error)))
    report(
        f"{n} damaged stores: {outcomes['refused']} refused, {outcomes['same']} without effect on any row, "
        f"{len(uncaught)} uncaught exceptions, {len(different)} silently different"
    )
    assert uncaught == []
    assert different == []
    assert unclear == []  # each names the file and what to do


def shown_or_read(store, read_only, expected):
    """Whether a store shows other than expected; one that is only read cannot undo."""
    if not read_only:
        return shown(store) != expected
    return store.history() != expected[0]["history"] or any(
        store.pose(name, f).values.tobytes() != of[0]
        for name in ("ann", "bo")
        for (key, f), of in ((k, v) for k, v in expected[0].items() if isinstance(k, tuple) and isinstance(k[1], int))
        if key == name
    )
