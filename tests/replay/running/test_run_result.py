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
"""A detector that samples every fifth frame of 10 ms."""
SEVEN_DETECTORS = {f"rate{rate}": ("discrete", {"rate_hz": rate}) for rate in range(10, 17)}


@pytest.fixture(scope="module")
def result_of_bump():
    """The result of a run of ``slow`` and exact, in which two cubes touch in frame 4 and in frames 8 to 10."""
    return replay.run(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors=SLOW)


@pytest.fixture(scope="module")
def result_of_crowd():
    """The result of a run of six bodies with names of over 200 letters, by seven detectors and exact."""
    positions = {f"body {k} " + "x" * 200: [3 * k, *[3 * k + 0.1] * 3] for k in range(6)}
    return replay.run(unit_cubes_on_x(positions), detectors=SEVEN_DETECTORS)


class Page(HTMLParser):
    """Elements of a page that are open at its end, addresses of links, and all text."""

    def __init__(self, html):
        super().__init__()
        self.open, self.links, self.texts = [], [], []
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)
        self.links += [value for name, value in attrs if name == "href"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.texts).split())


def test_repr_of_run_session_and_detection_fits_fifteen_lines(result_of_bump, result_of_crowd):
    """A run of six bodies, with names of over 200 letters, by eight detectors, its session and detections are printed.

    So are a small session, and its runs without detectors and without a reference; lines have 200 letters at most.
    """
    session = result_of_bump.session
    printed = [
        result_of_crowd, result_of_crowd.session, *result_of_crowd.detections.values(), session,
        replay.run(session, detectors=()), replay.run(session, oracle="none", detectors="exact"),
    ]  # fmt: skip
    for thing in printed:
        lines = repr(thing).split("\n")
        assert len(lines) <= 15 and max(map(len, lines)) <= 200, repr(thing)


def test_repr_of_a_session_file_reads_no_frames(tmp_path):
    """A session in memory says how many frames it has; one of a file reads them when they are asked for."""
    session = unit_cubes_on_x(MEET_IN_4_AND_8_TO_10)
    write_session(session, tmp_path / "s.mcap")
    read = replay.read_session(tmp_path / "s.mcap")
    assert "12 frames" in repr(session)
    assert "when they are asked for" in repr(read)
    assert "frames" not in vars(read)


def test_repr_of_a_run_lists_the_first_six_detectors(result_of_crowd):
    """Seven detectors and exact in the order of the ranking: six lines name the first ones, two are counted."""
    ranked = [rank.label for rank in result_of_crowd.ranking]
    assert len(ranked) == 8
    _title, *lines = repr(result_of_crowd).split("\n")
    assert [line.split()[0] for line in lines[:7]] == ["detector", *ranked[:6]]
    assert "... and 2 more in .ranking" in repr(result_of_crowd)


def test_run_displays_ranking_and_answer_in_text_and_html(result_of_bump):
    """Both detectors, what was missed, and the first answer; the HTML closes each of its elements."""
    page = Page(result_of_bump._repr_html_())
    assert page.open == []
    for text in (" ".join(repr(result_of_bump).split()), page.text):
        assert "slow" in text and "exact" in text and "missed" in text
        assert result_of_bump.answers[0].sentence in text
    assert "more in" not in repr(result_of_bump), "all detectors are listed"


def test_run_that_was_not_written_says_so(result_of_bump):
    """Without a folder of the run there is nothing to link to."""
    page = Page(result_of_bump._repr_html_())
    assert page.links == []
    assert "Nothing was written" in page.text
    assert "Nothing was written" in repr(result_of_bump)


def test_written_run_names_its_folder_and_links_its_report(result_of_bump, tmp_path):
    """A run of two cubes is written without its picture; in text and in HTML the result says where."""
    written = result_of_bump.write(tmp_path / "run", picture=False)
    (link,) = Page(written._repr_html_()).links
    assert link.rpartition("/")[2] == "report.html"
    assert str(tmp_path / "run") in repr(written)


def test_long_path_of_a_run_is_cut_short(result_of_bump):
    """A line has 100 letters: "Written to ", 86 of the 150 of the path and three dots; the answer above is whole."""
    *_, answer, folder = repr(replace(result_of_bump, out=Path("f" * 150))).split("\n")
    assert folder == f"Written to {'f' * 86}..."
    assert not answer.endswith("...")


def test_markup_in_body_names_is_escaped_in_notebook_html():
    """Bodies are called <b>a and b&: no element of the page stays open, and the name is read as text."""
    session = unit_cubes_on_x({"<b>a": [0] * 4, "b&": [0.5, 3, 3, 0.5]})
    result = replay.run(session, detectors=SLOW)
    for thing in (result, result.detections["slow"]):
        page = Page(thing._repr_html_())
        assert page.open == []
        assert "<b>a" in page.text


SVG = "{http://www.w3.org/2000/svg}"


def test_plot_draws_every_detector_over_cost_and_time(result_of_bump):
    """The picture, a scatter and a lane of contacts for each detector are an SVG each; texts name the detectors."""
    plot = result_of_bump.plot()
    assert repr(plot) == "Plot of 2 detectors: accuracy against cost, and contacts over time"
    tree = ElementTree.fromstring(plot._repr_svg_())
    texts = ["".join(node.itertext()) for node in tree.iter(f"{SVG}text")]
    assert any(text.startswith("slow: ") for text in texts)
    assert any(text.startswith("exact: 0") for text in texts), "no error"
    lanes = 2
    assert len([*tree.iter(f"{SVG}svg")]) == 1 + lanes, "the scatter is a group"
    assert "slow: " in tree.get("aria-label")


def test_plot_stacks_answer_scatter_legend_lanes_and_ticks(result_of_bump):
    """Each part begins below the part above it; positions from top to bottom are in units of the picture.

    At most 40 units stay empty above scatter and legend, at most 80 above lanes and below them.
    """
    tree = ElementTree.fromstring(result_of_bump.plot()._repr_svg_())
    titles = [float(text.get("y")) for text in tree.findall(f"{SVG}text[@font-size='17']")]
    scatter_top = float(re.search(r"translate\(0 (.*)\)", tree.find(f"{SVG}g").get("transform"))[1])
    legend = [(float(box.get("x")), float(box.get("y"))) for box in tree.findall(f"{SVG}rect[@rx='3']")]
    lanes = [float(lane.get("y")) for lane in tree.findall(f"{SVG}svg")]
    lane_height, letter_height, legend_box = 18.0, 13.0, 12.0
    _scatter_width, scatter_height = SCATTER_SIZE
    *_, tick = [float(text.get("y")) for text in tree.findall(f"{SVG}text")]
    picture_height = float(tree.get("viewBox").split()[3])
    assert titles[-1] < scatter_top < titles[-1] + 40
    legend_top = legend[0][1]
    assert scatter_top + scatter_height < legend_top < scatter_top + scatter_height + 40
    assert all(right - left > legend_box for (left, _), (right, _) in pairwise(legend))
    assert legend_top + legend_box + letter_height < lanes[0] < legend_top + 80
    assert all(lower - upper > lane_height + letter_height for upper, lower in pairwise(lanes))
    assert lanes[-1] + lane_height + letter_height < tick < picture_height < lanes[-1] + 80


@pytest.mark.slow
@pytest.mark.parametrize("name", ['<b>a"&', "]]>\u202e"], ids=["markup", "end of a section, and reversed text"])
def test_plot_takes_any_name_as_text(name):
    """The name of a body: the SVG is well-formed."""
    result = replay.run(unit_cubes_on_x({name: [0] * 4, "b": [0.5, 3, 3, 0.5]}), detectors=SLOW)
    assert ElementTree.fromstring(result.plot()._repr_svg_()).tag == f"{SVG}svg"


@pytest.mark.slow
def test_a_written_run_is_that_run_with_a_folder(result_of_bump, tmp_path):
    """Writing again to the same folder needs ``force``."""
    written = result_of_bump.write(tmp_path / "run", picture=False)
    assert written.out == tmp_path / "run"
    assert (written.out / "report.html").is_file()
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


@pytest.fixture(scope="module")
def equal_run_folders(result_of_bump, tmp_path_factory):
    """One run written to two folders, a and b."""
    folder = tmp_path_factory.mktemp("equal")
    return [result_of_bump.write(folder / name, picture=False).out for name in ("a", "b")]


def test_two_runs_are_compared_from_python(equal_run_folders):
    """One run, written to two folders: nothing changed between them."""
    assert not replay.diff(*equal_run_folders).changed


def test_two_runs_are_shared_from_python(equal_run_folders, tmp_path):
    """One run, written to two folders: both go to one page; ``anyway``: no consent is recorded."""
    page = replay.share(equal_run_folders, tmp_path / "shared", anyway=True)
    assert page == tmp_path / "shared" / "index.html"
    assert page.is_file()


def tetrahedral_body():
    """A body called a."""
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
    "a folder for a file": (lambda r, p: replay.run(p), replay.ERRORS, "folder|directory"),
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


@pytest.mark.parametrize(("use", "error", "hint"), WRONG_CALLS.values(), ids=WRONG_CALLS)
def test_wrong_use_gets_a_sentence(use, error, hint, result_of_bump, tmp_path):
    """``use``: a wrong call with a run ``r`` and an empty folder ``p``; ``hint``: words of the error.

    Its message is one line of 10 to 500 letters. All errors are in ``replay.ERRORS``, but for that of a misspelt name.
    """
    with pytest.raises(error) as raised:
        use(result_of_bump, tmp_path)
    message = str(raised.value)
    assert "\n" not in message and 10 < len(message) < 500
    assert re.search(hint, message)
    assert isinstance(raised.value, (*replay.ERRORS, AttributeError))


def test_a_keyword_misspelt_is_named(result_of_bump):
    """ "detector" in place of "detectors"."""
    with pytest.raises(TypeError, match="unexpected keyword argument 'detector'"):
        replay.run(result_of_bump.session, detector="exact")


def test_a_prompt_prints_nothing_but_the_result():
    """A new Python process makes a session of three frames and prints it; standard error stays empty."""
    code = (
        "import numpy as np, replay;"
        "turns = np.tile([0, 0, 0, 1.0], (3, 1));"
        "print(replay.Session.from_arrays([0, 1, 2], {'a': (np.zeros((3, 3)), turns)}))"
    )
    process = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert "3 frames" in process.stdout
    assert process.stderr == ""
