"""The messages of the ground link, by what they are about."""
