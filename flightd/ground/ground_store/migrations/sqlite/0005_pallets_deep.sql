-- How many pallets stand behind one another in a place; the first alone is seen.
ALTER TABLE place ADD COLUMN pallets_deep INTEGER NOT NULL DEFAULT 1;
