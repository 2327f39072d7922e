"""Is this machine, camera, lens, link and autopilot fit to fly?  A module for each kind of thing."""
