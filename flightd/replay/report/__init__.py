"""The HTML report of a flight: one self-contained page from the log and what lies beside it."""
