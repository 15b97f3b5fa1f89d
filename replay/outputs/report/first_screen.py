"""The first screen of a report: what is wrong, why, what mends it and what that costs, a picture, and all detectors."""

import re
from collections.abc import Sequence
from typing import Final

from replay.base.shown import plural
from replay.base.tables import Cell, text_of
from replay.outputs.plots import Axis, Dot, scatter
from replay.outputs.report.charts import KIND_WORDS, drawn, lane, legend, ruler
from replay.outputs.report.markup import Markup, Section, contents, element, joined
from replay.outputs.report.run_view import FALSE, Fault, Hero, RunView, key_fault, spans
from replay.outputs.run_tables import happened, ranking_table
from replay.pipeline.answer import RUN, SESSION, TIMES_ARE, Answer, busy_words, cost
from replay.pipeline.headline import undecided
from replay.pipeline.sentences import sentence_of

RANK_COLUMNS: Final = ("missed", "late or cut short", "undecided", "false contact", "mean ms", "p99 ms")

FIGURE_IN_WORDS: Final = re.compile(r"(?<![\w.])\d[\d,.]*(?:-\d+)?(?: %| of \d+ contacts?)")
"""The figure that a sentence is about."""

LONG: Final = 10.0
"""Seconds; moments of a shorter session need milliseconds."""

MOST_LANES: Final = 6
"""Detectors with a lane on the first screen; further ones are folded."""


def page_head(view: RunView, sections: Sequence[Section]) -> Markup:
    """Whose session, how long, and where everything else stands."""
    session = view.summary["session"]
    facts = [f"{session['duration']:.0f} s" if session["duration"] >= LONG else f"{session['duration']:.3g} s"]
    if view.ranking and _compared(view):
        facts.append(plural(view.ranking[-1].contacts, "contact"))
    if "synthetic" in session["facts"]:
        facts.append("made up")
    said = element("p", "Replay of ", element("b", view.name), f": {', '.join(facts)}")
    return element("header", said, contents(sections), class_="top")


def _compared(view: RunView) -> bool:
    """Whether anything was decided by both, of any detector."""
    return any(audit["undecided"]["share"] != 1 for audit in view.summary["audit"].values())


def first_screen(view: RunView) -> list[Markup]:
    """Everything above the fold: the answer, or what stands in its place, then all detectors."""
    if view.hero is None:
        moment = view.answers[0].moment
        return [_answer(view), *all_detectors(view, None if moment is None else moment.seconds)]
    top = [_hero(view.hero)]
    if view.answers:
        return [*top, *all_detectors(view, None)]
    return [*top, timeline_part(view, None)] if view.contacts else top


def all_detectors(view: RunView, mark: float | None) -> list[Markup]:
    """Ranking, scatter and timeline; ``mark``: the second of the picture."""
    return [element("section", ranking_part(view), scatter_part(view), class_="two"), timeline_part(view, mark)]


def _answer(view: RunView) -> Markup:
    """The answer about the worst detector beside the picture of its worst fault."""
    answer = view.answers[0]
    fault = key_fault(view, answer)
    parts = [element("h1", marked(answer.sentence))]
    figure = []
    if fault is not None and answer.moment is not None:
        key = element("span", class_=f"k {'false' if fault.kind == FALSE else 'missed'}")
        parts.append(element("p", key, _where(view, fault), class_="where"))
        if view.still:
            picture, colours = view.still(fault, True)
            caption = f"{fault.name} {fault.number}, {fault.span}, drawn at {answer.moment.seconds:.3f} s: {colours}."
            figure.append(element("figure", picture, element("figcaption", caption)))
    parts.append(_facts(view, answer, fault))
    return element("section", element("div", *parts, class_="say"), *figure, class_="hero")


def _hero(hero: Hero) -> Markup:
    """A sentence and lines below it."""
    words = [element("h1", hero.sentence), *(element("p", line) for line in hero.lines)]
    return element("section", element("div", *words, class_="say"), class_="hero")


def marked(sentence: str) -> Markup:
    """A sentence with its first figure marked."""
    found = FIGURE_IN_WORDS.search(sentence)
    if found is None:
        return joined([sentence])
    before, after = sentence[: found.start()], sentence[found.end() :]
    return Markup("".join(joined([part]) for part in (before, element("mark", found.group()), after)))


def _where(view: RunView, fault: Fault) -> str:
    """Which bodies, from when to when, and how many of all faults of this kind."""
    every = [other for other in view.faults[fault.label] if other.kind == fault.kind]
    alike = [other for other in every if other.pair == fault.pair]
    start, end = min(other.start for other in alike), max(other.end for other in alike)
    what = fault.name.lower()
    digits = 1 if view.summary["session"]["duration"] >= LONG else 3
    pair = sentence_of(" and ".join(fault.pair))
    if len(every) == 1:
        return f"{pair}, {start:.{digits}f} s: the only {what}."
    things = f"{len(every)} missed, late or cut short" if what == "miss" else plural(len(every), what)
    return f"{pair}, {start:.{digits}f} to {end:.{digits}f} s: {len(alike)} of {things}."


def _facts(view: RunView, answer: Answer, fault: Fault | None) -> Markup:
    """Why, fix, cost, and how to see it."""
    rows = [(name, joined(filter(None, [words, command_of(command, view)]))) for name, words, command in answer.reasons]
    if words := cost(view.summary, view.oracle):
        small = " ".join(line for line in (TIMES_ARE, busy_words(view.summary)) if line)
        rows.append(("Cost", joined([words, element("small", small)])))
    if fault is not None and view.look:
        rows.append(("See it", view.look(fault)))
    return element("dl", *(part for name, said in rows for part in (element("dt", name), element("dd", said))))


def command_of(command: str, view: RunView) -> Markup:
    """A command to copy, folded: it is longer than the sentence before it."""
    if not command:
        return Markup("")
    words = command.replace(RUN, view.folder).replace(SESSION, "session.mcap")
    return element("details", element("summary", "command"), element("code", words), class_="in")


def ranking_part(view: RunView) -> Markup:
    """The terminal's ranking, in which the worst figure of the worst detector is marked."""
    made = ranking_table(view)
    head = [name for name in RANK_COLUMNS if name in made.head]
    worst = next(iter(view.ranking), None)
    rows = []
    for rank, row in zip(view.ranking, made.cells(), strict=True):
        cells = dict(zip(made.head, row, strict=True))
        named = element("th", element("b", rank.label), " ", element("span", rank.what), scope="row")
        faulty = rank is worst and (rank.fault or rank.lost)
        bad = "false contact" if rank.leads_false else "missed" if rank.missed_counts and rank.missed_counts[1] else ""
        if rank.missed_counts is None:
            over = [element("td", "reference", colspan=head.index("mean ms"), class_="n refcell", data_l="")]
            rest = head[head.index("mean ms") :]
        else:
            over, rest = [], head
        own = [_rank_cell(name, cells[name], bad=bool(faulty) and name == bad) for name in rest]
        rows.append(element("tr", named, *over, *own, class_=f"worst {_leads(rank.leads_false)}" if faulty else ""))
    heads = [element("th", "detector", scope="col"), *(element("th", name, scope="col") for name in head)]
    inside = element("thead", element("tr", *heads)), element("tbody", *rows)
    title = made.title.rstrip(":") if view.ranking[-1].contacts else happened(0)
    if not _compared(view):
        title = "Nothing was compared."
    notes = [element("p", note, class_="note") for note in undecided(view)]
    return element("div", element("h2", title), element("table", *inside, class_="rank"), *notes)


def _leads(false: bool) -> str:
    return "false" if false else "missed"


def _rank_cell(name: str, cell: Cell, *, bad: bool) -> Markup:
    return element("td", text_of(cell), class_="n bad" if bad else "n", data_l=name)


def scatter_part(view: RunView) -> Markup:
    """Wrong contacts against the mean time of a frame."""
    dots = []
    worst = view.ranking[0].label
    for rank in view.ranking:
        audit = view.summary["audit"].get(rank.label)
        wrong = 0 if audit is None else audit["contacts_missed"] + audit["contacts_in_part"] + audit["false_contacts"]
        kind = "reference" if audit is None else _leads(rank.leads_false) if rank.label == worst and wrong else ""
        if rank.mean is not None and not rank.undecided and _compared(view):
            dots.append(Dot(f"{rank.label}: {wrong:g}", 1e3 * rank.mean, wrong, kind))
    title = "Accuracy against cost"
    if not dots:
        return element("div", element("h2", title), element("p", "Not measured.", class_="note"))
    up = Axis.of("wrong contacts", [1.0, *(dot.y for dot in dots)], 3, zero=True)
    said = f"{title}: {', '.join(f'{dot.name} at {dot.x:.2g}' for dot in dots)}"
    return element("div", element("h2", title), drawn(scatter(dots, said, "mean ms a frame", up)))


def timeline_part(view: RunView, mark: float | None) -> Markup:
    """A lane for each detector, the reference on top."""
    if view.oracle:
        named = [(view.oracle, element("i", " (reference)"))]
        named += [(rank.label, element("i", f": {rank.what}")) for rank in view.ranking[:-1]]
    else:
        named = [(label, Markup("")) for label in view.contacts]
    start = float(view.summary["window"]["start"] or 0.0)
    window = start, start + float(view.summary["session"]["duration"])
    lanes, seen = [], set[str]()
    for label, what in named:
        found = spans(view, label)
        seen |= {kind for kind, own in found.items() if own}
        counts = ", ".join(f"{len(own)} {KIND_WORDS[kind]}" for kind, own in found.items() if own)
        drawing = lane(found, window, f"{label}: {counts or 'no contact'}", mark)
        lanes.append(element("div", element("span", label, what, class_="nm"), drawing, class_="ln"))
    axis = element("div", element("span", class_="nm"), ruler(*window), class_="ln ax")
    kinds = [kind for kind in KIND_WORDS if kind in seen]
    shown, rest = lanes[:MOST_LANES], lanes[MOST_LANES:]
    more = []
    if rest:
        more.append(element("details", element("summary", f"{plural(len(rest), 'more detector')}"), *rest))
    head = element("div", element("h2", "When"), legend(kinds, mark is not None), class_="th2")
    return element("section", head, *shown, axis, *more, class_="time")
