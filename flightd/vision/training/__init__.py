"""Labelled frames, colour training, and the score of detected lines."""
