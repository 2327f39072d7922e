"""The ground store: all counts of all sites over the years, in SQLite or PostgreSQL, fed by deliveries.

`open_store` opens one, `store.GroundStore` takes batches and answers; `sender` makes batches of what a drone
or a station has in its folders.  The engines differ in `sqlite_engine`, `postgres_engine` and the SQL of
`migrations`, and in nothing else.
"""
