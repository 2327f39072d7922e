"""Many drones on one floor: plans in space and time, the order in which they are flown, what is released.
Pure."""
