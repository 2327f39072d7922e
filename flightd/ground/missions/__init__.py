"""Missions that people chose: kept, estimated by the drone, handed to it, and what is left."""
