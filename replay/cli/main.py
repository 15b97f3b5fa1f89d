"""The command ``replay``: finds the verb, and turns every error into one sentence and an exit code.

0 ok; 1 failure or invalid input; 2 usage or missing path; 3 completed with data loss; 4 a gate failed; 130 interrupted.
"""

import atexit
import gc
import json
import os
import sys
import warnings
from _thread import interrupt_main
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from errno import EBADF, EDQUOT, EFBIG, EIO, ENOMEM, ENOSPC
from importlib import import_module
from itertools import pairwise
from math import inf
from threading import Timer
from typing import Final

import click

from replay.cli.commands import ALIASES, COMMANDS, GROUPS
from replay.cli.console import EXIT_FAILURE, EXIT_INTERRUPTED, EXIT_OK

DEBUG_OPTION: Final = "--debug"
DISK_FULL_ERRNOS: Final = (EBADF, EDQUOT, EFBIG, EIO, ENOSPC)
"""What a system says of a stream that takes no more; it names no file where that is standard output."""
LEAST_ADDRESS_BYTES: Final = (256 << 20) + (os.cpu_count() or 1) * (64 << 20)
"""Address space in which the libraries can be loaded; with less OpenBLAS hangs, or ends the process (2026-11)."""


INTERRUPT_RETRY_S: Final = 0.05
"""Until a lost Ctrl-C is asked again: the callback that lost it has returned by then."""


COLLECTOR_THRESHOLDS: Final = (50_000, 20, 50)
"""When the collector of reference cycles looks: at Python's 700 objects it took 0.45 of the 7.1 s of a run."""

EXIT_HANDLERS_S: Final = 1.0
"""What an interrupted program grants the exit handlers of its libraries; Dask's may wait for 12 s."""


class LazyGroup(click.Group):
    """Verbs by name from the table; help is answered from the table alone."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """All verbs."""
        del ctx
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The verb, its module imported now."""
        del ctx
        verb = ALIASES.get(cmd_name, cmd_name)
        if verb not in COMMANDS:
            return None
        module, _, attribute = COMMANDS[verb].entry.partition(":")
        return getattr(import_module(module), attribute)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the verbs by group, in the order of a day's work."""
        del ctx
        for group in GROUPS:
            rows = [(name, spec.help) for name, spec in COMMANDS.items() if spec.group == group]
            if rows:
                with formatter.section(group):
                    formatter.write_dl(rows, col_max=12)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the verb; a mistyped one is answered with its nearest neighbour."""
        verb = args[0]
        if verb not in COMMANDS and verb not in ALIASES and not verb.startswith("-"):
            from difflib import get_close_matches

            nearest_verbs = get_close_matches(verb, COMMANDS, n=1)
            hint = f"did you mean {nearest_verbs[0]!r}?" if nearest_verbs else f"there are: {', '.join(COMMANDS)}"
            raise click.UsageError(f"no verb {verb!r}; {hint}", ctx)
        return super().resolve_command(ctx, args)


@click.group(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="`replay VERB --help` says more. First time here? `replay demo`.",
)
@click.version_option(package_name="vrlab-replay", message="replay %(version)s", help="Print the version.")
def cli() -> None:
    """Replay recorded VR laboratory sessions: see what collision detection missed, and what catching it costs."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    given_arguments = list(sys.argv[1:] if arguments is None else arguments)
    # The collector would look through all that the libraries made once more at the end: 0.6 s of a run.
    atexit.register(gc.freeze)
    if arguments is None:
        gc.set_threshold(*COLLECTOR_THRESHOLDS)
    _make_streams_safe()
    if sys.stdout is None:  # closed by `>&-`: a file opened later would take its number, and what is printed
        click.echo("error: standard output is closed; send it to a file, or to the null device", err=True)
        return EXIT_FAILURE
    if memory_allowed() < LEAST_ADDRESS_BYTES:
        return _report_failure(MemoryError(), debug=False)
    try:
        with warnings.catch_warnings(), _interrupts_repeated():
            # What NumPy remarks on a calculation, or a plot on a letter, is for its programmer.
            warnings.simplefilter("ignore")
            code = cli.main(args=given_arguments, prog_name="replay", standalone_mode=False)
        sys.stdout.flush()
    except (click.exceptions.Abort, KeyboardInterrupt):
        click.echo("interrupted; nothing half-written was left behind", err=True)
        if arguments is None:
            _end_soon()
        return EXIT_INTERRUPTED
    except click.ClickException as error:
        _print_error_as_json(given_arguments, error.format_message(), error.exit_code)
        return _report_usage_error(error)
    except BrokenPipeError:
        _silence_stdout()
        return EXIT_FAILURE
    except Exception as error:
        _print_error_as_json(given_arguments, str(error), EXIT_FAILURE)
        return _report_failure(error, debug=DEBUG_OPTION in given_arguments)
    return code if isinstance(code, int) else EXIT_OK


def _end_soon() -> None:
    """End this interrupted program even where a library waits for threads or workers of its own at exit."""
    end_timer = Timer(EXIT_HANDLERS_S, os._exit, [EXIT_INTERRUPTED])
    end_timer.daemon = True
    end_timer.start()


@contextmanager
def _interrupts_repeated() -> Iterator[None]:
    """Ctrl-C while a library calls back into Python (numba's compiler does) would be printed and lost."""
    previous_hook = sys.unraisablehook

    def interrupt_again(lost: "sys.UnraisableHookArgs") -> None:
        if issubclass(lost.exc_type, KeyboardInterrupt):
            retry_timer = Timer(INTERRUPT_RETRY_S, interrupt_main)
            retry_timer.daemon = True
            retry_timer.start()
        else:
            previous_hook(lost)

    sys.unraisablehook = interrupt_again
    try:
        yield
    finally:
        sys.unraisablehook = previous_hook


def _print_error_as_json(given: Sequence[str], message: str, code: int) -> None:
    """The error as JSON on standard output, for who asked for JSON; people read the sentence on the other stream."""
    if {"--json", "--format=json"} & {*given} or ("--format", "json") in pairwise(given):
        with suppress(OSError):
            click.echo(json.dumps({"error": _sentence(message), "exit_code": code}))


def _report_usage_error(error: click.ClickException) -> int:
    if isinstance(error, click.exceptions.NoArgsIsHelpError):
        click.echo(error.format_message(), err=True)
        return error.exit_code
    click.echo(f"error: {_sentence(error.format_message())}", err=True)
    if isinstance(error, click.UsageError) and error.ctx is not None:
        click.echo(f"       {error.ctx.command_path} --help says how it is used", err=True)
    return error.exit_code


def _report_failure(error: Exception, *, debug: bool) -> int:
    if debug:
        import traceback

        traceback.print_exception(error)
    if isinstance(error, OSError) and error.filename is None and error.errno in DISK_FULL_ERRNOS:
        _silence_stdout()
        message = f"writing failed ({error.strerror}); check the space left where standard output and files go"
        click.echo(f"error: {message}", err=True)
    elif _memory_ran_out(error):
        message = "the memory ran out; close other programs, or replay a part with --start and --end"
        click.echo(f"error: {message}", err=True)
    elif _is_known(error):
        click.echo(f"error: {_sentence(str(error))}", err=True)
    else:
        error_text = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
        click.echo(f"error: this should not have happened ({_sentence(error_text)}); please report it", err=True)
        if not debug:
            hint = f"with {DEBUG_OPTION} the same command prints where it happened; add that to the report"
            click.echo(f"       {hint}", err=True)
    return EXIT_FAILURE


def _memory_ran_out(error: Exception) -> bool:
    """Whether the process has no memory left; under a limit, libraries say so with errors of several kinds."""
    if isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == ENOMEM):
        return True
    is_library_error = isinstance(error, SystemError | RuntimeError | ImportError | OSError)
    return is_library_error and memory_allowed() < inf and not _is_known(error)


def memory_allowed() -> float:
    """Bytes of address space that the system grants this process (``ulimit -v``)."""
    if sys.platform == "win32":
        return inf
    import resource

    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return inf if limit == resource.RLIM_INFINITY else limit


def _is_known(error: Exception) -> bool:
    """Whether somebody raised this on purpose; a file that the system refuses counts, and so does a full memory."""
    from cdcore.errors import CollisionCoreError
    from replay.errors import ReplayError
    from sessions.errors import SessionError

    names_a_file = isinstance(error, OSError) and error.filename is not None
    return names_a_file or isinstance(error, CollisionCoreError | ReplayError | SessionError)


def _sentence(text: str) -> str:
    from replay.words import safe_text

    return safe_text(" ".join(text.split()))


def _make_streams_safe() -> None:
    """A console that cannot show a character shows a question mark, instead of ending the program."""
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115, PTH123
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="replace")


def _silence_stdout() -> None:
    """The reader of our output has gone: let nothing be written to it at exit either."""
    sys.stdout = open(os.devnull, "w")  # noqa: SIM115, PTH123


if __name__ == "__main__":
    sys.exit(main())
