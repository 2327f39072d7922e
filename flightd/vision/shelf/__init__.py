"""Codes, places and empties in the front camera's frames."""
