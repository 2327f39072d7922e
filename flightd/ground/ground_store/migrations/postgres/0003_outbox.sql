-- Files for other programs: the one that is under way ('' for none) is kept until it lies in its folder, and
-- what each place was told as.
CREATE TABLE outbox (
    name TEXT COLLATE "C" PRIMARY KEY,
    number BIGINT NOT NULL,
    file TEXT NOT NULL,
    content BYTEA NOT NULL
);
CREATE TABLE outbox_place (
    outbox TEXT COLLATE "C" NOT NULL,
    place BIGINT NOT NULL,
    state TEXT NOT NULL,
    texts TEXT NOT NULL,
    look BYTEA NOT NULL,
    PRIMARY KEY (outbox, place)
);
