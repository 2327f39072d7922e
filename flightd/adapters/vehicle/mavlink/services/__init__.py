"""What rides on the connection: commands, parameters, streams, clock, texts."""
