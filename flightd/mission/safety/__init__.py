"""Every hazard in one table, what finds it, and what keeps a flight on the ground."""
