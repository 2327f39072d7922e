"""The `flightctl` command: watch and command a running flightd over the ground link."""
