"""Flight logs by the thousand through today's code."""
