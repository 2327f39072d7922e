"""Racks, goods and labels in front of the simulated front camera, and what a perfect count would say."""
