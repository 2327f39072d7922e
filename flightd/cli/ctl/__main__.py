"""`python -m flightd.cli.ctl`: the same as the `flightctl` command."""

from flightd.cli.ctl.main import main

if __name__ == "__main__":
    main()
