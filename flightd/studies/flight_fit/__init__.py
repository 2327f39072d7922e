"""Whole flights fitted at once: where the drone was, where the lines lie, what is wrong with the sensors.

In the air a filter knows what came before.  Afterwards all of a flight is least squares: each line seen, as a
pair of points of the picture that must lie on it; the motion from frame to frame, by which the told attitude
accelerates the drone; and what was believed before (Triggs et al., Bundle Adjustment: A Modern Synthesis,
1999).  Unknown are the motion at each frame, the sensors' errors of each flight and the lines of the map.
"""
