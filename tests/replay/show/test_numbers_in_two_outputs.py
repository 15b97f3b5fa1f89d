"""Every number that stands in two outputs is the same in both: all tables and sentences of all outputs are compared.

Nothing here lists numbers: cells are known by table, detector, row and heading, sentences by their words.
"""

import json
import re
from collections import defaultdict
from html.parser import HTMLParser
from io import StringIO
from itertools import combinations
from types import SimpleNamespace
from typing import NamedTuple

import pyarrow.parquet as pq
import pytest
from rich.console import Console
from support.report_states import SCREENS

import replay
from replay.advice.scoring import Scoring
from replay.advice.settings import settings_of
from replay.cli.run_markdown import run_markdown
from replay.cli.run_tables import run_screen, run_tables
from replay.detection.detector_spec import parse_detector
from replay.detection.recorded import RECORDED_DETECTOR
from replay.document.columns import COLUMNS
from replay.document.tables import Output, text_of
from replay.show import run_tables as tables
from replay.show.results.run_folder import read_run_folder
from replay.show.tradeoff_table import tradeoff_table

RULE = re.compile(r"─{10,}")
NUMBER = re.compile(r"\d[\d,]*(?:\.\d+)?")
CELL = re.compile(r"\S+(?: \S+)*")
DOT = re.compile(r"(\S+): ([\d.]+)")
TIMES = re.compile(r"(\S+): mean ([\d.]+), p99 ([\d.]+), longest ([\d.]+)")

SCREEN_TABLES = ("ranking", "times", "misses", "false", "pairs", "effects", "session")
OF_DETECTORS = ("ranking", "times")
"""Tables with a row for each detector: their columns of one name hold one number."""

SAME_QUANTITY = {"99 % ms": "p99 ms"}


class Cell(NamedTuple):
    """The position of a value; a table of one detector is known by its label."""

    table: str
    detector: str
    row: str
    column: str


class TablesOfPage(HTMLParser):
    """Caption and rows of every table of a page, each cell with the columns that it spans, and all other texts."""

    def __init__(self, page):
        super().__init__()
        self.tables, self.texts, self._inside = [], [], []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        if tag in ("table", "caption", "td", "th", "script", "style"):
            self._inside.append(tag)
        if tag == "table":
            self.tables.append(["", []])
        elif tag == "tr":
            self.tables[-1][1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][1][-1].append(["", int(dict(attrs).get("colspan", 1))])
        elif {"td", "th"} & set(self._inside):
            self.tables[-1][1][-1][-1][0] += "\n"  # a remark below the figure is none of its text

    def handle_endtag(self, tag):
        if tag in self._inside:
            self._inside.remove(tag)

    def handle_data(self, data):
        innermost = self._inside[-1] if self._inside else ""
        if innermost == "":
            self.texts.append(data)
        elif innermost == "caption":
            self.tables[-1][0] += data
        elif innermost in ("td", "th"):
            self.tables[-1][1][-1][-1][0] += data


def page_tables(page):
    """Title, headings and rows; columns that a cell spans beyond its first have no cell."""
    for title, rows in TablesOfPage(page).tables:
        filled = [
            [text for cell, wide in row for text in (cell.strip().partition("\n")[0].strip(), *[None] * (wide - 1))]
            for row in rows
        ]
        if len(filled) > 1:
            yield title, filled[0], filled[1:]


def markdown_tables(text):
    """Title, headings and rows; the title is the heading above."""
    title, rows = "", []
    for line in [*text.splitlines(), ""]:
        if line.startswith("| "):
            rows.append([cell.strip() for cell in line.strip("|").split(" | ")])
        elif rows and not line.startswith("|-"):
            yield title, rows[0], rows[1:]
            rows = []
        title = line.strip("# ") if line.startswith("#") else title


def terminal_tables(text):
    """Title, headings and rows; a cell belongs to the heading that it shares most columns with."""
    lines = text.splitlines()
    for number, line in enumerate(lines):
        if not RULE.fullmatch(line.strip()):
            continue
        top = max(k for k in range(number) if not lines[k].strip()) + 1
        spans = [[*CELL.finditer(below)] for below in lines[number + 1 : lines.index("", number)]]
        rows = [row for row in spans if len(row) > 1]
        if number - top > 2:  # words of headings stand below each other: only the ranking of the first screen
            undecided = any("undecided" in above for above in lines[top:number])
            ranking = [column for column in COLUMNS["ranking"] if not column.wide]
            heads = [column.name for column in ranking if undecided or column.name != "undecided"]
            yield lines[top], heads, [[cell[0] for cell in row] for row in rows]
            continue
        heads = [*CELL.finditer(lines[number - 1])]
        yield lines[top], [head[0] for head in heads], [cells_below(heads, row) for row in rows]


def cells_below(heads, row):
    """The cell of a row below each heading; ``None``: there is none."""
    cells = [None] * len(heads)
    for cell in row:
        distances = [max(head.start() - cell.end(), cell.start() - head.end()) for head in heads]
        cells[distances.index(min(distances))] = cell[0]
    return cells


def names_of(table):
    """Each heading of a table, long and short -> the name of its column."""
    columns = [column for column in COLUMNS[table] if column.only is not Output.FILES]
    return {heading: column.name for column in columns for heading in (column.name, column.short) if heading}


def facts_of(tables, labels):
    """Cell -> text, of tables as an output shows them."""
    facts = {}
    for title, heads, rows in tables:
        table = next((name for name in SCREEN_TABLES if len(set(heads) & names_of(name).keys()) >= len(heads) - 1), "")
        of = next((label for label in labels if re.search(rf"(?<![\w+]){re.escape(label)}(?![\w+])", title)), "")
        if not table or (table in ("misses", "false", "pairs") and not of):
            continue
        names, occurrences = names_of(table), defaultdict(int)
        for row in rows:
            first = (row[0] or "").strip("* ")
            key = re.split(r"[:\s]", first)[0] if table in OF_DETECTORS else first.replace(" ", "")
            occurrences[key] += 1
            for heading, text in zip(heads, row, strict=True):
                column = names.get(heading)
                if text is None or column in (None, "detector", "what", "pair") or not re.search(r"\d", text):
                    continue
                name = "detector" if table in OF_DETECTORS else table
                cell = Cell(
                    name,
                    "" if name == "detector" else of,
                    f"{key} {occurrences[key]}",
                    SAME_QUANTITY.get(column, column),
                )
                facts[cell] = re.sub(r" [\[(].*", "", text.strip("*")) if column == "false contact" else text
    return facts


def facts_of_plots(lines, labels):
    """Cell -> text, of the names in plots."""
    facts = {}
    for line in lines:
        if (dot := DOT.fullmatch(line.strip())) and dot[1] in labels:
            facts[Cell("detector", "", f"{dot[1]} 1", "loss")] = dot[2]
        if (times := TIMES.fullmatch(line.strip())) and times[1] in labels:
            for column, text in zip(("mean ms", "p99 ms", "worst ms"), times.groups()[1:], strict=True):
                facts[Cell("detector", "", f"{times[1]} 1", column)] = text
    return facts


def facts_of_files(folder):
    """Cell -> text of the stored value as its column shows it, or the number where files have another one."""
    facts = {}
    for table in (*SCREEN_TABLES, "metrics"):
        path = folder / f"{table}.parquet"
        if not path.is_file():
            continue
        lists = OF_DETECTORS if table == "metrics" else (table,)
        columns = [column for name in lists for column in COLUMNS[name] if column.only is None]
        occurrences = defaultdict(int)
        for row in pq.read_table(path).to_pylist():
            fault = table in ("misses", "false")
            key = str(next(iter(row.values()))) if not fault else str(row["number"])
            key = row["detector"] if table in ("metrics", *OF_DETECTORS) else key.replace(" ", "")
            of = row["detector"] if fault else ""
            occurrences[of, key] += 1
            for column in columns:
                name = column.for_files.name
                if row.get(name) is None or column.name in ("detector", "what"):
                    continue
                displayed = row[name]
                if column.dtype is not str and not column.number:
                    displayed = text_of(column.cell(_unscaled(displayed, column.scale)))
                if isinstance(displayed, float) or re.search(r"\d", displayed):
                    kind = table if table not in ("metrics", *OF_DETECTORS) else "detector"
                    where = Cell(kind, of, f"{key} {occurrences[of, key]}", SAME_QUANTITY.get(column.name, column.name))
                    facts.setdefault(where, displayed)
    return facts


def _unscaled(value, scale):
    """A value of a file in the unit of the screens."""
    return value if scale == 1.0 else value / scale


def facts_of_document(folder, labels):
    """Cell -> text, of the tables that the files of a folder give when they are read again."""
    run = read_run_folder(folder)
    made = [tables.ranking_table(run), tables.cost_table(run), tables.session_table(run), tables.effect_table(run)]
    for label in run.document.audit:
        made += [builder(run, label) for builder in (tables.pair_table, tables.miss_table, tables.false_table)]
    return facts_of(
        [
            (made_of.title, made_of.head, [[text_of(cell) for cell in row] for row in made_of.cells()])
            for made_of in made
        ],
        labels,
    )


def facts_of_tradeoff(result):
    """Cell -> text, of the detectors of a run as a tradeoff counts them; its times are its own."""
    scoring = Scoring(result.assembly, parse_detector(result.oracle), seed=0, tau=2e-6, session=result.session)
    facts = {}
    for rank in result.ranking[:-1]:
        if result.document.detectors[rank.label].name == RECORDED_DETECTOR:
            continue
        (setting,) = settings_of(f"{rank.label}={rank.setting}")
        row = scoring.figures(result.detections[rank.label], setting)
        unknown = ("label", "settings", "mean_ms", "p99_ms", "front", "passes")
        table = tradeoff_table("", [dict.fromkeys(unknown) | row])
        for column, cell in zip(table.head, table.cells()[0], strict=True):
            if column in ("missed", "late or cut short", "false contact", "loss"):
                facts[Cell("detector", "", f"{rank.label} 1", column)] = text_of(cell)
    return facts


def sentences_of(text):
    """Words of each sentence with a number -> the numbers that it has there."""
    sentences = defaultdict(set)
    plain = " ".join(re.sub(r"\*\*|`|^[|#] ?", "", text, flags=re.MULTILINE).split())
    for sentence in re.split(r"(?<=[.;:])\s+", plain):
        numbers = NUMBER.findall(sentence)
        wording = NUMBER.sub("#", sentence)
        if numbers and len(wording.split()) > 3:
            sentences[wording].add(tuple(numbers))
    return sentences


def texts_in(value):
    """Every text in plain data."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for inner in value.values() if isinstance(value, dict) else value:
            yield from texts_in(inner)


def printed(*contents):
    """The text of some things on a terminal."""
    console = Console(width=300, file=StringIO())
    console.print(*contents)
    return console.file.getvalue()


QUICK_STATES = ("several", "undecided", "only false", "effects beside an audit")
"""States that differ most: contacts missed and late, contacts undecided, false contact, and a table of effects."""


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(state, marks=() if state in QUICK_STATES else pytest.mark.slow)
        for state in (*SCREENS, "effects beside an audit")
    ],
)
def outputs(request, written_run_of):
    """``cells``: output -> cell (table, detector, row, column) -> its text. ``sentences``: output -> words -> numbers.

    Both are read from what each output of one run prints or writes; a run a state.
    """
    run = written_run_of(request.param)
    result, folder, picture = run.result, run.folder, run.picture_text
    labels = [*result.document.detectors]
    first, terminal = printed(run_screen(result)), printed(run_tables(result))
    markdown = run_markdown(result, ())
    page = (folder / "report.html").read_text(encoding="utf-8")
    texts = TablesOfPage(page).texts
    cells = {
        "first screen": facts_of(terminal_tables(first), labels),
        "terminal": facts_of(terminal_tables(terminal), labels),
        "Markdown": facts_of(markdown_tables(markdown), labels),
        "report": facts_of(page_tables(page), labels),
        "plots of the report": facts_of_plots(texts, labels),
        "picture": facts_of(markdown_tables(picture), labels),
        "plots of the picture": facts_of_plots(picture.splitlines(), labels),
        "notebook": facts_of(page_tables(replay.RunResult.of(result)._repr_html_()), labels),
        "Parquet": facts_of_files(folder),
        "summary": facts_of_document(folder, labels),
        "tradeoff": facts_of_tradeoff(result) if result.ranking and result.ranking[-1].contacts else {},
    }
    sentences = {
        "first screen": sentences_of(first),
        "terminal": sentences_of(terminal),
        "Markdown": sentences_of(markdown),
        "report": sentences_of("\n".join(texts)),
        "picture": sentences_of(picture),
        "summary": sentences_of("\n".join(texts_in(json.loads((folder / "summary.json").read_text("utf-8"))))),
    }
    return SimpleNamespace(cells=cells, sentences=sentences)


def agrees(a, b):
    """Whether two cells say the same; a number of a file is within what a text says, to its last digit."""
    if not isinstance(a, float) and not isinstance(b, float):
        return a == b
    number, text = (a, b) if isinstance(a, float) else (b, a)
    if isinstance(text, float):
        return number == text
    scale = 100.0 if "%" in text else 1.0
    digits = [re.sub(",", "", number) for number in NUMBER.findall(text)]
    last = 0.5001 * 10.0 ** -max((len(number.partition(".")[2]) for number in digits), default=0)
    whole = last if "." in text or "%" in text else 1e-9
    return float(digits[0]) - whole <= scale * number <= float(digits[-1]) + whole


@pytest.mark.sampled(4)
def test_a_cell_reads_the_same_in_every_output(outputs):
    """A cell is known by table, detector, row and column, and has a text in each output that shows it.

    Every two outputs are compared in the cells that both have: texts are equal, and a number of a file rounds to the
    digits of the text.
    """
    cells = outputs.cells
    different = [
        (cell, first, cells[first][cell], second, cells[second][cell])
        for first, second in combinations(cells, 2)
        for cell in cells[first].keys() & cells[second].keys()
        if not agrees(cells[first][cell], cells[second][cell])
    ]
    assert different == []


def test_a_sentence_has_the_same_numbers_in_every_output(outputs):
    """A sentence is known by its words, and has a set of numbers in each output that prints it.

    Of every two outputs with the same words both have the same numbers; where one cuts a list short, some of them.
    """
    sentences = outputs.sentences
    different = [
        (wording, first, sentences[first][wording], second, sentences[second][wording])
        for first, second in combinations(sentences, 2)
        for wording in sentences[first].keys() & sentences[second].keys()
        if not (
            sentences[first][wording] <= sentences[second][wording]
            or sentences[second][wording] <= sentences[first][wording]
        )
    ]
    assert different == []


@pytest.mark.parametrize("outputs", ["several"], indirect=True)
def test_most_numbers_occur_in_more_than_two_outputs(outputs):
    """The comparisons above compare much: over 80 % of all cells are in three outputs or more, a bound by trial.

    Every output has some of these, and over half of the first screen's sentences are in the report too.
    """
    cells_of_output, sentences_of_output = outputs.cells, outputs.sentences
    cells = set().union(*cells_of_output.values())
    shared_cells = {cell for cell in cells if sum(cell in own for own in cells_of_output.values()) > 2}
    assert len(shared_cells) > 0.8 * len(cells), sorted(cells - shared_cells)
    assert [output for output, own in cells_of_output.items() if not own.keys() & shared_cells] == []
    first_screen, report = sentences_of_output["first screen"], sentences_of_output["report"]
    assert len(first_screen.keys() & report.keys()) > 0.5 * len(first_screen)


@pytest.mark.parametrize("outputs", ["several"], indirect=True)
def test_another_number_in_a_single_output_is_noticed(outputs):
    """77 stands in no cell of this run; the comparison would refuse it in any other output that has the cell.

    Of each output the cell that most outputs have is taken.
    """
    cells_of_output = outputs.cells
    for output in ("terminal", "Markdown", "report", "picture", "Parquet", "summary"):
        shared_cell = max(
            cells_of_output[output], key=lambda cell: sum(cell in own for own in cells_of_output.values())
        )
        other_texts = [
            own[shared_cell] for name, own in cells_of_output.items() if name != output and shared_cell in own
        ]
        assert other_texts
        assert not any(agrees("77", text) for text in other_texts)
