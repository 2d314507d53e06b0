"""The command `feedplan`, and `python -m feedplan`: imports and runs the command line; Ctrl-C during the
imports also ends with a sentence."""

import sys


def main() -> int:
    """Runs the command line and returns the exit code."""
    try:
        from feedplan import cli
    except KeyboardInterrupt:
        print("error: interrupted", file=sys.stderr)
        return 130
    return cli.main()


if __name__ == "__main__":
    sys.exit(main())
