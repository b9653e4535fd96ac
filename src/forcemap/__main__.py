"""`python -m forcemap` is the command `forcemap`."""

from forcemap.cli import main

if __name__ == "__main__":
    main()
