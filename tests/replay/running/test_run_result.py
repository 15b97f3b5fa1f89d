"""A run in a notebook: short, with its ranking, plotted, written and viewed; wrong uses get a sentence each."""

import re
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

import replay
from cdcore import Body, TriangleMesh, create_detector
from replay.show.notebook import SCATTER_SIZE
from sessions import write_session

SLOW = "slow=discrete[rate_hz=20]"
TEN_RATES = {f"rate{rate}": ("discrete", {"rate_hz": rate}) for rate in range(10, 20)}


@pytest.fixture(scope="module")
def result_of_bump():
    """The result of a run in which two cubes touch once."""
    return replay.run(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors=SLOW)


class Tags(HTMLParser):
    """Elements that are open, and all text."""

    def __init__(self, text):
        super().__init__()
        self.open, self.links, self.words = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)
        self.links += [value for name, value in attrs if name == "href"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)


def test_repr_of_run_session_and_detection_fits_fifteen_lines(tmp_path):
    """Six bodies with names of 200 letters, and eleven detectors, of which six are listed."""
    session = unit_cubes_on_x(MEET_IN_4_AND_8_TO_10)
    crowd = replay.run(
        unit_cubes_on_x({f"body {k} " + "x" * 200: [3 * k, *[3 * k + 0.1] * 11] for k in range(6)}), detectors=TEN_RATES
    )
    write_session(session, tmp_path / "s.mcap")
    read = replay.read_session(tmp_path / "s.mcap")
    assert "12 frames" in repr(session) and "when they are asked for" in repr(read) and "frames" not in vars(read)
    printed = [
        crowd, crowd.session, replay.run(session, detectors=()), replay.run(session, oracle="none", detectors="exact"),
        session, read, *crowd.detections.values(),
    ]  # fmt: skip
    for thing in printed:
        lines = repr(thing).split("\n")
        assert len(lines) <= 15 and max(map(len, lines)) <= 200, repr(thing)
    printed, ranked = repr(crowd), [rank.label for rank in crowd.ranking]
    assert f"... and {len(ranked) - 6} more in .ranking" in printed and len(ranked) > 6
    assert [line.split()[0] for line in printed.split("\n")[1:8]] == ["detector", *ranked[:6]]


def test_run_displays_ranking_and_answer_in_text_and_html(result_of_bump, tmp_path):
    """A run that was not written says so and has no link; a long path is cut short."""
    page = Tags(result_of_bump._repr_html_())
    assert page.open == []
    for printed in (repr(result_of_bump), " ".join(page.words)):
        assert "slow" in printed and "exact" in printed and "missed" in printed
        assert result_of_bump.answers[0].sentence in " ".join(printed.split())
    written = result_of_bump.write(tmp_path / "run", picture=False)
    links = Tags(written._repr_html_()).links
    assert [link.rpartition("/")[2] for link in links] == ["report.html"]
    assert page.links == [] and "Nothing was written" in " ".join(page.words)
    *_, answer, position = repr(replace(result_of_bump, out=Path("f" * 150))).split("\n")
    assert (
        position == f"Written to {'f' * 86}..." and not answer.endswith("...") and "more in" not in repr(result_of_bump)
    )
    assert str(tmp_path / "run") in repr(written) and "Nothing was written" in repr(result_of_bump)


def test_markup_in_body_names_is_escaped_in_notebook_html():
    """Bodies are called <b>a and b&: no element of the page stays open, and the name is read as text."""
    session = unit_cubes_on_x({"<b>a": [0] * 4, "b&": [0.5, 3, 3, 0.5]})
    matches = replay.run(session, detectors=SLOW)
    for thing in (matches, matches.detections["slow"]):
        page = Tags(thing._repr_html_())
        assert page.open == [] and "<b>a" in " ".join(page.words)


def test_plot_draws_every_detector_over_cost_and_time(result_of_bump):
    """An SVG of a scatter and a lane of contacts a detector, each an inner SVG or group, labelled by detector."""
    plot = result_of_bump.plot()
    assert repr(plot) == "Plot of 2 detectors: accuracy against cost, and contacts over time"
    tree = ElementTree.fromstring(plot._repr_svg_())
    texts = ["".join(node.itertext()) for node in tree.iter("{http://www.w3.org/2000/svg}text")]
    assert any(text.startswith("slow: ") for text in texts) and any(text.startswith("exact: 0") for text in texts)
    assert {"slow", "exact"} <= {text.split(":")[0].split(" ")[0] for text in texts}
    assert len([*tree.iter("{http://www.w3.org/2000/svg}svg")]) == 3 and "slow: " in tree.get("aria-label")


def test_plot_stacks_answer_scatter_legend_lanes_and_ticks(result_of_bump):
    """Positions from top to bottom, in units of the picture, of which 40 or 80 is the most that may stay empty.

    Every part begins below the part above it.
    """
    svg = "{http://www.w3.org/2000/svg}"
    tree = ElementTree.fromstring(result_of_bump.plot()._repr_svg_())
    titles = [float(text.get("y")) for text in tree.findall(f"{svg}text[@font-size='17']")]
    scatter_top = float(re.search(r"translate\(0 (.*)\)", tree.find(f"{svg}g").get("transform"))[1])
    legend = [(float(box.get("x")), float(box.get("y"))) for box in tree.findall(f"{svg}rect[@rx='3']")]
    lanes = [float(lane.get("y")) for lane in tree.findall(f"{svg}svg")]
    lane_height, letter_height = 18.0, 13.0
    *_, tick = [float(text.get("y")) for text in tree.findall(f"{svg}text")]
    height = float(tree.get("viewBox").split()[3])
    assert titles[-1] < scatter_top < titles[-1] + 40
    legend_top = legend[0][1]
    assert scatter_top + SCATTER_SIZE[1] < legend_top < scatter_top + SCATTER_SIZE[1] + 40
    assert all(right - left > 12 for (left, _), (right, _) in pairwise(legend))
    assert legend_top + 12 + letter_height < lanes[0] < legend_top + 80
    assert all(lower - upper > lane_height + letter_height for upper, lower in pairwise(lanes))
    assert lanes[-1] + lane_height + letter_height < tick < height < lanes[-1] + 80


@pytest.mark.slow
@pytest.mark.parametrize("name", ['<b>a"&', "]]>\u202e"])
def test_plot_takes_any_name_as_text(name):
    """Markup, the end of an XML section, and a sign that reverses text, as a body's name: the SVG is well-formed."""
    made = replay.run(unit_cubes_on_x({name: [0] * 4, "b": [0.5, 3, 3, 0.5]}), detectors=SLOW)
    assert ElementTree.fromstring(made.plot()._repr_svg_()).tag.endswith("svg")


@pytest.mark.slow
def test_a_written_run_is_that_run_with_a_folder(result_of_bump, tmp_path):
    """Writing again to the same folder needs ``force``."""
    written = result_of_bump.write(tmp_path / "run", picture=False)
    assert written.out == tmp_path / "run" and (written.out / "report.html").is_file()
    assert written.detections["slow"].digest == result_of_bump.detections["slow"].digest
    with pytest.raises(replay.ReplayError, match="force"):
        result_of_bump.write(tmp_path / "run")
    assert result_of_bump.write(tmp_path / "run", force=True, picture=False).out == tmp_path / "run"


@pytest.mark.skipif(find_spec("rerun_notebook") is None, reason="the extra notebook is not installed")
def test_notebook_view_works_for_written_and_unwritten_runs(result_of_bump, tmp_path):
    """``view`` gives Rerun's widget, of a size or without."""
    from rerun.notebook import Viewer

    assert isinstance(result_of_bump.view(), Viewer)
    assert isinstance(result_of_bump.write(tmp_path / "run").view(width=300, height=200), Viewer)


def test_missing_notebook_viewer_error_names_the_pip_command(result_of_bump, monkeypatch):
    """``None`` in sys.modules makes the import fail."""
    monkeypatch.setitem(sys.modules, "rerun_notebook", None)
    with pytest.raises(replay.ReplayError, match=r'pip install "vrlab-replay\[notebook\]"'):
        result_of_bump.view()


def test_two_runs_are_compared_and_shared_from_python(result_of_bump, tmp_path):
    """A run is written twice: nothing changed between a and b, and both go to one shared page."""
    a, b = (result_of_bump.write(tmp_path / name, picture=False).out for name in "ab")
    assert not replay.diff(a, b).changed
    assert replay.share([a, b], tmp_path / "shared", anyway=True).name == "index.html"
    assert (tmp_path / "shared" / "index.html").is_file()


def tetrahedral_body():
    """Body a, a tetrahedron."""
    return Body("a", TriangleMesh(np.eye(4, 3), [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))


WRONG_CALLS = {
    "an array for a session": (lambda r, p: replay.run(np.zeros((9, 3))), TypeError, "from_arrays"),
    "arrays for sessions": (lambda r, p: replay.audit([np.zeros((9, 3))]), TypeError, "from_arrays"),
    "nothing for a session": (lambda r, p: replay.run(None), TypeError, "from_arrays"),
    "an array to read": (lambda r, p: replay.read_session(np.zeros(3)), TypeError, "from_arrays"),
    "an array to advise on": (lambda r, p: replay.advise(np.zeros(3), engine="unity"), TypeError, "from_arrays"),
    "a path for a tradeoff": (lambda r, p: replay.tradeoff("s.mcap"), TypeError, "read_session"),
    "poses of no body": (lambda r, p: replay.Session.from_arrays([0], np.zeros((1, 7))), TypeError, "body name"),
    "a file that is not there": (lambda r, p: replay.read_session(p / "s.mcap"), replay.SessionError, "s.mcap"),
    "a folder for a file": (lambda r, p: replay.run(p), replay.ERRORS, str),
    "a detector misspelt": (lambda r, p: replay.run(r.session, detectors="exat"), KeyError, "did you mean 'exact'"),
    "a value misspelt": (lambda r, p: replay.run(r.session, detectors="collider[shape=blob]"), ValueError, "hull, box"),
    "a setting misspelt": (lambda r, p: replay.run(r.session, detectors="exact[contain=2]"), ValueError, "containment"),
    "a label misspelt": (lambda r, p: r.detections["slwo"], KeyError, "there are: .*slow"),
    "a pair of another": (lambda r, p: replay.run(r.session, pairs=[("a", "spoon")]), replay.ERRORS, "spoon"),
    "a policy misspelt": (lambda r, p: replay.run(r.session, policy="frozen=explode"), ValueError, "explode"),
    "an end before the start": (lambda r, p: replay.run(r.session, start=5, end=2), replay.ERRORS, "no frame lies"),
    "an audit of nothing": (lambda r, p: replay.audit([]), ValueError, "at least one"),
    "an audit without truth": (lambda r, p: replay.audit(r.session, oracle="none"), ValueError, "oracle"),
    "positions without turns": (
        lambda r, p: replay.Session.from_arrays([0, 1, 2], {"a": np.zeros((3, 3))}), replay.SessionError, "quaternions",
    ),
    "a mesh of one array": (
        lambda r, p: replay.Session.from_arrays([0], {"a": (np.zeros((1, 3)), [[0, 0, 0, 1.0]])}, {"a": np.eye(3)}),
        replay.SessionError, "vertices",
    ),
    "poses for a motion": (
        lambda r, p: create_detector("exact", [tetrahedral_body()]).detect(np.zeros((2, 1, 3))),
        replay.CollisionCoreError, "Motion",
    ),
    "nothing to view": (lambda r, p: replay.view(), replay.ReplayError, "at least one"),
    "a view of no run": (lambda r, p: replay.view(p), replay.ReplayError, "run"),
    "a share of no run": (lambda r, p: replay.share(p / "nowhere", p / "out"), replay.ReplayError, "nowhere"),
    "a diff of no run": (lambda r, p: replay.diff(p / "nowhere", p), replay.ReplayError, "nowhere"),
    "a number for a run to view": (lambda r, p: replay.view(3), TypeError, "path of a run folder"),
    "a number for a run to share": (lambda r, p: replay.share(3, p / "out"), TypeError, "path of a run folder"),
    "a number for runs to compare": (lambda r, p: replay.diff(3, p), TypeError, "path of a run folder"),
    "a number for runs to read": (lambda r, p: replay.read(3), TypeError, "path of a run folder"),
    "a session for a scene": (lambda r, p: replay.plan(r.session), TypeError, "session.scene"),
    "a number for a detector": (lambda r, p: replay.stress(3), replay.CollisionCoreError, "exact"),
    "a name misspelt": (lambda r, p: replay.adit, AttributeError, "audit"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG_CALLS)
def test_wrong_use_gets_a_sentence(case, result_of_bump, tmp_path):
    """A row of WRONG_CALLS is a call with a run ``r`` and an empty folder ``p``, an error's type, and words of it."""
    use, kind, hint = WRONG_CALLS[case]
    with pytest.raises(kind) as output:
        use(result_of_bump, tmp_path)
    text = str(output.value)
    assert "\n" not in text and 10 < len(text) < 500
    assert hint is str or re.search(hint, text)
    assert isinstance(output.value, replay.ERRORS) or case == "a name misspelt"


def test_a_keyword_misspelt_is_named(result_of_bump):
    """ "detector" in place of "detectors"."""
    with pytest.raises(TypeError, match="detector"):
        replay.run(result_of_bump.session, detector="exact")


def test_a_prompt_prints_nothing_but_the_result():
    """A new Python process makes a session of three frames and prints it; standard error stays empty."""
    code = (
        "import numpy as np, replay;"
        "turns = np.tile([0, 0, 0, 1.0], (3, 1));"
        "print(replay.Session.from_arrays([0, 1, 2], {'a': (np.zeros((3, 3)), turns)}))"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert "3 frames" in done.stdout and done.stderr == ""
