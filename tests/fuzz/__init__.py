"""Fuzzing of everything that comes from outside: `python -m tests.fuzz.NAME COUNT [--seed N]`.

NAME is one of messages, config, site, scenario, log.  The gate runs a few thousand cases of each.
"""
