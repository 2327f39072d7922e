"""Thick painted lines in a frame: colour, methods, fusion, sub-pixel refinement, junctions."""
