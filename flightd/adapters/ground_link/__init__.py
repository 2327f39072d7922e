"""The ZMQ link to ground stations: sockets, requests, keys, audit."""
