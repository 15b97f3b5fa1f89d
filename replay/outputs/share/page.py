"""The page of a shared run, made anew from its summary and tables: a page that came with the folder is never passed on.

It is the report without stills: the picture itself stands beside it, and every fault leads it to its moment.
"""

from collections.abc import Callable, Mapping
from typing import Any, Final

from replay.base.constants import CAVEAT
from replay.comparison.false_contacts import FalseContact
from replay.comparison.outcome import Episode, Miss
from replay.outputs.report.details import last_section, words_section
from replay.outputs.report.first_screen import (
    Hero,
    all_detectors,
    audit_screen,
    doubt_lines,
    page_head,
    plain_hero,
    timeline_part,
)
from replay.outputs.report.markup import Markup, element, page_html, section_html
from replay.outputs.report.run_view import Fault, RunView, fault_address, with_noise
from replay.outputs.report.sections import effect_section, fault_sections
from replay.outputs.results.parquet_tables import EFFECT
from replay.outputs.results.run_folder import EPISODES, EVENTS, FALSE_CONTACTS, MISSES, RunFolder
from replay.outputs.words import NOT_LOOKED_FOR
from replay.pipeline.answer import Answer, Fix, KeyMoment
from replay.pipeline.headline import doubts_of, held
from replay.pipeline.ranking import fault_words
from replay.pipeline.sentences import plural
from sessions import Finding, Severity
from sessions.mcap_format.metadata import NOT_STATED

NOWHERE: Final = (0.0, 0.0, 0.0)


def title_of(run: RunFolder) -> str:
    """Whose session, and the answer."""
    return f"{_who(run)}: {_sentence(run, _answers(run))}"


def shared_page(run: RunFolder, *, pictured: bool) -> str:
    """The page as text; ``pictured``: the picture stands beside it."""
    view = folder_view(run)

    def look(label: str, fault: Fault) -> Markup:
        address = f"#{fault_address(view, label, fault)}"
        return element("p", element("a", "show it in the picture", href=address)) if pictured else Markup("")

    rows = (row for row in run.rows(EVENTS) if row["source"].startswith(EFFECT))
    events = [row | {"source": row["source"].removeprefix(EFFECT)} for row in rows]
    sections = [
        *fault_sections(view, None, look), *effect_section(view, events),
        last_section(view, held(run)), *words_section(view),
    ]  # fmt: skip
    found = (
        Finding(one["code"], Severity[one["severity"].upper()], one["body"] or "", one["message"])
        for one in run.summary.get("findings", ())
    )
    top = [page_head(view, _who(run), sections), *doubt_lines(doubts_of(found)), *_screen(run, view, look)]
    return page_html(title_of(run), top, [section_html(section) for section in sections], CAVEAT)


def _screen(run: RunFolder, view: RunView, look: Callable[[str, Fault], Markup]) -> list[Markup]:
    sentence = _sentence(run, view.answers)
    if "tradeoff" in run.summary:
        first = [plain_hero(Hero(sentence, run.summary["tradeoff"]["advice"]))]
        return [*first, *all_detectors(view, None)] if view.answers else first
    if view.answers:
        return audit_screen(view, None, look)
    return [plain_hero(Hero(sentence)), *([timeline_part(view, None)] if view.episodes else [])]


def _who(run: RunFolder) -> str:
    session = run.summary["session"]
    pseudonym = session["facts"].get("pseudonym", NOT_STATED)
    named = [session["scene"], "" if pseudonym == NOT_STATED else pseudonym, f"session {session['id']}"]
    return ", ".join(name for name in named if name)


def _sentence(run: RunFolder, answers: tuple[Answer, ...]) -> str:
    if "tradeoff" in run.summary:
        return str(run.summary["tradeoff"]["answer"])
    if answers:
        return answers[0].sentence
    detectors = run.summary["detectors"].items()
    found = [f"{plural(figures['contacts'], 'contact')} found by {label}" for label, figures in detectors]
    return ", ".join(found) or NOT_LOOKED_FOR


def folder_view(run: RunFolder) -> RunView:
    """What the page reads, from the rows of the tables."""
    pairs: dict[tuple[str, str], int] = {}
    reasons: dict[tuple[str, str, int], str] = {}
    misses: dict[str, list[Miss]] = {label: [] for label in run.summary["audit"]}
    false: dict[str, list[FalseContact]] = {label: [] for label in run.summary["audit"]}
    episodes: dict[str, list[Episode]] = {label: [] for label in run.summary["detectors"]}
    holdings = []

    def pair_of(row: Mapping[str, Any]) -> int:
        return pairs.setdefault((row["body_a"], row["body_b"]), len(pairs))

    for row in run.rows(EPISODES):
        contact = Episode(pair_of(row), row["first"], row["last"], row["start"], row["end"])
        episodes[row["detector"]].append(contact)
        if row["held"] and row["detector"] == run.oracle:
            holdings.append(contact)
    for row in run.rows(MISSES):
        reason = with_noise(row.get("why") or row["cause"], row.get("noise"))
        reasons[row["detector"], "miss", row["number"]] = reason
        misses.setdefault(row["detector"], []).append(
            Miss(
                **_named(row, "number body_a body_b first last start end kind episode deepest face_pairs cause"),
                pair=pair_of(row), point=NOWHERE, normal=NOWHERE, cut_length=row.get("cut_length") or 0.0,
            )
        )  # fmt: skip
    for row in run.rows(FALSE_CONTACTS):
        reasons[row["detector"], "false", row["number"]] = row.get("why") or row["cause"]
        false.setdefault(row["detector"], []).append(
            FalseContact(
                **_named(row, "number body_a body_b first last start end kind cause"), pair=pair_of(row),
                widest=row["first"], gap=float("nan"), point=NOWHERE,
            )
        )  # fmt: skip

    def why(label: str, fault: Fault) -> str:
        return reasons[label, "miss" if isinstance(fault, Miss) else "false", fault.number]

    return RunView(
        summary=run.summary, oracle=run.oracle, ranking=run.ranking, answers=_answers(run),
        misses={label: tuple(rows) for label, rows in misses.items()},
        false={label: tuple(rows) for label, rows in false.items()},
        episodes={label: tuple(rows) for label, rows in episodes.items()},
        holdings=tuple(holdings), why=why,
    )  # fmt: skip


def _named(row: Mapping[str, Any], names: str) -> dict[str, Any]:
    return {name: row.get(name, 0) for name in names.split()}


def _answers(run: RunFolder) -> tuple[Answer, ...]:
    """What a summary says first of each detector; one from before there were answers has its ranking."""
    told = {answer["label"]: answer for answer in run.summary.get("answers", ())}
    made = []
    for rank in run.ranking[:-1]:
        answer = told.get(rank.label)
        if answer is None:
            made.append(Answer(rank.label, f"{rank.label}: {fault_words(rank)}.", "", None, None))
            continue
        moment = answer["moment"] and KeyMoment(**{**answer["moment"], "pair": tuple(answer["moment"]["pair"])})
        fix = answer["fix"] and Fix(**answer["fix"])
        made.append(Answer(rank.label, answer["sentence"], answer["why"], fix, moment))
    return tuple(made)
