import gc
import os
import signal
import subprocess
import sys
import time
import warnings

import click
import pytest
from support.small_worlds import unit_cubes_on_x

from replay.cli import main as module
from replay.cli.commands import COMMANDS, GROUPS
from replay.cli.main import COLLECTOR_THRESHOLDS, main
from replay.errors import AssemblyError
from replay.guide.pages import INDEX_PAGE, page
from sessions import write_session


@pytest.mark.parametrize("name", COMMANDS)
def test_every_verb_has_help_and_the_common_options(capsys, name):
    """``name``: a verb of the program; ``--help`` is asked of it, and of verbs below it, as of ``scene check``.

    The program's own list has a line of at most 70 letters for each, in a group.
    """
    assert len(COMMANDS[name].help) <= 70 and COMMANDS[name].group in GROUPS
    command = module.cli.get_command(click.Context(module.cli), name)
    for verb in getattr(command, "commands", {"": command}):
        assert main([name, *filter(None, [verb]), "--help"]) == 0
        printed = capsys.readouterr().out
        assert f"Usage: replay {name}" in printed and "None" not in printed
        assert all(option in printed for option in ("-v, --verbose", "-q, --quiet", "--debug"))


def make_program_raise(monkeypatch, error):
    """Let the program end with this error."""

    def fail(**_):
        raise error

    monkeypatch.setattr(module.cli, "main", fail)


def test_exhausted_memory_is_a_clear_error(monkeypatch, capsys):
    """A verb ends in MemoryError: no bug that somebody should report."""
    make_program_raise(monkeypatch, MemoryError())
    assert main(["info"]) == 1
    output = capsys.readouterr().err
    assert output.startswith("error: the memory ran out; ") and "report" not in output


def test_warnings_of_libraries_are_not_displayed(monkeypatch):
    """NumPy's warnings, on an overflow say, are for its programmer; a verb succeeds in spite of one."""
    monkeypatch.setattr(module.cli, "main", lambda **_: warnings.warn("overflow", RuntimeWarning, stacklevel=1))
    with warnings.catch_warnings(record=True) as recorded:
        warnings.simplefilter("always")
        assert main(["info"]) == 0
    assert not recorded


def test_limited_address_space_is_refused_as_too_little_memory(monkeypatch, capsys):
    """The operating system limits the process to 200 MB and 64 MB a processor; 256 MB and 64 MB a processor are needed.

    With twice as much the program runs.
    """
    resource = pytest.importorskip("resource")
    megabyte = 1 << 20
    too_little = 200 * megabyte + (os.cpu_count() or 1) * 64 * megabyte
    monkeypatch.setattr(resource, "getrlimit", lambda _: (too_little, too_little))
    assert main(["--version"]) == 1 and "the memory ran out" in capsys.readouterr().err
    monkeypatch.setattr(resource, "getrlimit", lambda _: (2 * too_little, 2 * too_little))
    assert main(["--version"]) == 0


def test_undecodable_path_is_refused_without_a_traceback(tmp_path, capsys):
    """The name of the output folder has a byte that is not UTF-8, which Python decodes to a lone surrogate.

    The call is wrong (2); the folder of sessions, which is empty, is not looked at. What is printed is ASCII, as a lone
    surrogate cannot be printed.
    """
    assert main(["run", str(tmp_path), "-o", "a\udcff"]) == 2
    output = capsys.readouterr().err
    assert r"error: Invalid value for '--out' / '-o': 'a\udcff' is not UTF-8; name another" in " ".join(output.split())
    assert "this should not have happened" not in output and output.isascii()


@pytest.mark.parametrize(
    ("error", "code", "sentence", "has_traceback"),
    [
        (AssemblyError("no frame;\n  record some"), 1, "error: no frame; record some\n", True),
        (RuntimeError("by zero"), 1, "(RuntimeError: by zero); please report it\n       with --debug", True),
        (KeyboardInterrupt(), 130, "interrupted", False),  # as shells have it: 128 and the number of SIGINT, 2
    ],
    ids=["error of the product", "unexpected error", "Ctrl-C"],
)
def test_errors_print_a_sentence_and_with_debug_a_traceback(monkeypatch, capsys, error, code, sentence, has_traceback):
    """A verb ends in ``error``; ``code``: the program's exit code.

    Someone who presses Ctrl-C knows where they did: of that there is no traceback, even with ``--debug``.
    """
    make_program_raise(monkeypatch, error)
    assert main(["info"]) == code
    output = capsys.readouterr().err
    assert sentence in output and "Traceback" not in output
    assert main(["info", "--debug"]) == code
    assert ("Traceback" in capsys.readouterr().err) == has_traceback


def test_a_reader_that_goes_away_ends_the_program_quietly():
    """The pipe is closed before anything is read, as in ``replay --help | true``."""
    code = "import sys; from replay.cli.main import main; sys.exit(main(['--help']))"
    program = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    program.stdout.close()
    assert b"Traceback" not in program.stderr.read()
    could_not_write = 1
    assert program.wait(30) in (0, could_not_write)


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="closed by `>&-`, and /dev/full, are POSIX")
@pytest.mark.parametrize(
    ("redirection", "unbuffered", "lines_of_error"),
    [(">&-", "1", 1), (">/dev/full", "", 1), (">&- 2>&-", "", 0)],
    ids=["closed", "on a full disk", "closed, with standard error"],
)
def test_unwritable_standard_output_ends_in_a_sentence(tmp_path, redirection, unbuffered, lines_of_error):
    """A shell redirects the standard output of `replay info`, and in the last row the stream that would say so.

    ``unbuffered``: "1" lets Python write at once, so that writing fails while it prints, else at its end;
    ``lines_of_error``: on the other stream.
    """
    write_session(unit_cubes_on_x({"a": [0, 1]}), tmp_path / "s.mcap")
    command = f"exec {sys.executable} -m replay info {tmp_path / 's.mcap'} {redirection}"
    environment = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, env=environment)
    lines = done.stderr.splitlines()
    assert done.returncode == 1 and len(lines) == lines_of_error
    assert all(line.startswith("error: ") and "standard output" in line for line in lines)


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for one process")
def test_ctrl_c_exits_130_and_leaves_nothing_behind(tmp_path):
    """The demo is interrupted a second after its first line: no traceback and no file stays."""
    command = [sys.executable, "-m", "replay", "demo", "-o", str(tmp_path / "run")]
    # A shell starts what it runs in the background with Ctrl-C switched off, and children inherit that.
    program = subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert program.stderr.readline().startswith(b"making up")
    time.sleep(1.0)
    program.send_signal(signal.SIGINT)
    _, text = program.communicate(timeout=60)
    # Interrupted while a library builds a class from text, Python ends itself by the signal; a shell calls both 130.
    assert program.returncode in (130, -signal.SIGINT), text
    assert b"Traceback" not in text and list(tmp_path.iterdir()) == []


CTRL_C_IN_A_CALLBACK = """
import ctypes, signal, sys, time
import click
from replay.cli import info
from replay.cli.main import main

@click.command()
def verb():
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell ignores it for what runs in the background
    ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGINT))()
    for _ in range(2000):
        time.sleep(0.01)

info.command = verb
sys.exit(main(["info"]))
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for one process")
def test_ctrl_c_while_a_library_calls_back_is_not_lost():
    """Another program has a verb that gets Ctrl-C in a callback from C, and would then sleep for 20 s.

    Python prints an exception in such a callback and goes on; this one is raised again, and ends the program.
    """
    done = subprocess.run([sys.executable, "-c", CTRL_C_IN_A_CALLBACK], capture_output=True, text=True)
    first_word, *_ = done.stderr.split()
    assert (done.returncode, first_word) == (130, "interrupted;")


def test_the_shell_completes_verbs_as_the_guide_says(monkeypatch, capsys):
    """Bash tells by variables of the environment that somebody typed ``replay doc`` and Tab: doctor completes it.

    The answer is a line "kind,value"; ``plain`` is a word. The guide's first page has the line that switches this on.
    """
    assert "_REPLAY_COMPLETE=bash_source replay" in page(INDEX_PAGE)
    completion = {"COMP_WORDS": "replay doc", "COMP_CWORD": "1", "_REPLAY_COMPLETE": "bash_complete"}
    for name, value in completion.items():
        monkeypatch.setenv(name, value)
    with pytest.raises(SystemExit, match="0"):
        main([])
    assert capsys.readouterr().out.split() == ["plain,doctor"]


def test_import_without_a_format_prints_the_complete_command(tmp_path, monkeypatch, capsys):
    """The format is missing, or the recording: both are wrong calls (2), and the command with both is printed."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my take.csv").write_text("time\n")
    assert main(["import", "my take.csv", "-o", "take.mcap"]) == 2
    assert "replay import auto 'my take.csv' -o take.mcap" in capsys.readouterr().err
    assert main(["import", "csv", "-o", "take.mcap"]) == 2
    assert "replay import auto take.csv -o take.mcap" in capsys.readouterr().err


def test_only_the_program_itself_collects_cycles_less_often(monkeypatch):
    """Without arguments ``main`` is the program, and changes the thresholds of Python's garbage collector.

    A caller that gives arguments is another program, with thresholds of its own.
    """
    changes = []
    monkeypatch.setattr(gc, "set_threshold", lambda *thresholds: changes.append(thresholds))
    monkeypatch.setattr(sys, "argv", ["replay", "--version"])
    assert main(["--version"]) == 0
    assert changes == []
    assert main() == 0
    assert changes == [COLLECTOR_THRESHOLDS]
