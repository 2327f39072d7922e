"""Schedules: when a drone is to count what, each occurrence once whatever the clock does.  Pure."""
