"""A vehicle flown through the MAVSDK library (its C++ core inside this process)."""
