BEGIN TRANSACTION;
CREATE TABLE alternatives (                                      -- poses about as good as that of a change
    change INTEGER NOT NULL REFERENCES pose_changes, rank INTEGER NOT NULL,
    model_revision INTEGER NOT NULL REFERENCES model_revisions,
    numbers BLOB NOT NULL,                                       -- little-endian float64
    cost_px REAL, checksum INTEGER, PRIMARY KEY (change, rank)
) WITHOUT ROWID;
CREATE TABLE contents (name TEXT PRIMARY KEY, n_rows INTEGER NOT NULL, total INTEGER NOT NULL) WITHOUT ROWID;
INSERT INTO "contents" VALUES('alternatives',0,0);
INSERT INTO "contents" VALUES('edits',2,1630042838);
INSERT INTO "contents" VALUES('head',1,414096113);
INSERT INTO "contents" VALUES('model_revisions',1,2829825540);
INSERT INTO "contents" VALUES('moves',0,0);
INSERT INTO "contents" VALUES('pin_changes',0,0);
INSERT INTO "contents" VALUES('pins',0,0);
INSERT INTO "contents" VALUES('pose_changes',3,5844708043);
INSERT INTO "contents" VALUES('poses',3,3488929160);
INSERT INTO "contents" VALUES('program_settings',2,2639650033);
INSERT INTO "contents" VALUES('settings',1,705386688);
INSERT INTO "contents" VALUES('sqlite_master',16,40107350854);
CREATE TABLE edits (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    parent INTEGER REFERENCES edits,          -- NULL for the first
    label TEXT NOT NULL, author TEXT NOT NULL, time TEXT NOT NULL, program TEXT NOT NULL
, checksum INTEGER);
INSERT INTO "edits" VALUES(1,NULL,'pose','','2026-11-26T18:58:47.810+00:00','0.1.0',736388128);
INSERT INTO "edits" VALUES(2,1,'track','','2026-11-26T18:58:48.009+00:00','0.1.0',893654710);
CREATE TABLE head (edit INTEGER REFERENCES edits, checksum INTEGER);
INSERT INTO "head" VALUES(2,414096113);
CREATE TABLE model_revisions (
    id INTEGER PRIMARY KEY AUTOINCREMENT, person TEXT NOT NULL, toml TEXT NOT NULL, time TEXT NOT NULL
, checksum INTEGER);
INSERT INTO "model_revisions" VALUES(1,'ann','model','2026-11-26T18:58:47.785+00:00',2829825540);
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
    limbs BLOB                                                   -- like views_px: probability that a limb is lost
, checksum INTEGER);
INSERT INTO "pose_changes" VALUES(1,1,NULL,'ann',1,X'000000000000F83F0000000000000040',X'0000',1,'',NULL,1,NULL,NULL,NULL,'',1,0,NULL,549682505);
INSERT INTO "pose_changes" VALUES(2,2,NULL,'ann',2,X'00000000000004400000000000000040',X'0404',0,'lost',2.0,1,NULL,X'000000000000F03F000000000000F87F',X'000000000000E03F','left arm uncertain',2,0,X'000000000000E03F7B14AE47E17A843F',3136232650);
INSERT INTO "pose_changes" VALUES(3,2,NULL,'ann',3,X'0000000000000C400000000000000040',X'0404',0,'doubtful',2.0,1,NULL,X'000000000000F03F000000000000F87F',X'000000000000E03F','left arm uncertain',2,0,X'000000000000E03F7B14AE47E17A843F',2158792888);
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
INSERT INTO "program_settings" VALUES(2,'{"step_deg": 7}',182364230);
CREATE TABLE settings (key TEXT PRIMARY KEY, value TEXT NOT NULL, checksum INTEGER) WITHOUT ROWID;
INSERT INTO "settings" VALUES('store_id','"621a9aeb8d7da9dc"',705386688);
CREATE INDEX edits_parent ON edits (parent);
CREATE INDEX pose_changes_edit ON pose_changes (edit);
CREATE INDEX pin_changes_edit ON pin_changes (edit);
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('model_revisions',1);
INSERT INTO "sqlite_sequence" VALUES('edits',2);
INSERT INTO "sqlite_sequence" VALUES('pose_changes',3);
PRAGMA user_version = 7;
COMMIT;
