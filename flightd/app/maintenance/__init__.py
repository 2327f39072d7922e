"""A drone looked after from the ground while it stands: doctor's report, parameters, settings."""
