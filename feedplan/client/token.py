"""Reads the token of a service from a file, because other users can see the arguments of a command."""

from __future__ import annotations

from pathlib import Path as FilePath

from feedplan.errors import InputError, unreadable

SHORTEST, LONGEST = 16, 4096


def read_token(file: FilePath) -> str:
    """The first line of a file. Raises InputError if it is missing, or too short or too long for a token."""
    try:
        with file.open(encoding="ascii") as stream:
            token = stream.readline(LONGEST + 2).strip()
    except (OSError, ValueError) as error:
        raise InputError(unreadable(f"the token file {file}", error, "a file of one line in ASCII")) from None
    if not SHORTEST <= len(token) <= LONGEST or not token.isprintable() or " " in token:
        raise InputError(
            f"{file}: the token has fewer than {SHORTEST} characters, more than {LONGEST}, or a space: "
            f"make one by `openssl rand -hex 32 > {file}`"
        )
    return token
