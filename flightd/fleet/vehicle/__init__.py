"""The vehicle side of VDA 5050: what a drone makes of orders, as a pure state machine."""
