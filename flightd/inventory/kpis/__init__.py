"""How counting goes over time: each run, how well codes are read, what changed, how old the count is."""
