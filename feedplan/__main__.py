"""`python -m feedplan` is the command `feedplan`."""

import sys

from feedplan.cli import main

if __name__ == "__main__":
    sys.exit(main())
