"""Starts world and daemon together, alone in lockstep or as two processes by the clock."""
