-- Speed profiles of other programs, with which the motion model of a train begins. The newest of a train counts; one without a
-- body withdraws those before it.
CREATE TABLE profiles (
    id           INTEGER PRIMARY KEY,
    train        INTEGER NOT NULL CHECK (train BETWEEN 0 AND 65535),
    stored_at_ns INTEGER NOT NULL,
    source       TEXT    NOT NULL,
    body         TEXT    CHECK (body IS NULL OR json_valid(body))
) STRICT;
CREATE INDEX profiles_of_train ON profiles (train, stored_at_ns);

CREATE TRIGGER profiles_are_not_changed BEFORE UPDATE ON profiles
BEGIN SELECT raise(ABORT, 'profiles are kept as they are'); END;
CREATE TRIGGER profiles_are_not_deleted BEFORE DELETE ON profiles
BEGIN SELECT raise(ABORT, 'profiles are kept for ever'); END;
CREATE TRIGGER profiles_are_not_replaced BEFORE INSERT ON profiles WHEN EXISTS (SELECT 1 FROM profiles WHERE id = new.id)
BEGIN SELECT raise(ABORT, 'profiles are kept as they are'); END;
