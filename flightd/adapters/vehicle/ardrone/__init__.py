"""The AR.Drone 2.0: AT commands, navdata, configuration and video, and the `Vehicle` made of them."""
