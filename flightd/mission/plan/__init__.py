"""Which nodes, in what order, by which legs, in how many seconds."""
