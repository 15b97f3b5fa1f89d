"""The script of the report in a browser: zoom, pointer, click, choices, keys, copies, files and addresses."""

import base64
from dataclasses import replace

import pytest
from support.report_states import MANY, run_with_steady_times
from support.small_worlds import unit_cubes_on_x
from support.viewers import opened, serious_faults

from replay.engine import compute
from replay.show.report.page import page_of, report_html, view_of

pytestmark = pytest.mark.slow

HOSTILE = '=cmd|"/c calc"!A1 <script>throw 1</script><img src=x onerror=alert(1)> &amp; \u202e'
CAPTURE = """window.saved = []; const make = URL.createObjectURL;
URL.createObjectURL = (blob) => { saved.push(blob); return make(blob); };
HTMLAnchorElement.prototype.click = function () { saved.names = [...saved.names ?? [], this.download]; }; 0"""


@pytest.fixture(scope="module")
def pages_folder(tmp_path_factory):
    return tmp_path_factory.mktemp("pages")


@pytest.fixture(scope="module")
def page(pages_folder):
    """Nine pairs, each missed or late, of two detectors."""
    detectors = "slow=discrete[rate_hz=12],late=discrete[rate_hz=7]"
    file = pages_folder / "report.html"
    file.write_text(
        report_html(compute(unit_cubes_on_x({"a": [0.0] * 40, **MANY}), detectors=detectors)), encoding="utf-8"
    )
    with opened(file.as_uri(), pages_folder) as page:
        page.ask(CAPTURE)
        yield page
        assert page.errors() == []


@pytest.fixture(autouse=True)
def begin(page):
    """Closes what an earlier test opened, and shows the whole timeline."""
    page.ask("document.querySelector('dialog').close(); location.hash = ''; scrollTo(0, 0); 0")
    press_key(page, "Escape")
    press_key(page, "0")


def press_key(page, key):
    """Press and release a key, and wait until the page is drawn again."""
    for kind in ("keyDown", "keyUp"):
        page.call("Input.dispatchKeyEvent", type=kind, key=key, **({"text": key} if len(key) == 1 else {}))
    page.ask("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(0))))")


def point_at(page, x, y, *, click=False):
    """Moves the pointer to a pixel, and clicks there if asked."""
    page.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
    for kind in ("mousePressed", "mouseReleased") if click else ():
        page.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)
    page.ask("new Promise((done) => requestAnimationFrame(() => done(0)))")


def second_on_lane(page, detector, fault):
    """Pixel of the middle of a fault on the lane of its detector."""
    return page.ask(f"""(() => {{
      const lane = document.querySelector('.lane[data-detector="{detector}"]');
      lane.scrollIntoView({{ block: 'center' }});
      const box = lane.getBoundingClientRect();
      const [x, , width] = lane.getAttribute('viewBox').split(' ').map(Number);
      const [first] = lane.closest('.time').dataset.window.split(' ').map(Number);
      const [start, end] = document.getElementById('{fault}').dataset.span.split(' ').map(Number);
      return [box.left + ((start + end) / 2 - first - x) / width * box.width, box.top + box.height / 2];
    }})()""")


def faults_on(page, detector):
    """Ids of the faults of a detector on the page."""
    return page.ask(f"[...document.querySelectorAll('[data-detector=\"{detector}\"] .fault')].map((node) => node.id)")


def worst_detector(page):
    """The detector whose faults stand first on the page."""
    return page.ask("document.querySelector('.faults').dataset.detector")


def current_fault(page):
    """The id of the fault that the page stands at, or nothing."""
    return page.ask("document.querySelector('.current')?.id ?? ''")


def view_boxes_of_lanes(page):
    """The windows of time of all lanes."""
    return page.ask("[...document.querySelectorAll('.time .lane')].map((lane) => lane.getAttribute('viewBox'))")


def test_lanes_zoom_and_pan_together_and_ruler_follows(page):
    """Key + zooms in, a drag by 80 pixels to the right moves to earlier times, key 0 shows all."""
    whole, ticks = view_boxes_of_lanes(page), page.ask("document.querySelector('.ticks').textContent")
    press_key(page, "+")
    closer = view_boxes_of_lanes(page)
    assert len(set(closer)) == 1 and closer != whole
    assert page.ask("document.querySelector('.ticks').textContent") != ticks
    x, y = page.ask("""(() => {
      const box = document.querySelector('.lane').getBoundingClientRect();
      return [box.left + box.width / 2, box.top + 5];
    })()""")
    page.call("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, button="left", clickCount=1)
    page.call("Input.dispatchMouseEvent", type="mouseMoved", x=x + 80, y=y, button="left", buttons=1)
    page.call("Input.dispatchMouseEvent", type="mouseReleased", x=x + 80, y=y, button="left", clickCount=1)
    page.ask("new Promise((done) => requestAnimationFrame(() => done(0)))")
    moved = view_boxes_of_lanes(page)
    assert len(set(moved)) == 1 and float(moved[0].split()[0]) < float(closer[0].split()[0])
    assert current_fault(page) == ""
    press_key(page, "0")
    assert [float(text.split()[2]) for text in view_boxes_of_lanes(page)] == [float(text.split()[2]) for text in whole]
    assert page.ask("document.querySelector('.ticks').textContent") == ticks


def test_pointer_reads_fault_detector_cause_and_size(page):
    """The pointer rests on the lane of a detector at a fault, then on that of the reference."""
    detector = worst_detector(page)
    fault = faults_on(page, detector)[0]
    point_at(page, *second_on_lane(page, detector, fault))
    text = page.ask("document.querySelector('.tip').innerText")
    facts = page.ask(f"({{...document.getElementById('{fault}').dataset}})")
    assert f"of {detector}: a and b0" in text and f"cause: {facts['cause']}" in text
    assert facts["size"] in text and facts["kind"] in text
    reference = page.ask("document.querySelector('.lane').dataset.detector")
    point_at(page, *second_on_lane(page, reference, fault))
    assert "Contact " in page.ask("document.querySelector('.tip').innerText")


def test_click_on_lane_opens_card_and_moves_cursor(page):
    """The address names the fault, its card is visible, and every chart draws a cursor."""
    detector = worst_detector(page)
    fault = faults_on(page, detector)[-1]
    point_at(page, *second_on_lane(page, detector, fault), click=True)
    page.wait_for("document.querySelector('.current')", 5)
    opened_fault = current_fault(page)
    assert page.ask("location.hash") == f"#{opened_fault}"
    assert page.ask("document.querySelector('.current').checkVisibility()")
    assert page.ask("[...document.querySelectorAll('.time .cursor')].every((path) => path.getAttribute('d'))")


def test_click_on_dot_opens_first_fault_of_its_detector(page):
    """The dot is that of another detector than the one displayed first."""
    label = next(name for name in ("slow", "late") if name != worst_detector(page))
    x, y = page.ask(f"""(() => {{
      const box = document.querySelector('circle[data-detector={label}]').getBoundingClientRect();
      return [box.left + box.width / 2, box.top + box.height / 2];
    }})()""")
    point_at(page, x, y, click=True)
    page.wait_for("document.querySelector('.current')", 5)
    assert current_fault(page) == faults_on(page, label)[0]
    assert page.ask("document.querySelector('.current').checkVisibility()")


CHOOSE = """((name, value) => {
  const label = [...document.querySelectorAll('#choose label')].find((label) => label.textContent.startsWith(name));
  const field = label.querySelector('select, input');
  field.value = value;
  field.dispatchEvent(new Event(field.type === 'search' ? 'input' : 'change'));
  return [...document.querySelectorAll('.fault')].filter((node) => node.checkVisibility()).map((node) => node.id);
})"""


def test_choices_of_pair_detector_and_text_filter_others(page):
    """Each choice hides the faults of all others, and a line says how many are left."""
    every = page.ask("document.querySelectorAll('.fault').length")
    visible = page.ask(f"{CHOOSE}('pair', 'a and b03')")
    pairs = page.ask("""[...document.querySelectorAll('.fault')].filter((node) => node.checkVisibility())
      .map((node) => node.dataset.pair ?? node.closest('[data-pair]').dataset.pair)""")
    assert 0 < len(visible) < every and set(pairs) == {"a and b03"}
    assert (
        page.ask("document.querySelector('#choose [role=status]').textContent")
        == f"{len(visible)} of {every} faults of all detectors"
    )
    press_key(page, "Escape")
    label = next(name for name in ("slow", "late") if name != worst_detector(page))
    visible = page.ask(f"{CHOOSE}('detector', '{label}')")
    assert visible == [name for name in faults_on(page, label) if name in visible] and visible
    assert page.ask("document.querySelector('#choose [role=status]').textContent").startswith(
        f"{len(faults_on(page, label))} of"
    )
    press_key(page, "Escape")
    assert set(page.ask(f"{CHOOSE}('words', 'B07')")) < set(page.ask(f"{CHOOSE}('words', '')"))


def test_keys_lead_through_faults_in_time_and_open_help(page):
    """j: next, k: previous, /: search (which then takes letters as text), ?: help."""
    detector = worst_detector(page)
    spans = page.ask(f"""[...document.querySelectorAll('[data-detector="{detector}"] .fault')]
      .map((node) => [parseFloat(node.dataset.span), node.id]).sort((a, b) => a[0] - b[0]).map(([, id]) => id)""")
    visited = []
    for _ in spans:
        press_key(page, "j")
        visited.append(current_fault(page))
        assert page.ask("document.querySelector('.current').checkVisibility()")
    assert visited == spans
    press_key(page, "k")
    assert current_fault(page) == spans[-2]
    press_key(page, "/")
    assert page.ask("document.activeElement.type") == "search"
    press_key(page, "j")
    assert current_fault(page) == spans[-2] and page.ask("document.activeElement.value") == "j"
    press_key(page, "Escape")
    press_key(page, "?")
    assert page.ask("document.querySelector('dialog').open")
    press_key(page, "Escape")
    assert not page.ask("document.querySelector('dialog').open")


def test_report_opened_at_a_faults_address_shows_that_fault(page, pages_folder):
    """The address ends in the id of the last fault of each detector; a window is 800 pixels high."""
    for fault in (faults_on(page, "slow")[-1], faults_on(page, "late")[-1]):
        with opened(f"{(pages_folder / 'report.html').as_uri()}#{fault}", pages_folder / fault) as other:
            assert other.ask("document.querySelector('.current').id") == fault
            top = other.ask("document.querySelector('.current').getBoundingClientRect().top")
            assert 0 <= top < 800 and other.ask("document.querySelector('.current').checkVisibility()")


def test_copy_button_beside_a_command_copies_the_command(page):
    """Every command has a button behind it; the browser's clipboard is a list here."""
    pairs = page.ask("[...document.querySelectorAll('code')].map((code) => code.nextElementSibling?.className)")
    assert pairs and set(pairs) == {"copy"}
    page.ask("window.copied = []; navigator.clipboard.writeText = async (text) => { copied.push(text); }; 0")
    page.ask("document.querySelector('.copy').click(); 0")
    assert page.ask("copied") == [page.ask("document.querySelector('code').textContent")]
    page.wait_for("document.querySelector('.live').textContent === 'Copied'", 5)


def test_ranking_sorts_by_heading_and_keeps_reference_last(page):
    """The fifth heading is that of mean ms; a first click sorts by falling values."""
    cells = "[...document.querySelectorAll('.rank tbody tr')].map((row) => row.cells[0].querySelector('b').textContent)"
    before = page.ask(cells)
    page.ask("document.querySelectorAll('.rank th button')[4].click(); 0")
    assert sorted(page.ask(cells)) == sorted(before) and page.ask(cells)[-1] == "exact"
    assert page.ask("document.querySelectorAll('.rank th')[4].ariaSort") == "descending"
    values = page.ask("[...document.querySelectorAll('.rank td[data-l=\"mean ms\"]')].map((cell) => +cell.textContent)")
    assert values[:-1] == sorted(values[:-1], reverse=True)


def test_charts_are_saved_as_pictures_and_faults_as_csv(page):
    """The last two buttons of timeline and plot save SVG and PNG, one of the list of faults a CSV: five files.

    The CSV has a line for each fault, and its heading.
    """
    page.ask("saved.length = 0; saved.names = []; 0")
    for bar in (".th2", "h2:has(+ .sc)"):
        page.ask(f"[...document.querySelectorAll('{bar} .tools button')].slice(-2).forEach((one) => one.click()); 0")
    page.ask("[...document.querySelectorAll('#choose .tools button')][1].click(); 0")
    page.wait_for("saved.length === 5", 20)
    contents = page.ask("""Promise.all(saved.map((blob) => new Promise((done) => { const reader = new FileReader();
      reader.onload = () => done([blob.type, reader.result.split(',')[1]]); reader.readAsDataURL(blob); })))""")
    kinds = sorted(kind for kind, _ in contents)
    assert kinds == ["image/png", "image/png", "image/svg+xml", "image/svg+xml", "text/csv"]
    texts = {kind: base64.b64decode(data) for kind, data in contents}
    assert texts["image/png"].startswith(b"\x89PNG") and len(texts["image/png"]) > 4000
    assert texts["image/svg+xml"].startswith(b"<svg") and b"class=" not in texts["image/svg+xml"]
    lines = texts["text/csv"].decode("utf-8-sig").splitlines()
    assert len(lines) == 1 + page.ask("document.querySelectorAll('.fault').length")


def test_hostile_names_stay_text_everywhere(pages_folder):
    """A body is called like a script: in the tip of a fault, and in both files that the page saves."""
    session = unit_cubes_on_x({HOSTILE: [0.0] * 12, "b": [3, 0.9, 0.9, 3, 3, 3, 0.9, 3, 3, 3, 3, 3]})
    file = pages_folder / "hostile.html"
    file.write_text(report_html(compute(session, detectors="slow=discrete[rate_hz=12]")), encoding="utf-8")
    with opened(file.as_uri(), pages_folder / "hostile") as page:
        page.ask(CAPTURE)
        fault = faults_on(page, "slow")[0]
        point_at(page, *second_on_lane(page, "slow", fault))
        assert "<script>throw 1" in page.ask("document.querySelector('.tip').innerText")
        page.ask("[...document.querySelectorAll('#choose .tools button')][1].click(); 0")
        page.ask("[...document.querySelectorAll('.choose .tools button')].at(-1).click(); 0")
        texts = page.ask("Promise.all(saved.map((blob) => blob.text()))")
        cells = [cell for text in texts for line in text.splitlines() for cell in line.strip("\ufeff").split('","')]
        assert cells and not [cell for cell in cells if cell.strip('" ').startswith(("=", "+", "@"))]
        assert page.ask("document.querySelectorAll('script').length") == 1
        assert page.ask("document.querySelectorAll('img').length") == 0 and page.errors() == []


def many_faults(count):
    """A page of a run whose two detectors have so many faults, in two pairs."""
    result = run_with_steady_times("several")
    many = {
        label: [
            replace(own[k % len(own)], number=k + 1, start=0.02 * k, end=0.02 * k + 0.011) for k in range(count // 2)
        ]
        for label, own in result.faults.items()
    }
    misses = {label: tuple(fault for fault in faults if fault.kind.is_miss) for label, faults in many.items()}
    false = {label: tuple(fault for fault in faults if not fault.kind.is_miss) for label, faults in many.items()}
    return page_of(view_of(replace(result, misses=misses, false=false)), [])


def test_page_of_two_thousand_faults_is_small_and_quick(pages_folder):
    """At most a megabyte, and 100 ms a key."""
    text = many_faults(count=2000)
    assert len(text.encode()) <= 1_000_000 and text.count('class="fault"') + text.count('class="card fault"') == 2000
    file = pages_folder / "many.html"
    file.write_text(text, encoding="utf-8")
    with opened(file.as_uri(), pages_folder / "many") as page:
        # Other programs delay single keys: each key counts by its quickest of four.
        times = page.ask("""(async () => {
          const times = {};
          for (let turn = 0; turn < 4; turn++) for (const key of ["j", "j", "k", "+", "-", "0", "?", "?", "Escape"]) {
            const start = performance.now();
            dispatchEvent(new KeyboardEvent("keydown", { key }));
            document.body.offsetHeight;
            if ("jk".includes(key) && !document.querySelector(".current")) throw Error(key);
            times[key] = Math.min(times[key] ?? Infinity, performance.now() - start);
            await new Promise((done) => requestAnimationFrame(done));
          }
          return times;
        })()""")
        print({key: round(value) for key, value in times.items()})
        assert max(times.values()) < 100 and page.errors() == []


@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (1280, "dark"), (400, "light"), (400, "dark")])
def test_tools_pass_accessibility_checks_and_fit(page, pages_folder, width, scheme):
    """Every fold is open and a fault is chosen, on a screen and on a phone of 400 pixels."""
    with opened(
        (pages_folder / "report.html").as_uri(), pages_folder / f"{width}{scheme}", (width, 800), scheme
    ) as other:
        other.ask("for (const part of document.querySelectorAll('details')) part.open = true")
        press_key(other, "j")
        assert other.ask("document.documentElement.scrollWidth <= innerWidth")
        assert serious_faults(other, pages_folder) == [] and other.errors() == []


def test_page_without_script_shows_and_prints_everything(page, pages_folder):
    """The script is cut off the page, as where a browser runs none."""
    text = (pages_folder / "report.html").read_text(encoding="utf-8")
    file = pages_folder / "still.html"
    file.write_text(text[: text.index("<script>")], encoding="utf-8")
    faults = sorted(page.ask("[...document.querySelectorAll('.fault')].map((node) => node.id)"))
    with opened(file.as_uri(), pages_folder / "still") as other:
        assert other.ask("[...document.querySelectorAll('.fault')].map((node) => node.id).sort()") == faults
        other.call("Emulation.setEmulatedMedia", media="print")
        assert other.ask("[...document.querySelectorAll('.fault')].filter((n) => !n.checkVisibility()).length") == 0
