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
    """The folder of the pages that a browser opens."""
    return tmp_path_factory.mktemp("pages")


@pytest.fixture(scope="module")
def page(pages_folder):
    """A report in a browser: nine pairs of cubes (a and b00 to b08), each missed or late, of two detectors.

    Pictures and files that it saves are kept in the list ``saved`` of its script.
    """
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


def middle_of_fault_on_lane(page, detector, fault):
    """Pixel (x, y) on the lane of a detector at the middle of a fault, given by its id."""
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


def other_detector(page):
    """The detector whose faults do not stand first on the page."""
    (label,) = {"slow", "late"} - {worst_detector(page)}
    return label


def windows_of_lanes(page):
    """First second and length of what each lane shows."""
    boxes = page.ask("[...document.querySelectorAll('.time .lane')].map((lane) => lane.getAttribute('viewBox'))")
    return [(float(x), float(width)) for x, _y, width, _height in (box.split() for box in boxes)]


def text_of_ruler(page):
    """All numbers of seconds below the lanes."""
    return page.ask("document.querySelector('.ticks').textContent")


def drag_lane_to_the_right(page, pixels):
    """Presses in the middle of the first lane, moves and releases."""
    x, y = page.ask("""(() => {
      const box = document.querySelector('.lane').getBoundingClientRect();
      return [box.left + box.width / 2, box.top + 5];
    })()""")
    page.call("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, button="left", clickCount=1)
    page.call("Input.dispatchMouseEvent", type="mouseMoved", x=x + pixels, y=y, button="left", buttons=1)
    page.call("Input.dispatchMouseEvent", type="mouseReleased", x=x + pixels, y=y, button="left", clickCount=1)
    page.ask("new Promise((done) => requestAnimationFrame(() => done(0)))")


def test_lanes_zoom_together_and_the_ruler_follows(page):
    """Key + shows a shorter window of time, the same on all lanes, and other seconds below them; key 0 shows all."""
    whole_windows, whole_ruler = windows_of_lanes(page), text_of_ruler(page)
    press_key(page, "+")
    (closer_window,) = set(windows_of_lanes(page))
    _first, closer_length = closer_window
    assert all(closer_length < length for _first, length in whole_windows)
    assert text_of_ruler(page) != whole_ruler
    press_key(page, "0")
    assert [length for _first, length in windows_of_lanes(page)] == [length for _first, length in whole_windows]
    assert text_of_ruler(page) == whole_ruler


def test_drag_moves_all_lanes_and_opens_no_fault(page):
    """Key + zooms in; then the pointer drags a lane by 80 pixels to the right: earlier seconds come into view."""
    press_key(page, "+")
    (before,) = set(windows_of_lanes(page))
    drag_lane_to_the_right(page, pixels=80)
    (after,) = set(windows_of_lanes(page))
    (first_before, length_before), (first_after, length_after) = before, after
    assert first_after < first_before
    assert length_after == pytest.approx(length_before)
    assert current_fault(page) == ""


def test_pointer_on_a_lane_reads_fault_detector_cause_and_size(page):
    """The pointer rests on the lane of a detector in the middle of its first fault; a tip says what that is.

    The bodies are a and b0 (with a further digit).
    """
    detector = worst_detector(page)
    fault, *_ = faults_on(page, detector)
    facts = page.ask(f"({{...document.getElementById('{fault}').dataset}})")
    point_at(page, *middle_of_fault_on_lane(page, detector, fault))
    tip = page.ask("document.querySelector('.tip').innerText")
    for text in (f"of {detector}: a and b0", f"cause: {facts['cause']}", facts["size"], facts["kind"]):
        assert text in tip


def test_pointer_on_the_lane_of_the_reference_names_a_contact(page):
    """The first lane is that of the reference; the pointer rests where a detector misses a contact."""
    detector = worst_detector(page)
    fault, *_ = faults_on(page, detector)
    reference = page.ask("document.querySelector('.lane').dataset.detector")
    assert reference == "exact"
    point_at(page, *middle_of_fault_on_lane(page, reference, fault))
    assert "Contact " in page.ask("document.querySelector('.tip').innerText")


def test_click_on_lane_opens_card_and_moves_cursor(page):
    """A click on a lane, at the last fault on the page: its card is visible, and every chart draws a cursor.

    The address of the page ends in the id of the fault that is open.
    """
    detector = worst_detector(page)
    *_, fault = faults_on(page, detector)
    point_at(page, *middle_of_fault_on_lane(page, detector, fault), click=True)
    page.wait_for("document.querySelector('.current')", seconds=5)
    assert page.ask("location.hash") == f"#{current_fault(page)}"
    assert page.ask("document.querySelector('.current').checkVisibility()")
    cursors = page.ask("[...document.querySelectorAll('.time .cursor')].map((path) => path.getAttribute('d'))")
    assert cursors
    assert all(cursors)


def test_click_on_dot_opens_first_fault_of_its_detector(page):
    """A dot of the plot of loss against cost, of the detector that is not displayed first, is clicked in its middle."""
    label = other_detector(page)
    x, y = page.ask(f"""(() => {{
      const box = document.querySelector('circle[data-detector={label}]').getBoundingClientRect();
      return [box.left + box.width / 2, box.top + box.height / 2];
    }})()""")
    point_at(page, x, y, click=True)
    page.wait_for("document.querySelector('.current')", seconds=5)
    first_fault, *_ = faults_on(page, label)
    assert current_fault(page) == first_fault
    assert page.ask("document.querySelector('.current').checkVisibility()")


CHOOSE = """((name, value) => {
  const label = [...document.querySelectorAll('#choose label')].find((label) => label.textContent.startsWith(name));
  const field = label.querySelector('select, input');
  field.value = value;
  field.dispatchEvent(new Event(field.type === 'search' ? 'input' : 'change'));
  return [...document.querySelectorAll('.fault')].filter((node) => node.checkVisibility()).map((node) => node.id);
})"""


def choose(page, field, value):
    """Ids of the faults that are visible once a field above their list (pair, detector, words) has this value."""
    return page.ask(f"{CHOOSE}('{field}', '{value}')")


def status_line(page):
    """The line that says how many faults are visible."""
    return page.ask("document.querySelector('#choose [role=status]').textContent")


def test_choice_of_a_pair_hides_faults_of_other_pairs(page):
    """The pair a and b03 is chosen of nine; a line counts the faults that are visible, of all."""
    fault_count = page.ask("document.querySelectorAll('.fault').length")
    visible = choose(page, "pair", "a and b03")
    pairs = page.ask("""[...document.querySelectorAll('.fault')].filter((node) => node.checkVisibility())
      .map((node) => node.dataset.pair ?? node.closest('[data-pair]').dataset.pair)""")
    assert 0 < len(visible) < fault_count
    assert set(pairs) == {"a and b03"}
    assert status_line(page) == f"{len(visible)} of {fault_count} faults of all detectors"


def test_choice_of_a_detector_hides_faults_of_others(page):
    """The second of two detectors is chosen: only faults of it are visible, and the line counts all of them."""
    label = other_detector(page)
    visible = choose(page, "detector", label)
    assert visible
    assert [fault for fault in visible if fault not in faults_on(page, label)] == []
    assert status_line(page).startswith(f"{len(faults_on(page, label))} of")


def test_search_hides_faults_without_the_term(page):
    """The search field takes "B07", which stands, in small letters, in the faults of one of nine pairs.

    Once it is empty again, all faults come back.
    """
    with_word = choose(page, "words", "B07")
    all_faults = choose(page, "words", "")
    assert with_word
    assert set(with_word) < set(all_faults)


def faults_in_time(page, detector):
    """Ids of the faults of a detector by the second of their begin."""
    return page.ask(f"""[...document.querySelectorAll('[data-detector="{detector}"] .fault')]
      .map((node) => [parseFloat(node.dataset.span), node.id]).sort((a, b) => a[0] - b[0]).map(([, id]) => id)""")


def test_keys_j_and_k_lead_through_faults_in_time(page):
    """Key j opens the next fault of the first detector in order of time, k the one before; an open fault is visible."""
    faults = faults_in_time(page, worst_detector(page))
    visited = []
    for _ in faults:
        press_key(page, "j")
        visited.append(current_fault(page))
        assert page.ask("document.querySelector('.current').checkVisibility()")
    assert visited == faults
    press_key(page, "k")
    assert current_fault(page) == faults[-2]


def test_search_field_takes_keys_as_text(page):
    """j opens the first fault; / goes to the search field, where a second j is a letter and opens no other fault."""
    press_key(page, "j")
    fault = current_fault(page)
    press_key(page, "/")
    assert page.ask("document.activeElement.type") == "search"
    press_key(page, "j")
    assert page.ask("document.activeElement.value") == "j"
    assert current_fault(page) == fault


def test_question_mark_opens_help_and_escape_closes_it(page):
    """The help is the only dialog of the report."""
    press_key(page, "?")
    assert page.ask("document.querySelector('dialog').open")
    press_key(page, "Escape")
    assert not page.ask("document.querySelector('dialog').open")


@pytest.mark.parametrize("detector", ["slow", "late"])
def test_report_opened_at_a_faults_address_shows_that_fault(page, pages_folder, detector):
    """The address ends in the id of the detector's last fault: it is open, and within a window 800 pixels high."""
    *_, fault = faults_on(page, detector)
    with opened(f"{(pages_folder / 'report.html').as_uri()}#{fault}", pages_folder / fault) as other:
        assert other.ask("document.querySelector('.current').id") == fault
        assert other.ask("document.querySelector('.current').checkVisibility()")
        top = other.ask("document.querySelector('.current').getBoundingClientRect().top")
        assert 0 <= top < 800


def test_copy_button_beside_a_command_copies_the_command(page):
    """Every command (``code``) has a button behind it; a click copies the text and says so.

    The clipboard of the browser is replaced by a list.
    """
    classes = page.ask("[...document.querySelectorAll('code')].map((code) => code.nextElementSibling?.className)")
    assert set(classes) == {"copy"}
    page.ask("window.copied = []; navigator.clipboard.writeText = async (text) => { copied.push(text); }; 0")
    page.ask("document.querySelector('.copy').click(); 0")
    first_command = page.ask("document.querySelector('code').textContent")
    assert page.ask("copied") == [first_command]
    page.wait_for("document.querySelector('.live').textContent === 'Copied'", seconds=5)


def test_ranking_sorts_by_heading_and_keeps_reference_last(page):
    """A click on the fifth heading, "mean ms", sorts the detectors by falling times; the reference (exact) stays last.

    No row is lost.
    """
    mean_ms = 4  # counted from 0
    labels = (
        "[...document.querySelectorAll('.rank tbody tr')].map((row) => row.cells[0].querySelector('b').textContent)"
    )
    labels_before = page.ask(labels)
    page.ask(f"document.querySelectorAll('.rank th button')[{mean_ms}].click(); 0")
    labels_after = page.ask(labels)
    assert sorted(labels_after) == sorted(labels_before)
    assert labels_after[-1] == "exact"
    assert page.ask(f"document.querySelectorAll('.rank th')[{mean_ms}].ariaSort") == "descending"
    *times, _time_of_reference = page.ask(
        "[...document.querySelectorAll('.rank td[data-l=\"mean ms\"]')].map((cell) => +cell.textContent)"
    )
    assert times == sorted(times, reverse=True)


@pytest.fixture
def saved_files(page):
    """(type, content) of files that the page saves: timeline and plot as SVG and PNG each, the list of faults as CSV.

    The last two buttons beside each chart save it, the second one beside the list of faults.
    """
    page.ask("saved.length = 0; saved.names = []; 0")
    for chart in (".th2", "h2:has(+ .sc)"):
        page.ask(
            f"[...document.querySelectorAll('{chart} .tools button')].slice(-2).forEach((node) => node.click()); 0"
        )
    page.ask("[...document.querySelectorAll('#choose .tools button')][1].click(); 0")
    page.wait_for("saved.length === 5", seconds=20)
    files = page.ask("""Promise.all(saved.map((blob) => new Promise((done) => { const reader = new FileReader();
      reader.onload = () => done([blob.type, reader.result.split(',')[1]]); reader.readAsDataURL(blob); })))""")
    return [(kind, base64.b64decode(data)) for kind, data in files]


def test_timeline_and_plot_are_saved_as_svg_and_png(saved_files):
    """Buttons beside the timeline and the plot save each as SVG and as PNG: two files of each type.

    A PNG of over 4 kB is not empty; an SVG needs no style sheet of the page (no ``class``).
    """
    png_files = [content for kind, content in saved_files if kind == "image/png"]
    svg_files = [content for kind, content in saved_files if kind == "image/svg+xml"]
    assert (len(png_files), len(svg_files)) == (2, 2)
    for content in png_files:
        assert content.startswith(b"\x89PNG")
        assert len(content) > 4000
    for content in svg_files:
        assert content.startswith(b"<svg")
        assert b"class=" not in content


def test_faults_are_saved_as_a_csv(saved_files, page):
    """A button beside the list of faults saves it: a line of headings, and one for each fault on the page."""
    (content,) = [content for kind, content in saved_files if kind == "text/csv"]
    fault_count = page.ask("document.querySelectorAll('.fault').length")
    assert len(content.decode("utf-8-sig").splitlines()) == 1 + fault_count


@pytest.fixture(scope="module")
def page_with_hostile_name(pages_folder):
    """A report in a browser, about a body whose name is a formula, a script and an element; another body is "b"."""
    session = unit_cubes_on_x({HOSTILE: [0.0] * 12, "b": [3, 0.9, 0.9, 3, 3, 3, 0.9, 3, 3, 3, 3, 3]})
    file = pages_folder / "hostile.html"
    file.write_text(report_html(compute(session, detectors="slow=discrete[rate_hz=12]")), encoding="utf-8")
    with opened(file.as_uri(), pages_folder / "hostile") as hostile_page:
        hostile_page.ask(CAPTURE)
        yield hostile_page


def test_hostile_name_stays_text_in_page_and_tip(page_with_hostile_name):
    """The name of a body has a script and an image that runs one; the tip at a fault of the body prints both.

    The page has its own script only, no image, and no error.
    """
    page = page_with_hostile_name
    fault, *_ = faults_on(page, "slow")
    point_at(page, *middle_of_fault_on_lane(page, "slow", fault))
    assert "<script>throw 1" in page.ask("document.querySelector('.tip').innerText")
    assert page.ask("document.querySelectorAll('script').length") == 1
    assert page.ask("document.querySelectorAll('img').length") == 0
    assert page.errors() == []


def test_saved_files_have_no_formula_of_a_hostile_name(page_with_hostile_name):
    """The name of a body begins with "="; cells of both files that the page saves begin with no sign of a formula."""
    page = page_with_hostile_name
    page.ask("[...document.querySelectorAll('#choose .tools button')][1].click(); 0")
    page.ask("[...document.querySelectorAll('.choose .tools button')].at(-1).click(); 0")
    texts = page.ask("Promise.all(saved.map((blob) => blob.text()))")
    cells = [cell for text in texts for line in text.splitlines() for cell in line.strip("\ufeff").split('","')]
    assert any("cmd|" in cell for cell in cells)
    assert [cell for cell in cells if cell.strip('" ').startswith(("=", "+", "@"))] == []


FAULT_COUNT = 2000


@pytest.fixture(scope="module")
def page_with_many_faults():
    """The text of a report of a run whose two detectors have 2,000 faults together, in two pairs."""
    result = run_with_steady_times("several")
    many = {
        label: [
            replace(own[k % len(own)], number=k + 1, start=0.02 * k, end=0.02 * k + 0.011)
            for k in range(FAULT_COUNT // 2)
        ]
        for label, own in result.faults.items()
    }
    misses = {label: tuple(fault for fault in faults if fault.kind.is_miss) for label, faults in many.items()}
    false = {label: tuple(fault for fault in faults if not fault.kind.is_miss) for label, faults in many.items()}
    return page_of(view_of(replace(result, misses=misses, false=false)), [])


def test_page_of_two_thousand_faults_has_at_most_a_megabyte(page_with_many_faults):
    """The text of a report; each of its 2,000 faults is a card or a line."""
    cards, lines = page_with_many_faults.count('class="card fault"'), page_with_many_faults.count('class="fault"')
    assert cards + lines == FAULT_COUNT
    assert len(page_with_many_faults.encode()) <= 1_000_000


def test_page_of_2000_faults_answers_keys_within_100_ms(page_with_many_faults, pages_folder):
    """j and k open faults, + and - zoom, 0 shows all, ? opens and closes help, Escape closes what is open.

    Other programs delay single keys, so each counts by its quickest of four times.
    """
    file = pages_folder / "many.html"
    file.write_text(page_with_many_faults, encoding="utf-8")
    with opened(file.as_uri(), pages_folder / "many") as page:
        milliseconds = page.ask("""(async () => {
          const times = {};
          const keys = ["j", "j", "k", "+", "-", "0", "?", "?", "Escape"];
          for (let repeat = 0; repeat < 4; repeat++) for (const key of keys) {
            const start = performance.now();
            dispatchEvent(new KeyboardEvent("keydown", { key }));
            document.body.offsetHeight;
            if ("jk".includes(key) && !document.querySelector(".current")) throw Error(key);
            times[key] = Math.min(times[key] ?? Infinity, performance.now() - start);
            await new Promise((done) => requestAnimationFrame(done));
          }
          return times;
        })()""")
        assert max(milliseconds.values()) < 100, milliseconds
        assert page.errors() == []


@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (1280, "dark"), (400, "light"), (400, "dark")])
def test_tools_pass_accessibility_checks_and_fit(page, pages_folder, width, scheme):
    """The report in a window of a laptop or a phone, 800 pixels high: every fold is open, and a fault is chosen (j).

    Nothing is wider than the window; the checker axe reports no serious fault, and the console no error.
    """
    address, profile = (pages_folder / "report.html").as_uri(), pages_folder / f"{width}{scheme}"
    with opened(address, profile, (width, 800), scheme) as other:
        other.ask("for (const fold of document.querySelectorAll('details')) fold.open = true")
        press_key(other, "j")
        assert other.ask("document.documentElement.scrollWidth <= innerWidth")
        assert serious_faults(other, pages_folder) == []
        assert other.errors() == []


def test_page_without_script_shows_and_prints_everything(page, pages_folder):
    """The script is cut off the report, as where a browser runs none: all faults are there, and visible in print."""
    text = (pages_folder / "report.html").read_text(encoding="utf-8")
    file = pages_folder / "still.html"
    file.write_text(text[: text.index("<script>")], encoding="utf-8")
    faults = sorted(page.ask("[...document.querySelectorAll('.fault')].map((node) => node.id)"))
    assert faults
    with opened(file.as_uri(), pages_folder / "still") as other:
        assert other.ask("[...document.querySelectorAll('.fault')].map((node) => node.id).sort()") == faults
        other.call("Emulation.setEmulatedMedia", media="print")
        hidden = other.ask("[...document.querySelectorAll('.fault')].filter((node) => !node.checkVisibility()).length")
        assert hidden == 0
