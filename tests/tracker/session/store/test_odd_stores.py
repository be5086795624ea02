"""A store from elsewhere may have right checksums and yet hold anything: it is refused by a sentence that names it."""

import re
import sqlite3
from contextlib import closing
from datetime import datetime
from itertools import product

import msgspec
import numpy as np
import pytest
from damage import altered, old_store, written_store

from tracker.errors import DamagedStoreError
from tracker.session.store import checksums, integrity, schema
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.connection import Connection
from tracker.session.store.edit_tree import now
from tracker.session.store.schema import VERSION
from tracker.validation import Time


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "annotations.sqlite"
    written_store(path)
    return path.read_bytes()


@pytest.fixture
def path(tmp_path, whole):
    path = tmp_path / "annotations.sqlite"
    path.write_bytes(whole)
    return path


def changed(path, *statements):
    """Change a store and compute its checksums again, as somebody can who knows the program."""
    with closing(sqlite3.connect(path)) as db:
        db.execute("PRAGMA writable_schema = ON")
        for statement in statements:
            db.execute(statement)
        if db.execute("PRAGMA user_version").fetchone() == (VERSION,):
            checksums.register(db)
            checksums.fill_in(db)
        db.commit()


FOREIGN = {
    "trigger": "CREATE TRIGGER gone AFTER INSERT ON poses BEGIN DELETE FROM poses; END",
    "endless trigger": "CREATE TRIGGER gone AFTER UPDATE ON head BEGIN INSERT INTO settings WITH RECURSIVE n (k) AS "
    "(SELECT 1 UNION ALL SELECT k + 1 FROM n) SELECT k, k FROM n; END",
    "view": "CREATE VIEW more AS SELECT * FROM poses",
    "table": "CREATE TABLE more (a)",
    "index": "CREATE INDEX more ON poses (abs(frame))",
    "check": "CREATE TABLE told (id INTEGER CHECK (id > 1))",
    "default": "CREATE TABLE told (id INTEGER DEFAULT (randomblob(9)))",
    "generated": "CREATE TABLE told (id INTEGER, b AS (id + 1))",
    "hidden in quotes": 'CREATE TABLE told (id INTEGER, "--" INTEGER CHECK (id > 1)\n)',
    "hidden in a comment": "CREATE TABLE told (id INTEGER /* -- */ CHECK (id > 1)\n)",
    "virtual": "CREATE VIRTUAL TABLE told USING fts5(a)",
    "replaced": "UPDATE sqlite_master SET sql = replace(sql, 'status TEXT', 'status TEXT CHECK (status > 1)')",
}


@pytest.mark.slow
@pytest.mark.parametrize("foreign", FOREIGN)
@pytest.mark.parametrize("read_only", [True, False])
def test_foreign_definitions_are_refused(path, foreign, read_only):
    try:
        changed(path, FOREIGN[foreign])
    except sqlite3.OperationalError as error:
        pytest.skip(f"this SQLite has no such thing: {error}")
    before = path.read_bytes()
    with pytest.raises(DamagedStoreError, match=r"its definitions are not as they were written: the .* is none of"):
        AnnotationStore(path, read_only=read_only)
    assert path.read_bytes() == before


@pytest.mark.parametrize("version", [1, 3, 6, 7, 8, 9])
def test_foreign_definitions_in_an_older_store(tmp_path, version):
    path = old_store(tmp_path / "annotations.sqlite", version)
    with closing(sqlite3.connect(path)) as db:
        assert integrity.foreign_definition(db) is None
    altered(path, "CREATE TRIGGER gone AFTER INSERT ON poses BEGIN DELETE FROM poses; END")
    with pytest.raises(DamagedStoreError, match="the trigger 'gone' is none of the program"):
        AnnotationStore(path)


def test_the_words_of_the_program_define_tables_alone():
    words, names = integrity._own_words()
    assert not words & {"SELECT", "CHECK", "DEFAULT", "AS", "GENERATED", "TRIGGER", "VIEW", "VIRTUAL", "COLLATE", "'"}
    assert names >= {*checksums.COLUMNS, "contents", "told"}
    assert all("CREATE" in text or "ALTER" in text or "INSERT" in text for text in schema.STATEMENTS if text.strip())


def blob(*numbers):
    return f"X'{np.array(numbers, '<f8').tobytes().hex()}'"


POSE = "UPDATE pose_changes SET {} WHERE person = 'ann' AND frame = 8"
TIME = "2026-11-27T09:30:00.000000+00:00"
ODD = [
    POSE.format("numbers = 'text'"), POSE.format("numbers = 7"), POSE.format("numbers = X'00'"),
    POSE.format("numbers = X''"), POSE.format(f"numbers = {blob(*[np.nan] * 40)}"),
    POSE.format(f"numbers = {blob(*[np.inf] * 40)}"), POSE.format(f"numbers = {blob(1, 2)}"),
    POSE.format("sources = 'manual'"), POSE.format("sources = X'FF'"), POSE.format("sources = X''"),
    POSE.format("sources = NULL"), POSE.format("status = 'fine'"), POSE.format("status = 3"),
    POSE.format("status = NULL"), POSE.format("cost_px = 'dear'"), POSE.format("cost_px = 9e999"),
    POSE.format("keyframe = 'yes'"), POSE.format("keyframe = NULL"), POSE.format("reviewed = 7"),
    POSE.format("views_px = X'0102'"), POSE.format("views_px = 'x'"), POSE.format("parts_px = 1.5"),
    POSE.format("limbs = X'01'"), POSE.format(f"limbs = {blob(np.nan)}"), POSE.format("remark = X'FF'"),
    POSE.format("model_revision = 99"), POSE.format("model_revision = NULL"),
    "UPDATE program_settings SET settings = 'no JSON' WHERE id = 2",
    "UPDATE program_settings SET settings = '[1]' WHERE id = 2",
    "UPDATE program_settings SET settings = X'FF' WHERE id = 2",
    "UPDATE edits SET label = X'FF'", "UPDATE edits SET author = X'FF'", "UPDATE edits SET time = X'00'",
    "UPDATE model_revisions SET toml = X'FF'", "UPDATE settings SET value = 'no JSON' WHERE key = 'locked'",
    "UPDATE settings SET value = X'FF' WHERE key = 'locked'",
    "UPDATE alternatives SET numbers = X'01'", "UPDATE alternatives SET cost_px = 'x'",
    "UPDATE alternatives SET model_revision = 'x'",
    "UPDATE pin_changes SET u = 'left'", "UPDATE pin_changes SET v = 9e999", "UPDATE pin_changes SET camera = X'FF'",
    "UPDATE edits SET parent = id", "UPDATE edits SET parent = 1 + id WHERE id = 1",
    "UPDATE pose_changes SET previous = id", "UPDATE pin_changes SET previous = 1 + id WHERE id = 1",
    "UPDATE poses SET frame = -4 WHERE frame = 8",
    "UPDATE pose_changes SET frame = 'x' WHERE frame = 8",
    "UPDATE pin_changes SET person = X'FF'", "UPDATE pose_changes SET made_in = 99", "UPDATE edits SET uid = NULL",
    "UPDATE edits SET uid = 'x'", "UPDATE edits SET uid = (SELECT uid FROM edits WHERE id = 1)",
    f"INSERT INTO tasks VALUES ('x', 'plan', 'ann', 1, '', '', '{TIME}', 0)",
    f"INSERT INTO tasks VALUES ('{'0' * 32}', 'plan', 'ann', -1, '', '', '{TIME}', 0)",
    f"INSERT INTO tasks VALUES ('{'0' * 32}', 'other', 'ann', 1, '', '', '{TIME}', 0)",
    f"INSERT INTO task_states VALUES ('{'0' * 32}', '{'0' * 32}', 'fine', '', '', '{TIME}', 0, NULL)",
    f"INSERT INTO task_states VALUES ('{'0' * 32}', '{'0' * 32}', 'verified', '', '', '{TIME}', 0, 'x')",
    f"INSERT INTO comments VALUES ('{'0' * 32}', '', 'ann', 1, '', X'FF', 0, '', '{TIME}', 0)",
]  # fmt: skip
TIMES = ["yesterday", "2026-02-30T10:00:00+00:00", "2026-11-27T10:00:00", "2026-11-27T10:00:00+01:00", ""]
OF_TIMES = [
    "UPDATE edits SET time = '{}'", "UPDATE moves SET time = '{}'", "UPDATE model_revisions SET time = '{}'",
    f"INSERT INTO tasks VALUES ('{'0' * 32}', 'plan', 'ann', 1, '', '', '{{}}', 0)",
    f"INSERT INTO task_states VALUES ('{'0' * 32}', '{'0' * 32}', 'verified', '', '', '{{}}', 0, NULL)",
    f"INSERT INTO comments VALUES ('{'0' * 32}', '', 'ann', 1, '', 'so', 0, '', '{{}}', 0)",
]  # fmt: skip


def read_all(path):
    """Read all that commands and the page read."""
    with AnnotationStore(path, read_only=True) as store:
        store.history()
        store.setting("locked")
        counts = store.value_counts()
        for name in ("ann", "bo"):
            for revision in store.model_revisions(name):
                store.require_fit(revision.id, 40, counts)
            for row in store.frames(name, range(-100, 1 << 31)):
                store.alternatives(name, row.frame)
                store.pins(name, row.frame)
            for record in store.poses(name, range(-100, 1 << 31)).values():
                store.model_revision(record.model_revision)
            store.former_poses(name, range(1 << 31))
            store.frame_poses(name, range(1 << 31))
        for edit in store.history():
            store.frames_of(edit.edit)
        store.read_log()


SETTINGS = {
    "store_id": [7, "", "a\u202eb", ["x"]],
    "locked": [[1], {"ann": "left_wrist.twist"}, {"ann": [1]}, {"": []}, None],
    "sizes_edits": [[1], {"x": []}, {"4": [["ann", 1]]}, {"4": [["ann", "1", 2]]}, {"4": [["ann", -1, 2]]}],
    "confirmed_keyframes": [[1], {"ann": [1]}, {"ann": {"x": 1}}, {"ann": {"3": "1"}}, {"ann": {"3": -1}}],
    "silhouette_axes": [[1], {}, {"frame": -1, "lines": {}}, {"frame": 1, "lines": {"a": [[[1, 2]]]}}],
    "find people": [[1], {"frame": "3", "done": []}, {"frame": 3, "done": ["sideways"]}, {"frame": 10**9, "done": []}],
    "former_floor": [
        "z",
        {"up": "w"},
        {"up": "z", "normal": [0, 1], "offset_m": 0},
        {"up": "z", "normal": [0, 1, 0]},
        {"up": "z", "normal": [0, 0, 0], "offset_m": 0},
    ],
    "unfinished track": [[1], {"task": []}, {"task": [0, 9, 10, [0], {}], "next": -3}, {"task": 3, "next": None}],
}
FLOOR = {"up": "z", "normal": [0.0, 0.0, 1.0], "offset_m": 0.1}
GOOD_SETTINGS = {
    "store_id": "3f", "locked": {"ann": ["x.y"]}, "sizes_edits": {"4": [["ann", 1, 2]], "5": ["ann", 1, 2]},
    "confirmed_keyframes": {"ann": {"3": 12}}, "silhouette_axes": {"frame": 1, "lines": {"a": [[[[1, 2], [3, 4]]]]}},
    "find people": {"frame": 3, "done": ["forward"]}, "former_floor": FLOOR, "unknown": {"any": [1]},
    "unfinished track": {"task": [0, 9, 10, [0], ["cam"], {"a": 1}], "next": 4, "rows": {"0": {"3": ["AA=="]}}},
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("name", "value"), [(name, value) for name, values in SETTINGS.items() for value in values])
def test_odd_settings_are_named(path, name, value):
    with AnnotationStore(path) as store:
        store.set_setting(name, GOOD_SETTINGS[name])
        assert store.setting(name) == GOOD_SETTINGS[name]
        store.set_setting(name, value)
        with pytest.raises(
            DamagedStoreError, match=rf"annotations .* are damaged: setting '{name}'.*expected"
        ) as caught:
            store.setting(name)
        assert str(caught.value).isprintable()


def test_settings_of_other_names_are_any_json(path):
    with AnnotationStore(path) as store:
        store.set_setting("unknown", GOOD_SETTINGS["unknown"])
        assert store.setting("unknown") == {"any": [1]}


@pytest.mark.slow
@pytest.mark.parametrize("statement", ODD)
def test_odd_rows_are_named(path, statement):
    read_all(path)
    changed(path, statement)
    with pytest.raises(DamagedStoreError) as caught:
        read_all(path)
    text = str(caught.value)
    assert re.match(rf"annotations {path} are damaged: ", text)
    assert text.isprintable()
    assert re.search(r"frame|row [\d']|edit |setting|revision|decoded", text), text
    assert len(text) < 500


@pytest.mark.parametrize("statement", OF_TIMES)
def test_odd_times_are_named(path, statement):
    """Times order edits and decisions, and are reckoned with."""
    changed(path, statement.format("yesterday"))
    with AnnotationStore(path, read_only=True) as store:
        with pytest.raises(DamagedStoreError, match=r"expected a time in UTC such as 20.*, found 'yesterday'"):
            store.read_log()
        if "edits" in statement:
            for read in (
                store.history, store.tasks.edit_times, store.tasks.keyframe_edits, store.tasks.makers_of_poses,
            ):  # fmt: skip
                with pytest.raises(DamagedStoreError, match="found 'yesterday'"):
                    read()


@pytest.mark.parametrize(
    "text", [*TIMES, "9999-12-31T23:59:59+00:00", f"{TIME}\n", "2026-11-27T24:00:00+00:00", TIME.replace("2", "\u0662")]
)
def test_a_time_is_one_in_utc(text):
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert(text, Time)
    assert msgspec.convert(now(), Time)


def test_each_day_of_the_calendar_is_a_time():
    """The days of years with and without a leap day, against Python's calendar."""
    for year, month, day in product((0, 1, 1900, 1970, 2000, 2026, 2028, 2100), range(14), range(33)):
        text = f"{year:04}-{month:02}-{day:02}T10:00:00.000+00:00"
        try:
            datetime.fromisoformat(text)
        except ValueError:
            with pytest.raises(msgspec.ValidationError):
                msgspec.convert(text, Time)
        else:
            assert msgspec.convert(text, Time) == text


@pytest.mark.slow
def test_a_query_without_end_is_stopped(path, monkeypatch):
    monkeypatch.setattr(integrity, "_FREE_STEPS", 1_000_000)
    with closing(Connection(path, read_only=True)) as connection:
        endless = "WITH RECURSIVE n (k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n) SELECT count(*) FROM n"
        with pytest.raises(DamagedStoreError, match="a query took more steps than its rows can need"):
            connection.all(endless, (), tuple)
        assert connection.all("SELECT 1", (), tuple) == [(1,)]


def test_a_signal_ends_a_long_query(path, monkeypatch):
    def stop():
        raise KeyboardInterrupt

    monkeypatch.setattr(integrity, "_FREE_STEPS", 0)
    with closing(sqlite3.connect(path)) as db, pytest.raises(KeyboardInterrupt), integrity.limited(db, stop):
        db.execute("WITH RECURSIVE n (k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n) SELECT count(*) FROM n").fetchall()


@pytest.mark.parametrize("n_frames", [300])
def test_queries_of_the_program_stay_far_below_the_limit(path, n_frames, monkeypatch):
    """A tenth of the steps per byte, and none for free, are enough to check and read a store."""
    monkeypatch.setattr(integrity, "_FREE_STEPS", 0)
    monkeypatch.setattr(integrity, "_STEPS_PER_BYTE", integrity._STEPS_PER_BYTE / 10)
    read_all(path)
