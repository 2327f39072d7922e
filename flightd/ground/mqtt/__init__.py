"""The drones that the station hears, as vehicles of VDA 5050 at an MQTT broker."""
