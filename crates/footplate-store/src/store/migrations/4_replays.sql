-- How far a replay of all sessions came, so that the next one goes on from there. It follows from the events, the layout and the
-- version of the model, and from nothing else: whoever finds none, or one of something else, replays from the beginning.

-- The only rows that are replaced: what they say is in the events.
CREATE TABLE replays (
    id          INTEGER PRIMARY KEY,
    train       INTEGER NOT NULL CHECK (train BETWEEN 0 AND 65535),
    layout      TEXT    NOT NULL,
    of_sha256   TEXT    NOT NULL,  -- of all that it follows from
    body        TEXT    NOT NULL CHECK (json_valid(body)),
    body_sha256 TEXT    NOT NULL,
    UNIQUE (train, layout)
) STRICT;
