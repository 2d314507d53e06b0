"""The command line: results on standard output, everything else on standard error.

Each command is a file, and so is each group of options that several commands share; `options` has the single
options, `terminal` prints, `ending` has the exit codes. Slow imports are inside the command that needs them.
"""

from __future__ import annotations

import io
import os
import re
import sys
from collections.abc import Sequence

import click

from feedplan import __version__
from feedplan.cli.batch import batch
from feedplan.cli.check import check
from feedplan.cli.compare import compare
from feedplan.cli.ending import BAD_INPUT, BROKEN, DEFECT, DONE, INTERRUPTED, PIPE_CLOSED, fail
from feedplan.cli.filter import filter_
from feedplan.cli.fit import fit
from feedplan.cli.machines import machines
from feedplan.cli.plan import plan
from feedplan.cli.serve import serve
from feedplan.cli.time import time
from feedplan.errors import FeedplanError, InfeasibleError, InputError, SolverError

_TRACEBACK = "FEEDPLAN_TRACEBACK"


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        code = cli.main(arguments, prog_name="feedplan", standalone_mode=False)
        sys.stdout.flush()
        return code if isinstance(code, int) else DONE
    except (click.Abort, KeyboardInterrupt):
        return fail("interrupted", INTERRUPTED)
    except click.ClickException as error:
        return fail(_usage(error), BAD_INPUT)
    except BrokenPipeError:
        _close_output()
        return PIPE_CLOSED
    except SystemExit as ended:
        # click ends with 1 if a command writes into a closed pipe; here 1 means a broken limit.
        if ended.code != 1:
            raise
        return PIPE_CLOSED
    except OSError as error:
        # Errors of files are FeedplanErrors; an OSError comes from standard output (for example a full disk).
        _close_output()
        return fail(
            f"the standard output cannot be written: {(error.strerror or str(error)).lower()}", BAD_INPUT
        )
    except Exception as error:
        if os.environ.get(_TRACEBACK):
            raise
        return fail(*_explained(error))


def _close_output() -> None:
    """Discards the rest of the output: the interpreter would print an error when flushing it at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _explained(error: Exception) -> tuple[str, int]:
    """An error as a sentence and an exit code."""
    if isinstance(error, (InfeasibleError, SolverError)):
        return str(error), BROKEN
    if isinstance(error, FeedplanError):
        # Messages about programs and machine files use names of their own, not those of arguments.
        return _by_option(str(error)) if type(error) is InputError else str(error), BAD_INPUT
    if isinstance(error, MemoryError):
        return "the memory of this computer does not suffice: split the program", BAD_INPUT
    what = f"this is a defect in feedplan ({type(error).__name__}: {error})"
    remedy = f"please report it with the command and the program; {_TRACEBACK}=1 shows where it happened"
    return f"{what}: {remedy}", DEFECT


def _by_option(sentence: str) -> str:
    """The sentence with option names such as `--feed-step` in place of Python's `feed_step`."""
    options = (
        option.name
        for command in _PLANNING
        for option in command.params
        if option.name and "_" in option.name and f"--{option.name.replace('_', '-')}" in option.opts
    )
    names = "|".join(dict.fromkeys(options))
    # Names within file names are not replaced.
    alone = rf"(?<![\w./-])({names})(?![\w/-]|\.\w)"
    return re.sub(alone, lambda found: f"--{found[0].replace('_', '-')}", sentence)


def _usage(error: click.ClickException) -> str:
    command = error.ctx.command_path if isinstance(error, click.UsageError) and error.ctx else "feedplan"
    return f"{error.format_message().rstrip('.')} (`{command} --help` shows the usage)"


@click.group(
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    invoke_without_command=True,
)
@click.version_option(__version__, message="%(prog)s %(version)s")
@click.pass_context
def cli(context: click.Context) -> int:
    """Time-optimal speed along the exact tool path of a part program, with proof and audit."""
    if context.invoked_subcommand is None:
        print(context.get_help(), file=sys.stderr)
        return BAD_INPUT
    return DONE


_PLANNING = (plan, compare, fit, check, batch, time, filter_)
for command in (*_PLANNING, machines, serve):
    cli.add_command(command)
