BEGIN TRANSACTION;
CREATE TABLE alternatives (                                      -- poses about as good as that of a change
    change INTEGER NOT NULL REFERENCES pose_changes, rank INTEGER NOT NULL,
    model_revision INTEGER NOT NULL REFERENCES model_revisions,
    numbers BLOB NOT NULL,                                       -- little-endian float64
    cost_px REAL, checksum INTEGER, PRIMARY KEY (change, rank)
) WITHOUT ROWID;
CREATE TABLE contents (name TEXT PRIMARY KEY, n_rows INTEGER NOT NULL, total INTEGER NOT NULL) WITHOUT ROWID;
INSERT INTO "contents" VALUES('alternatives',0,0);
INSERT INTO "contents" VALUES('edits',2,6016868536);
INSERT INTO "contents" VALUES('head',1,414096113);
INSERT INTO "contents" VALUES('model_revisions',1,2568500936);
INSERT INTO "contents" VALUES('moves',0,0);
INSERT INTO "contents" VALUES('pin_changes',0,0);
INSERT INTO "contents" VALUES('pins',0,0);
INSERT INTO "contents" VALUES('pose_changes',3,5568931416);
INSERT INTO "contents" VALUES('poses',3,3488929160);
INSERT INTO "contents" VALUES('program_settings',2,5155755384);
INSERT INTO "contents" VALUES('settings',1,1883703385);
INSERT INTO "contents" VALUES('sqlite_master',16,39481381863);
CREATE TABLE edits (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    parent INTEGER REFERENCES edits,          -- NULL for the first
    label TEXT NOT NULL, author TEXT NOT NULL, time TEXT NOT NULL, program TEXT NOT NULL
, checksum INTEGER);
INSERT INTO "edits" VALUES(1,NULL,'pose','eve','2026-11-27T00:04:10.932+00:00','0.1.0',1739880433);
INSERT INTO "edits" VALUES(2,1,'track','eve','2026-11-27T00:04:10.937+00:00','0.1.0',4276988103);
CREATE TABLE head (edit INTEGER REFERENCES edits, checksum INTEGER);
INSERT INTO "head" VALUES(2,414096113);
CREATE TABLE model_revisions (
    id INTEGER PRIMARY KEY AUTOINCREMENT, person TEXT NOT NULL, toml TEXT NOT NULL, time TEXT NOT NULL
, checksum INTEGER);
INSERT INTO "model_revisions" VALUES(1,'ann','model','2026-11-27T00:04:10.930+00:00',2568500936);
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
    errors BLOB                                                  -- little-endian float32: upper triangles, m^2
, checksum INTEGER);
INSERT INTO "pose_changes" VALUES(1,1,NULL,'ann',1,X'000000000000F03F0000000000000040',X'0000',1,'',NULL,1,NULL,NULL,NULL,'',1,0,NULL,NULL,3121689238);
INSERT INTO "pose_changes" VALUES(2,2,NULL,'ann',2,X'00000000000000400000000000000040',X'0404',0,'lost',NULL,1,NULL,NULL,NULL,'left arm uncertain',2,0,X'000000000000E03F7B14AE47E17A843F',X'000080400000803F000000000000A040000000400000C040',437577294);
INSERT INTO "pose_changes" VALUES(3,2,NULL,'ann',3,X'00000000000008400000000000000040',X'0404',0,'doubtful',NULL,1,NULL,NULL,NULL,'left arm uncertain',2,0,X'000000000000E03F7B14AE47E17A843F',X'000080400000803F000000000000A040000000400000C040',2009664884);
CREATE TABLE poses (
    person TEXT, frame INTEGER, change INTEGER NOT NULL REFERENCES pose_changes, checksum INTEGER, PRIMARY KEY (person, frame)
) WITHOUT ROWID;
INSERT INTO "poses" VALUES('ann',1,1,1987096191);
INSERT INTO "poses" VALUES('ann',2,2,452822892);
INSERT INTO "poses" VALUES('ann',3,3,1049010077);
CREATE TABLE program_settings (                                  -- shared by the poses that were made with them
    id INTEGER PRIMARY KEY, settings TEXT NOT NULL UNIQUE
, checksum INTEGER);
INSERT INTO "program_settings" VALUES(1,'{}',2457285803);
INSERT INTO "program_settings" VALUES(2,'{"step_deg": 5}',2698469581);
CREATE TABLE settings (key TEXT PRIMARY KEY, value TEXT NOT NULL, checksum INTEGER) WITHOUT ROWID;
INSERT INTO "settings" VALUES('store_id','"8cce279a22d1e8de"',1883703385);
CREATE INDEX edits_parent ON edits (parent);
CREATE INDEX pose_changes_edit ON pose_changes (edit);
CREATE INDEX pin_changes_edit ON pin_changes (edit);
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('model_revisions',1);
INSERT INTO "sqlite_sequence" VALUES('edits',2);
INSERT INTO "sqlite_sequence" VALUES('pose_changes',3);
PRAGMA user_version = 8;
COMMIT;
