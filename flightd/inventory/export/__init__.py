"""The inventory out to other programs: one module a format."""
