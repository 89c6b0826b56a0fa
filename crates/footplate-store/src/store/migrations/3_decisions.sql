-- What was decided and what it followed from, so that every decision of a session can be made again.

-- A machine that decides, as it began: all that it was made of, as JSON.
CREATE TABLE machines (
    id           INTEGER PRIMARY KEY,
    recording    INTEGER NOT NULL REFERENCES recordings (id),
    stored_at_ns INTEGER NOT NULL,
    kind         TEXT    NOT NULL CHECK (length(kind) > 0),
    program      TEXT    NOT NULL,  -- the version of Footplate
    body         TEXT    NOT NULL CHECK (json_valid(body)),
    body_sha256  TEXT    NOT NULL
) STRICT;
CREATE INDEX machines_of_recording ON machines (recording);

-- What it was told. `number` counts inputs and decisions of a machine together, in their order and without a gap.
CREATE TABLE inputs (
    id           INTEGER PRIMARY KEY,
    machine      INTEGER NOT NULL REFERENCES machines (id),
    number       INTEGER NOT NULL CHECK (number >= 0),
    time_ns      INTEGER NOT NULL,  -- when it was told
    kind         TEXT    NOT NULL CHECK (length(kind) > 0),
    text         TEXT    NOT NULL,
    UNIQUE (machine, number)
) STRICT;

-- What it decided: commands, and all else it asked for or said.
CREATE TABLE decisions (
    id           INTEGER PRIMARY KEY,
    machine      INTEGER NOT NULL REFERENCES machines (id),
    number       INTEGER NOT NULL CHECK (number >= 0),
    time_ns      INTEGER NOT NULL,  -- of the input before it
    kind         TEXT    NOT NULL CHECK (length(kind) > 0),
    text         TEXT    NOT NULL,
    UNIQUE (machine, number)
) STRICT;

CREATE TRIGGER machines_are_not_changed BEFORE UPDATE ON machines
BEGIN SELECT raise(ABORT, 'machines are kept as they are'); END;
CREATE TRIGGER machines_are_not_deleted BEFORE DELETE ON machines
BEGIN SELECT raise(ABORT, 'machines are kept for ever'); END;
CREATE TRIGGER machines_are_not_replaced BEFORE INSERT ON machines WHEN EXISTS (SELECT 1 FROM machines WHERE id = new.id)
BEGIN SELECT raise(ABORT, 'machines are kept as they are'); END;

CREATE TRIGGER inputs_are_not_changed BEFORE UPDATE ON inputs
BEGIN SELECT raise(ABORT, 'inputs are kept as they are'); END;
CREATE TRIGGER inputs_are_not_deleted BEFORE DELETE ON inputs
BEGIN SELECT raise(ABORT, 'inputs are kept for ever'); END;
CREATE TRIGGER inputs_are_not_replaced BEFORE INSERT ON inputs
WHEN EXISTS (SELECT 1 FROM inputs WHERE id = new.id OR (machine = new.machine AND number = new.number))
BEGIN SELECT raise(ABORT, 'inputs are kept as they are'); END;

CREATE TRIGGER decisions_are_not_changed BEFORE UPDATE ON decisions
BEGIN SELECT raise(ABORT, 'decisions are kept as they are'); END;
CREATE TRIGGER decisions_are_not_deleted BEFORE DELETE ON decisions
BEGIN SELECT raise(ABORT, 'decisions are kept for ever'); END;
CREATE TRIGGER decisions_are_not_replaced BEFORE INSERT ON decisions
WHEN EXISTS (SELECT 1 FROM decisions WHERE id = new.id OR (machine = new.machine AND number = new.number))
BEGIN SELECT raise(ABORT, 'decisions are kept as they are'); END;
