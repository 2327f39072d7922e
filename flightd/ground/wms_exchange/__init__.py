"""Drop folders for a warehouse management system: its expected stock and its questions come in, counts go
out, as CSV by its own column names.

`exchange` makes one pass by an `exchange_file`; `inbox`, with a taker of each kind of file, and `outbox` are
its two halves, each in a `shared_folder`, here or wherever fsspec reaches.
"""
