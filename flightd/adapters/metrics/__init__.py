"""Prometheus metrics: what is measured (`metrics`) and where it can be read (`server`)."""
