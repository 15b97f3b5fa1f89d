"""Text of a recording that commands: no browser runs it and no terminal obeys it, in any page and any verb."""

import fcntl
import os
import re
import struct
import sys
import termios
import threading
from dataclasses import replace
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


def runs_a_script(page, folder):
    """Marks that scripts of the page left when Chromium had shown it."""
    return re.findall(r"data-owned[0-9]*", re.match(r"(?s).*?<html[^>]*>", page_after_its_scripts(page, folder))[0])


@pytest.mark.slow
def test_browser_runs_each_script_of_a_raw_page(tmp_path):
    """Each script leaves a mark of its own, so that the tests below would notice any of them."""
    marked = [script.replace("data-owned", f"data-owned{k}") for k, script in enumerate(SCRIPTS)]
    page = f"<!DOCTYPE html><html><body>{'<p>x</p>'.join(marked)}</body></html>"
    assert sorted(runs_a_script(page, tmp_path)) == [f"data-owned{k}" for k in range(len(SCRIPTS))]


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES)
def test_a_browser_runs_no_script_of_a_recording(name, tmp_path):
    """Neither where the page forbids scripts, nor where it does not; nor where it forbids them and says one raw."""
    word = "".join(SCRIPTS)
    page = PAGES[name](word)
    assert page.count(str(escape(word))) > 3 and word not in page
    assert not runs_a_script(page, tmp_path)
    free = re.sub('<meta http-equiv="Content-Security-Policy"[^>]*>', "", page)
    assert free != page and not runs_a_script(free, tmp_path)
    assert not runs_a_script(page.replace("</h1>", f"{word}</h1>", 1), tmp_path)
    assert runs_a_script(free.replace("</h1>", f"{word}</h1>", 1), tmp_path), "without either a script runs"


# --- Terminals ---

COMMANDS = "$\\frac{$\x1b[2J\x1b]0;owned\x07\x9b31m\u202e\x1b[38;5;201m[/red][bold]\rx\ny\x00"
OWN = re.compile(r"\x1b\[(?:[0-9;]*m|\?25[lh]|[0-9]*[AK])|\r")
"""What we send ourselves: colours, the cursor of a bar, ends of lines."""


def recorded(*words):
    """The exit code of a verb, and the pieces that a terminal of 100 columns gets while it runs."""
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
            return main([str(word) for word in words]), output
    finally:
        sys.stdout, sys.stderr = streams
        listener.join()
        os.close(master)


@pytest.fixture(scope="module")
def places(tmp_path_factory):
    """Files whose names and texts command a terminal."""
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
"""In this order: a later verb reads what an earlier one wrote."""

WORKS = {
    "info", "doctor", "import", "run", "run again", "diff", "shrink", "tradeoff", "engine",
    "runs", "study page", "scene new", "scene check", "share", "minimise", "guide",
}  # fmt: skip


def test_hostile_text_is_tried_on_every_command():
    """The first word of each call in CALLS is a command; together they are all of the program."""
    from replay.cli.commands import COMMANDS as VERBS

    files = dict.fromkeys(("mcap", "torn", "csv", "toml", "obj"), "file")
    assert {arguments(files, Path())[0] for arguments in CALLS.values()} >= VERBS.keys()


def test_text_is_displayed_without_its_control_commands():
    """A backslash, an escape and an end of line are written as escapes; with ``lines`` ends of lines stay."""
    assert safe_text("\\\x1b\n") == "\\\\x1b\\n" and safe_text("\x1b\n", lines=True) == "\\x1b\n"


@pytest.mark.slow
def test_no_verb_sends_a_terminal_what_a_recording_says(places, monkeypatch):
    """The recording's texts hold control sequences for a terminal, such as a colour, 38;5;201m, and a line y."""
    position, files = places
    monkeypatch.chdir(position)
    monkeypatch.setenv("TERM", "xterm-256color")
    for name, arguments in CALLS.items():
        code, pieces = recorded(*arguments(files, position))
        output = b"".join(pieces).decode("utf-8")
        assert (code == 0) == (name in WORKS), (name, code, output)
        assert "201m" not in output.replace("\\x1b[38;5;201m", ""), name
        left = OWN.sub("", output)
        assert left.strip() and all(item.isprintable() or item == "\n" for item in left), (name, ascii(output[-2000:]))
        assert "should not have happened" not in left, (name, output)
        assert "\ny" not in left, (name, output)
