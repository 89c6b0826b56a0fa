-- Calibrations of a second kind: how a train moves, learnt while it was driven. Those that are there were made of whole
-- recordings.
ALTER TABLE calibrations ADD COLUMN kind TEXT NOT NULL DEFAULT 'recordings'
    CHECK (kind IN ('recordings', 'motion'));
