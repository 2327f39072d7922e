"""The station's own fleet: they fly where traffic control releases them, as by a manager's orders."""
