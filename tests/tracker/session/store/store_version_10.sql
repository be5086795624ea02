BEGIN TRANSACTION;
CREATE TABLE alternatives (                                      -- poses about as good as that of a change
    change INTEGER NOT NULL REFERENCES pose_changes, rank INTEGER NOT NULL,
    model_revision INTEGER NOT NULL REFERENCES model_revisions,
    numbers BLOB NOT NULL,                                       -- little-endian float64
    cost_px REAL, checksum INTEGER, PRIMARY KEY (change, rank)
) WITHOUT ROWID;
CREATE TABLE comments (uid TEXT PRIMARY KEY, about TEXT NOT NULL, person TEXT NOT NULL, frame INTEGER NOT NULL, limb TEXT NOT NULL, text TEXT NOT NULL, resolved INTEGER NOT NULL, author TEXT NOT NULL, time TEXT NOT NULL, checksum INTEGER) WITHOUT ROWID;
CREATE TABLE contents (name TEXT PRIMARY KEY, n_rows INTEGER NOT NULL, total INTEGER NOT NULL) WITHOUT ROWID;
INSERT INTO "contents" VALUES('alternatives',0,0);
INSERT INTO "contents" VALUES('comments',0,0);
INSERT INTO "contents" VALUES('edits',1,403324840);
INSERT INTO "contents" VALUES('head',1,451421352);
INSERT INTO "contents" VALUES('model_revisions',1,1312425224);
INSERT INTO "contents" VALUES('moves',0,0);
INSERT INTO "contents" VALUES('pin_changes',0,0);
INSERT INTO "contents" VALUES('pins',0,0);
INSERT INTO "contents" VALUES('pose_changes',1,2738353290);
INSERT INTO "contents" VALUES('poses',1,1987096191);
INSERT INTO "contents" VALUES('program_settings',1,2457285803);
INSERT INTO "contents" VALUES('settings',1,554230464);
INSERT INTO "contents" VALUES('sqlite_master',19,46106162216);
INSERT INTO "contents" VALUES('task_states',1,712090618);
INSERT INTO "contents" VALUES('tasks',2,4428232957);
CREATE TABLE edits (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    parent INTEGER REFERENCES edits,          -- NULL for the first
    label TEXT NOT NULL, author TEXT NOT NULL, time TEXT NOT NULL, program TEXT NOT NULL,
    uid TEXT                                                     -- the same in all copies of the store
, checksum INTEGER);
INSERT INTO "edits" VALUES(1,NULL,'Drag left wrist','eve','2026-11-28T06:27:05.534440+00:00','1.0.0','faab47a497e7a387beadc4d90c529e11',403324840);
CREATE TABLE head (edit INTEGER REFERENCES edits, checksum INTEGER);
INSERT INTO "head" VALUES(1,451421352);
CREATE TABLE model_revisions (
    id INTEGER PRIMARY KEY AUTOINCREMENT, person TEXT NOT NULL, toml TEXT NOT NULL, time TEXT NOT NULL
, checksum INTEGER);
INSERT INTO "model_revisions" VALUES(1,'ann','body v10','2026-11-28T06:27:05.510507+00:00',1312425224);
CREATE TABLE moves (                                             -- undo and redo, as they happened
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    kind TEXT NOT NULL, edit INTEGER NOT NULL REFERENCES edits, time TEXT NOT NULL
, checksum INTEGER);
CREATE TABLE pin_changes (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    edit INTEGER NOT NULL REFERENCES edits,
    previous INTEGER REFERENCES pin_changes,
    person TEXT NOT NULL, frame INTEGER NOT NULL, point TEXT NOT NULL, camera TEXT NOT NULL,
    u REAL, v REAL                                               -- original pixels; NULL: cleared
, checksum INTEGER);
CREATE TABLE pins (
    person TEXT, frame INTEGER, point TEXT, camera TEXT, change INTEGER NOT NULL REFERENCES pin_changes, checksum INTEGER,
    PRIMARY KEY (person, frame, point, camera)
) WITHOUT ROWID;
CREATE TABLE pose_changes (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    edit INTEGER NOT NULL REFERENCES edits,
    previous INTEGER REFERENCES pose_changes,                    -- what the frame showed before; NULL: nothing
    person TEXT NOT NULL, frame INTEGER NOT NULL,
    numbers BLOB,                                                -- little-endian float64; NULL: cleared
    sources BLOB, keyframe INTEGER, status TEXT, cost_px REAL,
    model_revision INTEGER REFERENCES model_revisions,
    settings TEXT,                                               -- of versions 1 and 2; NULL since
    views_px BLOB, parts_px BLOB,                                -- little-endian float64, NaN: unknown; NULL: none
    remark TEXT,
    program_settings INTEGER REFERENCES program_settings,
    reviewed INTEGER,                                            -- NULL: written before version 4, not reviewed
    limbs BLOB,                                                  -- like views_px: probability that a limb is lost
    errors BLOB,                                                 -- little-endian float32: upper triangles, m^2
    made_in INTEGER REFERENCES edits,                            -- of a pose that was only assessed: who made it
    trace TEXT                                                   -- searches on the frame; NULL: not known
, checksum INTEGER);
INSERT INTO "pose_changes" VALUES(1,1,NULL,'ann',1,X'000000000000F03F0000000000000040',X'0000',1,'',NULL,1,NULL,NULL,NULL,'',1,0,NULL,NULL,NULL,NULL,2738353290);
CREATE TABLE poses (
    person TEXT, frame INTEGER, change INTEGER NOT NULL REFERENCES pose_changes, checksum INTEGER, PRIMARY KEY (person, frame)
) WITHOUT ROWID;
INSERT INTO "poses" VALUES('ann',1,1,1987096191);
CREATE TABLE program_settings (                                  -- shared by the poses that were made with them
    id INTEGER PRIMARY KEY, settings TEXT NOT NULL UNIQUE
, checksum INTEGER);
INSERT INTO "program_settings" VALUES(1,'{}',2457285803);
CREATE TABLE settings (key TEXT PRIMARY KEY, value TEXT NOT NULL, checksum INTEGER) WITHOUT ROWID;
INSERT INTO "settings" VALUES('store_id','"a34cd5ffb47edbda"',554230464);
CREATE TABLE task_states (uid TEXT PRIMARY KEY, task TEXT NOT NULL, state TEXT NOT NULL, comment TEXT NOT NULL, author TEXT NOT NULL, time TEXT NOT NULL, checksum INTEGER) WITHOUT ROWID;
INSERT INTO "task_states" VALUES('811d78a182d05fa7d7a32e1e4a68d7ab','915b2c1ed6f575030d76a7c398cd916b','verified','','rita','2026-11-28T06:27:05.600003+00:00',712090618);
CREATE TABLE tasks (uid TEXT PRIMARY KEY, kind TEXT NOT NULL, person TEXT NOT NULL, frame INTEGER NOT NULL, annotator TEXT NOT NULL, author TEXT NOT NULL, time TEXT NOT NULL, checksum INTEGER) WITHOUT ROWID;
INSERT INTO "tasks" VALUES('915b2c1ed6f575030d76a7c398cd916b','plan','ann',1,'','eve','2026-11-28T06:27:05.570199+00:00',987173839);
INSERT INTO "tasks" VALUES('aa72b2d1e1360f22bdb8c0e5b9eef57c','plan','ann',2,'eve','eve','2026-11-28T06:27:05.570199+00:00',3441059118);
CREATE INDEX edits_parent ON edits (parent);
CREATE INDEX pose_changes_edit ON pose_changes (edit);
CREATE INDEX pin_changes_edit ON pin_changes (edit);
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('model_revisions',1);
INSERT INTO "sqlite_sequence" VALUES('edits',1);
INSERT INTO "sqlite_sequence" VALUES('pose_changes',1);
COMMIT;
PRAGMA user_version = 10;
