"""The flights below a folder: which there are, each played back, its report.

`flight_index` keeps the list, `routes` answers.
Requests name a flight by its id, never by a path.
"""
