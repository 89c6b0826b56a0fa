-- Schedules: scripts that the owner of a layout saved, to run them from the pages. The newest of a name counts; one without a body
-- withdraws those before it.
CREATE TABLE schedules (
    id           INTEGER PRIMARY KEY,
    layout       TEXT    NOT NULL,
    name         TEXT    NOT NULL,
    stored_at_ns INTEGER NOT NULL,
    body         TEXT    CHECK (body IS NULL OR json_valid(body))
) STRICT;
CREATE INDEX schedules_of_layout ON schedules (layout, name, id);

CREATE TRIGGER schedules_are_not_changed BEFORE UPDATE ON schedules
BEGIN SELECT raise(ABORT, 'schedules are kept as they are'); END;
CREATE TRIGGER schedules_are_not_deleted BEFORE DELETE ON schedules
BEGIN SELECT raise(ABORT, 'schedules are kept for ever'); END;
CREATE TRIGGER schedules_are_not_replaced BEFORE INSERT ON schedules WHEN EXISTS (SELECT 1 FROM schedules WHERE id = new.id)
BEGIN SELECT raise(ABORT, 'schedules are kept as they are'); END;
