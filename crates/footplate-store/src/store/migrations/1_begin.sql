-- What was measured, and what a person or a model made of it. Nothing here is ever changed or deleted: the triggers
-- at the end see to it. Times are nanoseconds: `…_at_ns` since the Unix epoch, `time_ns` since the origin of the run.

-- A file that was imported, or a live session.
CREATE TABLE recordings (
    id             INTEGER PRIMARY KEY,
    name           TEXT    NOT NULL,
    form           TEXT    NOT NULL,
    layout         TEXT    NOT NULL,  -- whose sensor numbers these are
    content_sha256 TEXT    UNIQUE,    -- of the imported file; null for a live session
    stored_at_ns   INTEGER NOT NULL
) STRICT;

-- A stretch in which the clock is continuous and no train is lifted.
CREATE TABLE runs (
    id          INTEGER PRIMARY KEY,
    recording   INTEGER NOT NULL REFERENCES recordings (id),
    number      INTEGER NOT NULL CHECK (number BETWEEN 0 AND 4294967295),
    began_at_ns INTEGER,
    UNIQUE (recording, number)
) STRICT;

-- What the trains did when a run began; step 0 stands.
CREATE TABLE starts (
    id    INTEGER PRIMARY KEY,
    run   INTEGER NOT NULL REFERENCES runs (id),
    train INTEGER NOT NULL CHECK (train BETWEEN 0 AND 65535),
    step  INTEGER NOT NULL CHECK (step BETWEEN 0 AND 126),
    UNIQUE (run, train)
) STRICT;

-- What was reported, commanded and measured by hand, as it came.
CREATE TABLE events (
    id               INTEGER PRIMARY KEY,
    run              INTEGER NOT NULL REFERENCES runs (id),
    line             INTEGER,          -- of the imported file
    stored_at_ns     INTEGER NOT NULL,
    time_ns          INTEGER NOT NULL,
    kind             TEXT    NOT NULL,
    sensor           INTEGER CHECK (sensor BETWEEN 0 AND 65535),  -- of a stop: where the tape was laid
    poll_interval_ns INTEGER,
    train            INTEGER CHECK (train BETWEEN 0 AND 65535),
    step             INTEGER CHECK (step BETWEEN 0 AND 126),
    turnout          INTEGER CHECK (turnout BETWEEN 0 AND 65535),
    curved           INTEGER CHECK (curved IN (0, 1)),
    offset_m         REAL,
    CHECK (CASE kind
        WHEN 'sensor'  THEN sensor IS NOT NULL
        WHEN 'speed'   THEN train IS NOT NULL AND step IS NOT NULL
        WHEN 'reverse' THEN train IS NOT NULL
        WHEN 'turnout' THEN turnout IS NOT NULL AND curved IS NOT NULL
        WHEN 'stopped' THEN train IS NOT NULL AND sensor IS NOT NULL AND offset_m IS NOT NULL
        ELSE 0
    END)
) STRICT;
CREATE INDEX events_of_run ON events (run);

-- Passes of light gates, on the clock of the gates.
CREATE TABLE gate_passes (
    id      INTEGER PRIMARY KEY,
    run     INTEGER NOT NULL REFERENCES runs (id),
    line    INTEGER,
    gate    INTEGER NOT NULL CHECK (gate BETWEEN 0 AND 255),
    time_ns INTEGER NOT NULL
) STRICT;
CREATE INDEX gate_passes_of_run ON gate_passes (run);

-- What a person thinks of an event: the newest mark counts.
CREATE TABLE marks (
    id         INTEGER PRIMARY KEY,
    event      INTEGER NOT NULL REFERENCES events (id),
    mark       TEXT    NOT NULL CHECK (mark IN ('exclude', 'restore')),
    reason     TEXT    NOT NULL CHECK (length(trim(reason)) > 0),
    made_at_ns INTEGER NOT NULL
) STRICT;
CREATE INDEX marks_of_event ON marks (event, made_at_ns);

-- What a model made of the events that were there, and not excluded, at `as_of_ns`.
CREATE TABLE calibrations (
    id            INTEGER PRIMARY KEY,
    train         INTEGER NOT NULL CHECK (train BETWEEN 0 AND 65535),
    made_at_ns    INTEGER NOT NULL,
    as_of_ns      INTEGER NOT NULL,
    model_version TEXT    NOT NULL,
    body          TEXT    NOT NULL CHECK (json_valid(body))
) STRICT;
CREATE INDEX calibrations_of_train ON calibrations (train, made_at_ns);

-- Kept for ever. The third of each three is for INSERT OR REPLACE, which deletes without asking the second.

CREATE TRIGGER recordings_are_not_changed BEFORE UPDATE ON recordings
BEGIN SELECT raise(ABORT, 'recordings are kept as they are'); END;
CREATE TRIGGER recordings_are_not_deleted BEFORE DELETE ON recordings
BEGIN SELECT raise(ABORT, 'recordings are kept for ever'); END;
CREATE TRIGGER recordings_are_not_replaced BEFORE INSERT ON recordings
WHEN EXISTS (SELECT 1 FROM recordings WHERE id = new.id OR content_sha256 = new.content_sha256)
BEGIN SELECT raise(ABORT, 'recordings are kept as they are'); END;

CREATE TRIGGER runs_are_not_changed BEFORE UPDATE ON runs
BEGIN SELECT raise(ABORT, 'runs are kept as they are'); END;
CREATE TRIGGER runs_are_not_deleted BEFORE DELETE ON runs
BEGIN SELECT raise(ABORT, 'runs are kept for ever'); END;
CREATE TRIGGER runs_are_not_replaced BEFORE INSERT ON runs
WHEN EXISTS (SELECT 1 FROM runs WHERE id = new.id OR (recording = new.recording AND number = new.number))
BEGIN SELECT raise(ABORT, 'runs are kept as they are'); END;

CREATE TRIGGER starts_are_not_changed BEFORE UPDATE ON starts
BEGIN SELECT raise(ABORT, 'starts are kept as they are'); END;
CREATE TRIGGER starts_are_not_deleted BEFORE DELETE ON starts
BEGIN SELECT raise(ABORT, 'starts are kept for ever'); END;
CREATE TRIGGER starts_are_not_replaced BEFORE INSERT ON starts
WHEN EXISTS (SELECT 1 FROM starts WHERE id = new.id OR (run = new.run AND train = new.train))
BEGIN SELECT raise(ABORT, 'starts are kept as they are'); END;

CREATE TRIGGER events_are_not_changed BEFORE UPDATE ON events
BEGIN SELECT raise(ABORT, 'events are kept as they are'); END;
CREATE TRIGGER events_are_not_deleted BEFORE DELETE ON events
BEGIN SELECT raise(ABORT, 'events are kept for ever'); END;
CREATE TRIGGER events_are_not_replaced BEFORE INSERT ON events WHEN EXISTS (SELECT 1 FROM events WHERE id = new.id)
BEGIN SELECT raise(ABORT, 'events are kept as they are'); END;

CREATE TRIGGER gate_passes_are_not_changed BEFORE UPDATE ON gate_passes
BEGIN SELECT raise(ABORT, 'gate_passes are kept as they are'); END;
CREATE TRIGGER gate_passes_are_not_deleted BEFORE DELETE ON gate_passes
BEGIN SELECT raise(ABORT, 'gate_passes are kept for ever'); END;
CREATE TRIGGER gate_passes_are_not_replaced BEFORE INSERT ON gate_passes WHEN EXISTS (SELECT 1 FROM gate_passes WHERE id = new.id)
BEGIN SELECT raise(ABORT, 'gate_passes are kept as they are'); END;

CREATE TRIGGER marks_are_not_changed BEFORE UPDATE ON marks
BEGIN SELECT raise(ABORT, 'marks are kept as they are'); END;
CREATE TRIGGER marks_are_not_deleted BEFORE DELETE ON marks
BEGIN SELECT raise(ABORT, 'marks are kept for ever'); END;
CREATE TRIGGER marks_are_not_replaced BEFORE INSERT ON marks WHEN EXISTS (SELECT 1 FROM marks WHERE id = new.id)
BEGIN SELECT raise(ABORT, 'marks are kept as they are'); END;

CREATE TRIGGER calibrations_are_not_changed BEFORE UPDATE ON calibrations
BEGIN SELECT raise(ABORT, 'calibrations are kept as they are'); END;
CREATE TRIGGER calibrations_are_not_deleted BEFORE DELETE ON calibrations
BEGIN SELECT raise(ABORT, 'calibrations are kept for ever'); END;
CREATE TRIGGER calibrations_are_not_replaced BEFORE INSERT ON calibrations WHEN EXISTS (SELECT 1 FROM calibrations WHERE id = new.id)
BEGIN SELECT raise(ABORT, 'calibrations are kept as they are'); END;
