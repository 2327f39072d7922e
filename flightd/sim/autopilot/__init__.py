"""Simulated autopilots: peers on real UDP that speak MAVLink 2 and fly the airframe."""
