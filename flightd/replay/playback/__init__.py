"""A flight as it is played back: what was where at each time, in bounded memory however long the log is."""
