"""Text of a recording that is code: no browser runs it and no terminal obeys it, in any page and any command."""

import fcntl
import os
import re
import struct
import sys
import termios
import threading
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from markupsafe import escape
from support import study_samples
from support.small_worlds import cube
from support.study_samples import a_class, codebook, made_class, metrics, questionnaire
from support.viewers import page_after_its_scripts

from replay.cli.main import main
from replay.engine import compute
from replay.show.report.page import report_html, view_of
from replay.show.results.run_folder import RunFolder
from replay.show.share import folder
from replay.studies.class_study.analysis import analyse
from replay.studies.class_study.class_runs import read_class
from replay.studies.class_study.page import Heading, study_html
from replay.words import safe_text
from sessions import Event, Interval, Session, parse_scene, write_session

MARK = "document.documentElement.setAttribute('data-owned',1)"
"""A script that leaves a mark: the page's first element gets an attribute."""
SCRIPTS = [
    f"<script>{MARK}</script>",
    f'<img src=x onerror="{MARK}">',
    f'"><svg onload="{MARK}">',
    f"</style></title></svg></textarea>--><script>{MARK}</script>",
    f'<iframe srcdoc="<script>parent.{MARK}</script>"></iframe>',
    f'<details open ontoggle="{MARK}">x',
    f'<svg><animate onbegin="{MARK}" attributeName="x" dur="1s"/></svg>',
    f'<meta http-equiv=refresh content="0;url=javascript:{MARK}"><style onload="{MARK}"></style>',
]
"""Each of them runs in a page that says it raw."""

SCENE = """
[scene]
name = "{0}"
[[body]]
id = "{0} b"
[[body]]
id = "{0} a"
[[effect]]
kind = "contact"
between = ["{0} a", "{0} b"]
"""


def hostile(word):
    """A session that says a word wherever a recording can."""
    times, still = np.arange(60) * 10_000_000, np.tile([0.0, 0.0, 0.0, 1.0], (60, 1))
    positions = {f"{word} a": [0] * 60, f"{word} b": [3, 2, 0.9, 2, 3, 4] * 10}
    poses = {name: (np.outer(where, [1.0, 0.0, 0.0]), still) for name, where in positions.items()}
    facts = {"pseudonym": word, "consent": word, "vr_type": word, "recovered": word, "assumed": word, word: word}
    made = Session.from_arrays(
        times,
        poses,
        {name: cube() for name in poses},
        parse_scene(SCENE.replace("{0}", "".join(f"\\u{ord(item):04x}" for item in word))),
        events=[Event(20_000_000, word, word, f"{word} a")],
        intervals=[Interval(0, 500_000_000, word, word)],
        facts=facts,
    )
    return replace(made, origin=word)


def report_of(word):
    """The report of a run whose names are all this word."""
    return report_html(compute(hostile(word), detectors="slow=discrete[rate_hz=20]"))


def study_of(word):
    """The page of a study whose names are all this word."""
    answers, contacts = a_class(count=40, seed=3)
    requested = codebook((("motivation", "ease of use"), ("motivation", "contacts_per_min", "grasps")))
    study = analyse(requested, questionnaire(answers), metrics(contacts, detectors=("exact", word), recall=(1.0, 0.9)))
    study = replace(study, reliabilities={f"{name} {word}": item for name, item in study.reliabilities.items()})
    return page_of_class(word, study)


def class_of(word):
    """The page of a class whose names are all this word."""
    return page_of_class(word, study=None)


def page_of_class(word, study):
    """The page of a class whose names are all this word, with a study or none."""
    with TemporaryDirectory() as base, pytest.MonkeyPatch.context() as patch:
        for name in ("PAIRS", "TASKS", "STAGES", "TYPES", "CAUSES"):
            patch.setattr(study_samples, name, [(word, word)] if name == "PAIRS" else [word, word])
        runs = read_class(made_class(Path(base), sessions=12, students=6, detectors={word: 0.5}, rare=0))
        return study_html(runs, dict.fromkeys(runs.metrics, (word, "run")), study, Heading(f"A class of {word}"))


def shared_of(word):
    """A page to be sent, of a run whose names are all this word."""
    result = compute(hostile(word), detectors="slow=discrete[rate_hz=20]")
    return folder.shared_page(replace(view_of(result), pictured=True), word)


def list_of(word):
    """The list of two runs in a shared folder, whose names are all this word."""
    runs = [RunFolder(Path(word), compute(hostile(word), detectors="slow=discrete[rate_hz=20]").document)] * 2
    return folder.list_page(dict(zip(("run1", "run2"), runs, strict=True)), {"run1": word, "run2": word})


PAGES = {
    "report": report_of,
    "study": study_of,
    "class": class_of,
    "shared": shared_of,
    "list of shared runs": list_of,
}
"""Page -> its HTML where everything is called so. A page to come is a row."""


def marks_of_scripts(page, folder):
    """Marks that scripts of a page left, "data-owned" or with a number, after Chromium has shown it."""
    first_element = re.match(r"(?s).*?<html[^>]*>", page_after_its_scripts(page, folder))[0]
    return re.findall(r"data-owned[0-9]*", first_element)


@pytest.mark.slow
def test_browser_runs_each_script_of_a_raw_page(tmp_path):
    """A page with eight scripts (SCRIPTS) as they are; each leaves a mark of its own, so that tests would notice any of
    them.
    """
    numbered = [script.replace("data-owned", f"data-owned{k}") for k, script in enumerate(SCRIPTS)]
    page = f"<!DOCTYPE html><html><body>{'<p>x</p>'.join(numbered)}</body></html>"
    assert sorted(marks_of_scripts(page, tmp_path)) == [f"data-owned{k}" for k in range(len(SCRIPTS))]


POLICY = '<meta http-equiv="Content-Security-Policy"[^>]*>'
"""The element by which a page forbids scripts."""
ALL_SCRIPTS = "".join(SCRIPTS)


@cache
def page_called_like_scripts(name):
    """The page of this name in which everything is called like all scripts together."""
    return PAGES[name](ALL_SCRIPTS)


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES)
def test_a_browser_runs_no_script_of_a_recording(name, tmp_path):
    """A page of a recording, or of many, in which everything is called like eight scripts: it has them escaped.

    Chromium runs none of them, neither where the page forbids scripts, nor where that is taken out.
    """
    page = page_called_like_scripts(name)
    assert page.count(str(escape(ALL_SCRIPTS))) > 3
    assert ALL_SCRIPTS not in page
    assert not marks_of_scripts(page, tmp_path)
    without_policy = re.sub(POLICY, "", page)
    assert without_policy != page
    assert not marks_of_scripts(without_policy, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES)
def test_a_page_forbids_scripts_that_were_not_escaped(name, tmp_path):
    """Eight scripts that leave marks are put behind the title as they are: they run only where the
    policy is taken out.
    """
    page = page_called_like_scripts(name).replace("</h1>", f"{ALL_SCRIPTS}</h1>", 1)
    assert ALL_SCRIPTS in page
    assert not marks_of_scripts(page, tmp_path)
    assert marks_of_scripts(re.sub(POLICY, "", page), tmp_path)


# --- Terminals ---

COMMANDS = "$\\frac{$\x1b[2J\x1b]0;owned\x07\x9b31m\u202e\x1b[38;5;201m[/red][bold]\rx\ny\x00"
"""Control sequences: clear the screen, set a title, colours, text from right to left; and a line of its own, y."""
OUR_SEQUENCES = re.compile(r"\x1b\[(?:[0-9;]*m|\?25[lh]|[0-9]*[AK])|\r")
"""What we send ourselves: colours, the cursor of a bar, ends of lines."""


def exit_code_and_output(*arguments):
    """The exit code of a command, and the bytes that a terminal of 100 columns gets while it runs."""
    master, slave = os.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 100, 0, 0))
    output, streams = [], (sys.stdout, sys.stderr)

    def listen():
        try:
            while data := os.read(master, 65536):
                output.append(data)
        except OSError:  # the other end is closed
            pass

    listener = threading.Thread(target=listen)
    listener.start()
    try:
        with os.fdopen(slave, "w", encoding="utf-8") as terminal:
            sys.stdout = sys.stderr = terminal
            code = main([str(argument) for argument in arguments])
    finally:
        sys.stdout, sys.stderr = streams
        listener.join()
        os.close(master)
    return code, b"".join(output).decode("utf-8")


@pytest.fixture(scope="module")
def hostile_folder(tmp_path_factory):
    """A folder, and by kind the paths of files in it whose names and texts are control sequences."""
    base = tmp_path_factory.mktemp("hostile")
    name = COMMANDS.replace("/", "").replace("\0", "")
    files = {kind: base / f"{name}.{kind}" for kind in ("mcap", "torn", "csv", "toml", "obj")}
    write_session(hostile(COMMANDS), files["mcap"])
    files["torn"].write_bytes(files["mcap"].read_bytes()[:-300])
    rows = [f"pose,{0.011 * k},{name},{0.01 * k},1,0,0,0,0,1,1,," for k in range(9)]
    head = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value"
    files["csv"].write_text("\n".join([head, *(row.replace("\n", "").replace("\r", "") for row in rows), ""]), "utf-8")
    files["toml"].write_text(SCENE.replace("{0}", "".join(f"\\u{ord(item):04x}" for item in COMMANDS)), "utf-8")
    files["obj"].write_bytes(b"\x1b[2J")
    return base, files


QUERY = ("--no-picture", "--detectors", "slow=discrete[rate_hz=20]")
CALLS = {
    "info": lambda f, d: ("info", "-v", f["mcap"]),
    "info of a torn file": lambda f, d: ("info", f["torn"]),
    "doctor": lambda f, d: ("doctor", "-v", f["mcap"], f["torn"]),
    "recover": lambda f, d: ("recover", f["torn"], d / "saved\x1b[2J"),
    "minimise": lambda f, d: ("minimise", "-v", f["mcap"], "-o", d / "less\x1b[2J.mcap"),
    "scene new": lambda f, d: ("scene", "new", f["mcap"], "-o", d / "s\x1b[2J.toml"),
    "scene check": lambda f, d: ("scene", "check", f["toml"]),
    "import": lambda f, d: ("import", "csv", f["csv"], "--convention", "unity", "-o", d / "i\x1b[2J.mcap"),
    "import with a mesh that is none": lambda f, d: ("import", "csv", f["csv"], "-o", "j", "--mesh", f"x={f['obj']}"),
    "run": lambda f, d: ("run", "-v", f["mcap"], "-o", d / "run\x1b[2J", *QUERY),
    "run again": lambda f, d: ("run", f["mcap"], "-o", d / "two\x1b[2J", "--no-picture", "--detectors", "sphere"),
    "view": lambda f, d: ("view", d / "run\x1b[2J", "--miss", "99"),
    "diff": lambda f, d: ("diff", d / "run\x1b[2J", d / "two\x1b[2J"),
    "shrink": lambda f, d: ("shrink", d / "run\x1b[2J", "--miss", "1", "-o", d / "case\x1b[2J", "--session", f["mcap"]),
    "share": lambda f, d: ("share", d / "run\x1b[2J", "--anyway", "-o", d / "shared\x1b[2J"),
    "share without consent": lambda f, d: ("share", d / "run\x1b[2J", "-o", d / "sent\x1b[2J"),
    "mesh": lambda f, d: ("mesh", "repair", f["obj"], "-o", d / "m\x1b[2J.glb"),
    "tradeoff": lambda f, d: ("tradeoff", f["mcap"], "--time-limit", "0.2", "-o", d / "t\x1b[2J", *QUERY),
    "engine": lambda f, d: ("tradeoff", f["mcap"], "--engine", "mujoco", "--no-picture"),
    "fix": lambda f, d: ("fix", f["mcap"], "--engine", "godot", "-o", d / "f\x1b[2J"),
    "runs": lambda f, d: ("run", f["mcap"], d / "less\x1b[2J.mcap", "-o", d / "class\x1b[2J", "--no-picture"),
    "study page": lambda f, d: ("study", "page", d / "class\x1b[2J", "-o", d / "page\x1b[2J"),
    "demo": lambda f, d: ("demo", "--scene", COMMANDS),
    "guide": lambda f, d: ("guide", COMMANDS),
    "stress": lambda f, d: ("stress", "--detector", COMMANDS),
    "paper": lambda f, d: ("paper", COMMANDS),
    COMMANDS: lambda f, d: (COMMANDS,),
}
"""Name -> the command line, of files by kind and a folder. In this order: a later command reads what an
earlier wrote.
"""

SUCCESSFUL = {
    "info", "doctor", "import", "run", "run again", "diff", "shrink", "tradeoff", "engine",
    "runs", "study page", "scene new", "scene check", "share", "minimise", "guide",
}  # fmt: skip


def test_hostile_text_is_tried_on_every_command():
    """The first word of each command line in CALLS is a command; together they are all of the program."""
    from replay.cli.commands import COMMANDS as ALL_COMMANDS

    files = dict.fromkeys(("mcap", "torn", "csv", "toml", "obj"), "file")
    commands_tried = {arguments(files, Path())[0] for arguments in CALLS.values()}
    assert commands_tried >= ALL_COMMANDS.keys()


@pytest.mark.parametrize(
    ("text", "lines", "expected"),
    [
        pytest.param("\\\x1b\n", False, "\\\\x1b\\n", id="in one line"),
        pytest.param("\x1b\n", True, "\\x1b\n", id="ends of lines stay"),
    ],
)
def test_text_is_displayed_without_its_control_commands(text, lines, expected):
    """A backslash, an escape character and an end of line are written as \\\\, \\x1b and \\n."""
    assert safe_text(text, lines=lines) == expected


@pytest.mark.slow
def test_no_command_sends_a_terminal_control_sequences_of_a_recording(hostile_folder, monkeypatch):
    """Names and texts of the files are control sequences, such as a colour, 38;5;201m, and a line of its own, y.

    Every command writes them escaped: apart from sequences of ours its output is printable. Commands that succeed and
    those that refuse are as expected, and none fails by accident.
    """
    folder, files = hostile_folder
    monkeypatch.chdir(folder)
    monkeypatch.setenv("TERM", "xterm-256color")
    for name, arguments in CALLS.items():
        code, output = exit_code_and_output(*arguments(files, folder))
        assert (code == 0) == (name in SUCCESSFUL), (name, code, output)
        assert "201m" not in output.replace("\\x1b[38;5;201m", ""), name
        text = OUR_SEQUENCES.sub("", output)
        assert text.strip(), name
        assert all(character.isprintable() or character == "\n" for character in text), (name, ascii(output[-2000:]))
        assert "\ny" not in text, (name, output)
        assert "should not have happened" not in text, (name, output)
