"""`python -m feedplan` runs the command `feedplan`."""

import sys

from feedplan.cli import main

if __name__ == "__main__":
    sys.exit(main())
