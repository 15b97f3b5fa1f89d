"""The page of a shared run, made anew from its summary and tables: a page that came with the folder is never passed on.

It is the report without stills: the picture itself stands beside it, and every fault leads it to its moment.
"""

from replay.outputs.report.markup import Markup, element
from replay.outputs.report.page import run_page
from replay.outputs.report.run_view import Fault, Hero, RunView, contacts_of, fault_address, faults_of, findings_of
from replay.outputs.results.parquet_tables import EFFECT
from replay.outputs.results.run_folder import EPISODES, EVENTS, FALSE_CONTACTS, MISSES, RunFolder
from replay.outputs.words import NOT_LOOKED_FOR
from replay.pipeline.answer import Answer, Fix, KeyMoment
from replay.pipeline.headline import doubts_of, held
from replay.pipeline.ranking import fault_words
from replay.pipeline.sentences import plural
from sessions.mcap_format.metadata import NOT_STATED


def shared_page(view: RunView, *, pictured: bool) -> str:
    """The page as text; ``pictured``: the picture stands beside it."""

    def look(fault: Fault) -> Markup:
        address = f"#{fault_address(view, fault)}"
        return element("p", element("a", "show it in the picture", href=address)) if pictured else Markup("")

    return run_page(view, None, look)


def folder_view(run: RunFolder) -> RunView:
    """What the page reads, from the rows of the tables."""
    summary = run.summary
    effects = (row for row in run.rows(EVENTS) if row["source"].startswith(EFFECT))
    answers = _answers(run)
    return RunView(
        summary=summary, oracle=run.oracle, ranking=run.ranking, answers=answers,
        faults=faults_of(summary["audit"], run.rows(MISSES), run.rows(FALSE_CONTACTS)),
        contacts=contacts_of(summary["detectors"], run.rows(EPISODES), run.oracle),
        events=[row | {"source": row["source"].removeprefix(EFFECT)} for row in effects],
        name=_who(run), hero=_hero(run, answers), doubts=doubts_of(findings_of(summary)), notes=held(run),
    )  # fmt: skip


def _who(run: RunFolder) -> str:
    session = run.summary["session"]
    pseudonym = session["facts"].get("pseudonym", NOT_STATED)
    named = [session["scene"], "" if pseudonym == NOT_STATED else pseudonym, f"session {session['id']}"]
    return ", ".join(name for name in named if name)


def _hero(run: RunFolder, answers: tuple[Answer, ...]) -> Hero | None:
    if "tradeoff" in run.summary:
        return Hero(str(run.summary["tradeoff"]["answer"]), run.summary["tradeoff"]["advice"])
    if answers:
        return None
    detectors = run.summary["detectors"].items()
    found = [f"{plural(figures['contacts'], 'contact')} found by {label}" for label, figures in detectors]
    return Hero(", ".join(found) or NOT_LOOKED_FOR)


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
