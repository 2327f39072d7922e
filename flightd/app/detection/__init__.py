"""Down camera frames through the detector processes, with the time each took."""
