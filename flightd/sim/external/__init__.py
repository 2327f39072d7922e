"""An autopilot simulator elsewhere (ArduCopter's or PX4's SITL) in the place of the simulated vehicle."""
