"""Drones as vehicles of a fleet, in the words of VDA 5050: messages and rules, no transport."""
