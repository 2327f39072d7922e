-- What was read beside a place's codes and does not count, as JSON.
ALTER TABLE observation ADD COLUMN undecided TEXT NOT NULL DEFAULT '[]';
ALTER TABLE place ADD COLUMN undecided TEXT NOT NULL DEFAULT '[]';
