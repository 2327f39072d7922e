-- Values of printed text in the look's picture, as JSON; and whether its flight had looked there before.
ALTER TABLE place ADD COLUMN printed TEXT NOT NULL DEFAULT '[]';
ALTER TABLE observation ADD COLUMN printed TEXT NOT NULL DEFAULT '[]';
ALTER TABLE observation ADD COLUMN again INTEGER NOT NULL DEFAULT 0;
