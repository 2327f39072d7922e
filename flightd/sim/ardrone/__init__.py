"""An AR.Drone 2.0 on loopback sockets: AT, navdata, configuration and video as its firmware serves them.

It shares no code with the adapter that flies it, so the one proves the other; the npm client `ar-drone`
flies it as well.
"""
