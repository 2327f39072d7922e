"""The moving parts: airframe, air, external simulators, and the true motion."""
