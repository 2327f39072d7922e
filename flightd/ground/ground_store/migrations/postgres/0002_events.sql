-- What webhooks are told, in the order in which it came to pass; `sent` is the last event that a hook took.
CREATE TABLE event (
    id BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    utc_ns BIGINT NOT NULL,
    kind TEXT NOT NULL,
    body TEXT NOT NULL
);
CREATE TABLE hook (
    name TEXT COLLATE "C" PRIMARY KEY,
    sent BIGINT NOT NULL,
    dropped BIGINT NOT NULL
);
