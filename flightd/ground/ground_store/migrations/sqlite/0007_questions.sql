-- What other programs ask of places; the counts that answered it ('' for none yet), and by a look of when.
CREATE TABLE question (
    id BLOB PRIMARY KEY,
    site INTEGER NOT NULL REFERENCES site,
    place INTEGER NOT NULL REFERENCES place,
    utc_ns INTEGER NOT NULL,
    who TEXT NOT NULL,
    reason TEXT NOT NULL,
    reference TEXT NOT NULL,
    file TEXT NOT NULL DEFAULT '',
    answered_ns INTEGER
) STRICT;
CREATE INDEX question_by_time ON question (site, utc_ns, id);
CREATE INDEX question_unanswered ON question (site, place) WHERE file = '';
-- The file of each drop folder that was taken last, and may lie there still.
CREATE TABLE dropped (
    inbox TEXT PRIMARY KEY,
    name TEXT NOT NULL,
    sha256 TEXT NOT NULL,
    said TEXT NOT NULL
) STRICT;
