"""`python -m flightd`: the same as the `flightd` command."""

from flightd.cli.main import main

if __name__ == "__main__":
    main()
