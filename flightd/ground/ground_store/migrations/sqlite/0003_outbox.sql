-- Files for other programs: the one that is under way ('' for none) is kept until it lies in its folder, and
-- what each place was told as.
CREATE TABLE outbox (
    name TEXT PRIMARY KEY,
    number INTEGER NOT NULL,
    file TEXT NOT NULL,
    content BLOB NOT NULL
) STRICT;
CREATE TABLE outbox_place (
    outbox TEXT NOT NULL,
    place INTEGER NOT NULL,
    state TEXT NOT NULL,
    texts TEXT NOT NULL,
    look BLOB NOT NULL,
    PRIMARY KEY (outbox, place)
) STRICT, WITHOUT ROWID;
