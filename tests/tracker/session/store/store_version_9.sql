BEGIN TRANSACTION;
CREATE TABLE alternatives (                                      -- poses about as good as that of a change
    change INTEGER NOT NULL REFERENCES pose_changes, rank INTEGER NOT NULL,
    model_revision INTEGER NOT NULL REFERENCES model_revisions,
    numbers BLOB NOT NULL,                                       -- little-endian float64
    cost_px REAL, checksum INTEGER, PRIMARY KEY (change, rank)
) WITHOUT ROWID;
CREATE TABLE contents (name TEXT PRIMARY KEY, n_rows INTEGER NOT NULL, total INTEGER NOT NULL) WITHOUT ROWID;
INSERT INTO "contents" VALUES('alternatives',0,0);
INSERT INTO "contents" VALUES('edits',4,11743753011);
INSERT INTO "contents" VALUES('head',1,426569926);
INSERT INTO "contents" VALUES('model_revisions',1,2175359255);
INSERT INTO "contents" VALUES('moves',1,2876546277);
INSERT INTO "contents" VALUES('pin_changes',1,3596511927);
INSERT INTO "contents" VALUES('pins',1,105495174);
INSERT INTO "contents" VALUES('pose_changes',5,13356358543);
INSERT INTO "contents" VALUES('poses',3,1686864195);
INSERT INTO "contents" VALUES('program_settings',1,2457285803);
INSERT INTO "contents" VALUES('settings',1,4286974929);
INSERT INTO "contents" VALUES('sqlite_master',16,39767862684);
CREATE TABLE edits (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    parent INTEGER REFERENCES edits,          -- NULL for the first
    label TEXT NOT NULL, author TEXT NOT NULL, time TEXT NOT NULL, program TEXT NOT NULL
, checksum INTEGER);
INSERT INTO "edits" VALUES(1,NULL,'Drag left wrist','eve','2026-11-27T06:46:58.257+00:00','0.1.0',2732733806);
INSERT INTO "edits" VALUES(2,1,'track','','2026-11-27T06:46:58.262+00:00','0.1.0',3251403846);
INSERT INTO "edits" VALUES(3,2,'audit','','2026-11-27T06:46:58.263+00:00','0.1.0',2341012638);
INSERT INTO "edits" VALUES(4,3,'Drag right wrist','eve','2026-11-27T06:46:58.265+00:00','0.1.0',3418602721);
CREATE TABLE head (edit INTEGER REFERENCES edits, checksum INTEGER);
INSERT INTO "head" VALUES(3,426569926);
CREATE TABLE model_revisions (
    id INTEGER PRIMARY KEY AUTOINCREMENT, person TEXT NOT NULL, toml TEXT NOT NULL, time TEXT NOT NULL
, checksum INTEGER);
INSERT INTO "model_revisions" VALUES(1,'ann','body v9','2026-11-27T06:46:58.256+00:00',2175359255);
CREATE TABLE moves (                                             -- undo and redo, as they happened
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    kind TEXT NOT NULL, edit INTEGER NOT NULL REFERENCES edits, time TEXT NOT NULL
, checksum INTEGER);
INSERT INTO "moves" VALUES(1,'undo',4,'2026-11-27T06:46:58.266+00:00',2876546277);
CREATE TABLE pin_changes (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    edit INTEGER NOT NULL REFERENCES edits,
    previous INTEGER REFERENCES pin_changes,
    person TEXT NOT NULL, frame INTEGER NOT NULL, point TEXT NOT NULL, camera TEXT NOT NULL,
    u REAL, v REAL                                               -- original pixels; NULL: cleared
, checksum INTEGER);
INSERT INTO "pin_changes" VALUES(1,1,NULL,'ann',1,'left_wrist','cam_a',10.5,20.0,3596511927);
CREATE TABLE pins (
    person TEXT, frame INTEGER, point TEXT, camera TEXT, change INTEGER NOT NULL REFERENCES pin_changes, checksum INTEGER,
    PRIMARY KEY (person, frame, point, camera)
) WITHOUT ROWID;
INSERT INTO "pins" VALUES('ann',1,'left_wrist','cam_a',1,105495174);
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
INSERT INTO "pose_changes" VALUES(1,1,NULL,'ann',1,X'000000000000F83F0000000000000040',X'0000',1,'',NULL,1,NULL,NULL,NULL,'',1,1,NULL,NULL,NULL,NULL,49350111);
INSERT INTO "pose_changes" VALUES(2,2,NULL,'ann',2,X'00000000000004400000000000000040',X'0404',0,'lost',NULL,1,NULL,NULL,NULL,'',1,0,NULL,NULL,NULL,'[["limbs",["left_arm"],41.0,12.5,true]]',3627495104);
INSERT INTO "pose_changes" VALUES(3,2,NULL,'ann',3,X'0000000000000C400000000000000040',X'0404',0,'good',NULL,1,NULL,NULL,NULL,'',1,0,NULL,NULL,NULL,NULL,1333348245);
INSERT INTO "pose_changes" VALUES(4,3,1,'ann',1,X'000000000000F83F0000000000000040',X'0000',1,'good',NULL,1,NULL,NULL,NULL,'',1,1,NULL,NULL,1,NULL,4154924036);
INSERT INTO "pose_changes" VALUES(5,4,3,'ann',3,X'00000000000012400000000000000040',X'0000',1,'',NULL,1,NULL,NULL,NULL,'',1,0,NULL,NULL,NULL,NULL,4191241047);
CREATE TABLE poses (
    person TEXT, frame INTEGER, change INTEGER NOT NULL REFERENCES pose_changes, checksum INTEGER, PRIMARY KEY (person, frame)
) WITHOUT ROWID;
INSERT INTO "poses" VALUES('ann',1,4,185031226);
INSERT INTO "poses" VALUES('ann',2,2,452822892);
INSERT INTO "poses" VALUES('ann',3,3,1049010077);
CREATE TABLE program_settings (                                  -- shared by the poses that were made with them
    id INTEGER PRIMARY KEY, settings TEXT NOT NULL UNIQUE
, checksum INTEGER);
INSERT INTO "program_settings" VALUES(1,'{}',2457285803);
CREATE TABLE settings (key TEXT PRIMARY KEY, value TEXT NOT NULL, checksum INTEGER) WITHOUT ROWID;
INSERT INTO "settings" VALUES('store_id','"da7dd35ab06041fd"',4286974929);
CREATE INDEX edits_parent ON edits (parent);
CREATE INDEX pose_changes_edit ON pose_changes (edit);
CREATE INDEX pin_changes_edit ON pin_changes (edit);
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('model_revisions',1);
INSERT INTO "sqlite_sequence" VALUES('edits',4);
INSERT INTO "sqlite_sequence" VALUES('pose_changes',5);
INSERT INTO "sqlite_sequence" VALUES('pin_changes',1);
INSERT INTO "sqlite_sequence" VALUES('moves',1);
COMMIT;
PRAGMA user_version = 9;
