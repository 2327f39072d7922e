-- How full a place is, as JSON; NULL where its look was not asked.
ALTER TABLE observation ADD COLUMN fill TEXT;
ALTER TABLE place ADD COLUMN fill TEXT;
