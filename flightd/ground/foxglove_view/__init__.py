"""What `flightd ground --foxglove` serves: warehouse, drones and their pictures, live, to Foxglove.

The protocol, `foxglove.sdk.v1`, is that of the package foxglove-sdk, whose server runs on threads of its own.
Nothing that a viewer does reaches a drone: it is only told.
"""
