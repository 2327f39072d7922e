"""What the world's cameras and instruments make of the truth."""
