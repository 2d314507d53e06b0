"""The token of a service, read from a file: what stands in a command others on the computer can see."""

from __future__ import annotations

from pathlib import Path as FilePath

from feedplan.errors import InputError

SHORTEST = 16


def read_token(file: FilePath) -> str:
    """The token in a file, its first line. Raises InputError where there is none that is long enough."""
    try:
        token = file.read_text("ascii").partition("\n")[0].strip()
    except (OSError, ValueError) as error:
        raise InputError(f"the token file {file} cannot be read ({error}): give a file of one line") from None
    if len(token) < SHORTEST or not token.isprintable() or " " in token:
        raise InputError(
            f"{file}: the token has fewer than {SHORTEST} characters or a space: "
            f"make one by `openssl rand -hex 32 > {file}`"
        )
    return token
