"""`flightctl watch`: the flight on a full screen of the terminal."""
