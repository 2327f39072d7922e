-- What webhooks are told, in the order in which it came to pass; `sent` is the last event that a hook took.
CREATE TABLE event (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    utc_ns INTEGER NOT NULL,
    kind TEXT NOT NULL,
    body TEXT NOT NULL
) STRICT;
CREATE TABLE hook (
    name TEXT PRIMARY KEY,
    sent INTEGER NOT NULL,
    dropped INTEGER NOT NULL
) STRICT;
