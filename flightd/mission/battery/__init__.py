"""What the battery still gives, when to turn back, and going on with a fresh one."""
