"""Prometheus metrics: what is measured (`book`) and where it can be read (`server`)."""
