-- Times are UTC in ns, ids of looks and pictures SHA-256.  Looks have no foreign keys: whoever writes them
-- finds place and run in the same transaction.
CREATE TABLE store (id TEXT PRIMARY KEY) STRICT;
CREATE TABLE site (
    id INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE
) STRICT;
CREATE TABLE run (
    id INTEGER PRIMARY KEY,
    site INTEGER NOT NULL REFERENCES site,
    name TEXT NOT NULL,
    began_ns INTEGER NOT NULL,
    ended_ns INTEGER NOT NULL,
    looks INTEGER NOT NULL,
    UNIQUE (site, name)
) STRICT;
CREATE INDEX run_by_time ON run (site, began_ns, id);
CREATE TABLE place (
    id INTEGER PRIMARY KEY,
    site INTEGER NOT NULL REFERENCES site,
    code TEXT NOT NULL,
    node TEXT NOT NULL,
    state TEXT NOT NULL DEFAULT 'not_visited',
    texts TEXT NOT NULL DEFAULT '[]',
    utc_ns INTEGER,
    look BLOB,
    run INTEGER REFERENCES run,
    confidence REAL,
    evidence BLOB,
    UNIQUE (site, code)
) STRICT;
CREATE INDEX place_by_state ON place (site, state, code);
CREATE TABLE observation (
    id BLOB NOT NULL,
    utc_ns INTEGER NOT NULL,
    place INTEGER NOT NULL,
    run INTEGER NOT NULL,
    state TEXT NOT NULL,
    confidence REAL NOT NULL,
    standing INTEGER NOT NULL,
    node TEXT,
    x_m REAL,
    y_m REAL,
    height_m REAL,
    yaw_rad REAL,
    evidence BLOB,
    reads TEXT NOT NULL
) STRICT;
CREATE UNIQUE INDEX observation_by_id ON observation (id);
CREATE INDEX observation_by_place ON observation (place, utc_ns, id);
CREATE INDEX observation_by_run ON observation (run, utc_ns, id);
CREATE TABLE difference (
    run INTEGER NOT NULL,
    code TEXT NOT NULL,
    kind TEXT NOT NULL,
    utc_ns INTEGER NOT NULL,
    look BLOB NOT NULL,
    state TEXT NOT NULL,
    texts TEXT NOT NULL,
    before_run INTEGER NOT NULL,
    before_ns INTEGER NOT NULL,
    before_state TEXT NOT NULL,
    before_texts TEXT NOT NULL,
    PRIMARY KEY (run, code)
) STRICT, WITHOUT ROWID;
CREATE TABLE flight (
    id BLOB PRIMARY KEY,
    site INTEGER NOT NULL REFERENCES site,
    drone TEXT NOT NULL,
    began_ns INTEGER NOT NULL,
    duration_s REAL,
    mission TEXT NOT NULL,
    outcome TEXT NOT NULL,
    reason TEXT NOT NULL,
    verdict TEXT NOT NULL,
    nodes_planned INTEGER,
    nodes_visited INTEGER
) STRICT;
CREATE INDEX flight_by_time ON flight (site, began_ns, id);
CREATE TABLE decision (
    id TEXT PRIMARY KEY,
    site INTEGER NOT NULL REFERENCES site,
    code TEXT NOT NULL,
    utc_ns INTEGER NOT NULL,
    seen_ns INTEGER NOT NULL,
    what TEXT NOT NULL,
    who TEXT NOT NULL,
    note TEXT NOT NULL
) STRICT;
CREATE INDEX decision_by_place ON decision (site, code, utc_ns, id);
CREATE TABLE person (
    station TEXT NOT NULL,
    name TEXT NOT NULL,
    role TEXT NOT NULL,
    seen_ns INTEGER NOT NULL,
    PRIMARY KEY (station, name)
) STRICT;
CREATE TABLE audit (
    id BLOB PRIMARY KEY,
    station TEXT NOT NULL,
    utc_ns INTEGER NOT NULL,
    person TEXT NOT NULL,
    act TEXT NOT NULL,
    target TEXT NOT NULL,
    outcome TEXT NOT NULL,
    line TEXT NOT NULL
) STRICT;
CREATE INDEX audit_by_time ON audit (utc_ns, id);
CREATE TABLE delivery (
    id BLOB PRIMARY KEY,
    source TEXT NOT NULL,
    utc_ns INTEGER NOT NULL,
    looks INTEGER NOT NULL
) STRICT;
