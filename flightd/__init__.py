"""flightd: fly a camera drone along the painted guide lines of a warehouse floor."""

__version__ = "0.2.0"
