-- The direction that each decoder was commanded in, for stations that forget it. The newest of a train counts.
CREATE TABLE directions (
    id           INTEGER PRIMARY KEY,
    train        INTEGER NOT NULL,
    forward      INTEGER NOT NULL CHECK (forward IN (0, 1)),
    stored_at_ns INTEGER NOT NULL
) STRICT;
CREATE INDEX directions_of_train ON directions (train, id);

CREATE TRIGGER directions_are_not_changed BEFORE UPDATE ON directions
BEGIN SELECT raise(ABORT, 'directions are kept as they are'); END;
CREATE TRIGGER directions_are_not_deleted BEFORE DELETE ON directions
BEGIN SELECT raise(ABORT, 'directions are kept for ever'); END;
CREATE TRIGGER directions_are_not_replaced BEFORE INSERT ON directions WHEN EXISTS (SELECT 1 FROM directions WHERE id = new.id)
BEGIN SELECT raise(ABORT, 'directions are kept as they are'); END;

-- Only what is in an archive leaves its table, as before: archives of a machine do not overlap, so that the last one that begins
-- before a row is the only one to look at. All of them were: after a day of driving that took seconds for every archive.
DROP TRIGGER inputs_are_not_deleted;
CREATE TRIGGER inputs_are_not_deleted BEFORE DELETE ON inputs
WHEN coalesce((SELECT last FROM archives WHERE machine = old.machine AND first <= old.number ORDER BY first DESC LIMIT 1), -1) < old.number
BEGIN SELECT raise(ABORT, 'inputs are kept for ever'); END;
DROP TRIGGER decisions_are_not_deleted;
CREATE TRIGGER decisions_are_not_deleted BEFORE DELETE ON decisions
WHEN coalesce((SELECT last FROM archives WHERE machine = old.machine AND first <= old.number ORDER BY first DESC LIMIT 1), -1) < old.number
BEGIN SELECT raise(ABORT, 'decisions are kept for ever'); END;
