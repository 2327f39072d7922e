"""Schedules: flights that the station starts by itself, where a site allows it."""
