"""MAVLink on the wire: transports, framing, signing, one connection."""
