BEGIN TRANSACTION;
CREATE TABLE edits (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    parent INTEGER REFERENCES edits,          -- NULL for the first
    label TEXT NOT NULL, author TEXT NOT NULL, time TEXT NOT NULL, program TEXT NOT NULL
);
INSERT INTO "edits" VALUES(1,NULL,'place','eve','2026-11-21T11:54:37.887+00:00','0.1.0');
INSERT INTO "edits" VALUES(2,1,'drag','','2026-11-21T11:54:37.889+00:00','0.1.0');
INSERT INTO "edits" VALUES(3,2,'track','','2026-11-21T11:54:37.891+00:00','0.1.0');
INSERT INTO "edits" VALUES(4,3,'clear','','2026-11-21T11:54:37.893+00:00','0.1.0');
CREATE TABLE head (edit INTEGER REFERENCES edits);
INSERT INTO "head" VALUES(3);
CREATE TABLE model_revisions (
    id INTEGER PRIMARY KEY AUTOINCREMENT, person TEXT NOT NULL, toml TEXT NOT NULL, time TEXT NOT NULL
);
INSERT INTO "model_revisions" VALUES(1,'ann','a = 1','2026-11-21T11:54:37.886+00:00');
CREATE TABLE moves (                                             -- undo and redo, as they happened
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    kind TEXT NOT NULL, edit INTEGER NOT NULL REFERENCES edits, time TEXT NOT NULL
);
INSERT INTO "moves" VALUES(1,'undo',4,'2026-11-21T11:54:37.894+00:00');
CREATE TABLE pin_changes (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    edit INTEGER NOT NULL REFERENCES edits,
    previous INTEGER REFERENCES pin_changes,
    person TEXT NOT NULL, frame INTEGER NOT NULL, point TEXT NOT NULL, camera TEXT NOT NULL,
    u REAL, v REAL                                               -- original pixels; NULL: cleared
);
INSERT INTO "pin_changes" VALUES(1,1,NULL,'ann',1,'left_wrist','front',10.25,-3.5);
CREATE TABLE pins (
    person TEXT, frame INTEGER, point TEXT, camera TEXT, change INTEGER NOT NULL REFERENCES pin_changes,
    PRIMARY KEY (person, frame, point, camera)
) WITHOUT ROWID;
INSERT INTO "pins" VALUES('ann',1,'left_wrist','front',1);
CREATE TABLE pose_changes (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    edit INTEGER NOT NULL REFERENCES edits,
    previous INTEGER REFERENCES pose_changes,                    -- what the frame showed before; NULL: nothing
    person TEXT NOT NULL, frame INTEGER NOT NULL,
    numbers BLOB,                                                -- little-endian float64; NULL: cleared
    sources BLOB, keyframe INTEGER, status TEXT, cost_px REAL,
    model_revision INTEGER REFERENCES model_revisions, settings TEXT
);
INSERT INTO "pose_changes" VALUES(1,1,NULL,'ann',1,X'9A9999999999B93F0000000000000040555555555555D53F',X'000304',1,'',1.25,1,'{"step_deg": 5}');
INSERT INTO "pose_changes" VALUES(2,2,1,'ann',1,X'9A9999999999C93F0000000000000040555555555555D53F',X'000304',1,'',NULL,1,'{}');
INSERT INTO "pose_changes" VALUES(3,2,2,'ann',1,X'333333333333D33F0000000000000040555555555555D53F',X'000304',1,'',NULL,1,'{}');
INSERT INTO "pose_changes" VALUES(4,3,NULL,'ann',2,X'00000000000000400000000000000040555555555555D53F',X'000304',0,'',1.0,1,'{}');
INSERT INTO "pose_changes" VALUES(5,3,NULL,'ann',3,X'00000000000008400000000000000040555555555555D53F',X'000304',0,'',1.5,1,'{}');
INSERT INTO "pose_changes" VALUES(6,4,4,'ann',2,NULL,NULL,NULL,NULL,NULL,NULL,NULL);
CREATE TABLE poses (
    person TEXT, frame INTEGER, change INTEGER NOT NULL REFERENCES pose_changes, PRIMARY KEY (person, frame)
) WITHOUT ROWID;
INSERT INTO "poses" VALUES('ann',1,3);
INSERT INTO "poses" VALUES('ann',2,4);
INSERT INTO "poses" VALUES('ann',3,5);
CREATE TABLE settings (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
INSERT INTO "settings" VALUES('tree','{"arms": [1]}');
CREATE INDEX edits_parent ON edits (parent);
CREATE INDEX pose_changes_edit ON pose_changes (edit);
CREATE INDEX pin_changes_edit ON pin_changes (edit);
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('model_revisions',1);
INSERT INTO "sqlite_sequence" VALUES('edits',4);
INSERT INTO "sqlite_sequence" VALUES('pose_changes',6);
INSERT INTO "sqlite_sequence" VALUES('pin_changes',1);
INSERT INTO "sqlite_sequence" VALUES('moves',1);
COMMIT;
PRAGMA user_version = 1;
