"""What else the floor shows: charge pads, markers, and whether a frame shows anything at all."""
