"""What a simulated flight is flown in, and what goes wrong."""
