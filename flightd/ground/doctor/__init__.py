"""The page Doctor: drones looked after while they stand."""
