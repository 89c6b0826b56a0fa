-- Archives: inputs and decisions of a machine, many in a row and compressed. They move here from their tables, which keep
-- the newest.
CREATE TABLE archives (
    id        INTEGER PRIMARY KEY,
    machine   INTEGER NOT NULL REFERENCES machines (id),
    first     INTEGER NOT NULL CHECK (first >= 0),      -- the numbers of the first and of the last of them
    last      INTEGER NOT NULL CHECK (last >= first),
    inputs    INTEGER NOT NULL CHECK (inputs >= 0),     -- how many are inputs
    decisions INTEGER NOT NULL CHECK (decisions >= 0),  -- and how many decisions
    has_end   INTEGER NOT NULL CHECK (has_end IN (0, 1)),  -- whether one of them is the input `end`
    body      BLOB    NOT NULL,                         -- JSON in a zlib stream: [number, time_ns, is a decision, kind, text] of each
    crc32     INTEGER NOT NULL CHECK (crc32 BETWEEN 0 AND 4294967295),
    UNIQUE (machine, first)
) STRICT;

CREATE TRIGGER archives_are_not_changed BEFORE UPDATE ON archives
BEGIN SELECT raise(ABORT, 'archives are kept as they are'); END;
CREATE TRIGGER archives_are_not_deleted BEFORE DELETE ON archives
BEGIN SELECT raise(ABORT, 'archives are kept for ever'); END;
CREATE TRIGGER archives_are_not_replaced BEFORE INSERT ON archives
WHEN EXISTS (SELECT 1 FROM archives WHERE id = new.id OR (machine = new.machine AND first = new.first))
BEGIN SELECT raise(ABORT, 'archives are kept as they are'); END;

-- Only what is in an archive leaves its table.
DROP TRIGGER inputs_are_not_deleted;
CREATE TRIGGER inputs_are_not_deleted BEFORE DELETE ON inputs
WHEN NOT EXISTS (SELECT 1 FROM archives WHERE machine = old.machine AND old.number BETWEEN first AND last)
BEGIN SELECT raise(ABORT, 'inputs are kept for ever'); END;
DROP TRIGGER decisions_are_not_deleted;
CREATE TRIGGER decisions_are_not_deleted BEFORE DELETE ON decisions
WHEN NOT EXISTS (SELECT 1 FROM archives WHERE machine = old.machine AND old.number BETWEEN first AND last)
BEGIN SELECT raise(ABORT, 'decisions are kept for ever'); END;
