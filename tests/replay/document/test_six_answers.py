"""What, when, why, what to do, what it costs and how sure: every sentence of the answer is true in every state."""

import io
import re
from dataclasses import replace

import pytest
from msgspec import structs
from rich.console import Console, Group
from support.report_states import RUN_OF_STATE, audit_of, detector_of, document_with, run_with_steady_times, times_of

from replay import words
from replay.auditing.wilson import proportion
from replay.cli.run_tables import answer_lines
from replay.document.answer import Answer, Fix, FixFigures
from replay.document.certainty import certainty
from replay.document.cost import BUDGET_MS, busy_sentence
from replay.document.decision import FIX_FILES_SENTENCE, SHIP_COMMAND, shipping_decision
from replay.document.ranking import Rank, lesser_faults
from replay.show.sections import SectionName, section_of

AUDITED = [state for state in RUN_OF_STATE if state not in ("no reference", "effects", "findings")]
"""States of a run whose detectors are compared with a reference: each detector has an answer."""


def on_a_busy_machine(result, fraction=0.6):
    """The same result, timed while other work took this fraction of the processor."""
    detectors = {
        label: structs.replace(detector, seconds=structs.replace(detector.seconds, processor_fraction=1.0 - fraction))
        for label, detector in result.document.detectors.items()
    }
    return replace(result, document=structs.replace(result.document, detectors=detectors))


@pytest.mark.parametrize("state", AUDITED)
def test_headings_keep_their_order_and_end_as_sentences(state):
    """Do, Cost and Sure are in every state; text ends in a full stop, or in a colon before a command."""
    reasons = section_of(run_with_steady_times(state), SectionName.ANSWER).reasons
    names = [reason.heading for reason in reasons]
    order = ["What", "When", "Why", "Do", "Cost", "Sure", "Also", "Or"]
    assert names == [name for name in order if name in names] and {"Do", "Cost", "Sure"} <= {*names}
    for reason in reasons:
        assert reason.text.endswith((".", ":")) and reason.figures.endswith(("", ".", ":"))
        last = reason.figures or reason.text
        assert not last.endswith(":") or reason.command


@pytest.mark.parametrize("others", [0.0, 0.6])
def test_answer_of_every_state_fits_a_terminal_of_24_lines(others):
    """Others: the share of the machine that other programs take, which adds a line."""
    for state in AUDITED:
        stream = io.StringIO()
        Console(file=stream, width=80).print(
            Group(*answer_lines(on_a_busy_machine(run_with_steady_times(state), others), "session.mcap"))
        )
        lines = stream.getvalue().strip().splitlines()
        see_it_and_read_it = 2
        assert len(lines) + see_it_and_read_it <= 24 and max(map(len, lines)) <= 80, state


@pytest.mark.parametrize("state", AUDITED)
def test_times_printed_in_an_answer_are_times_of_faults(state):
    """Seconds after from, to and at, with one or three digits, are those at which a fault starts or ends."""
    result = run_with_steady_times(state)
    assert result.answers
    for answer in result.answers:
        faults = (*result.misses[answer.label], *result.false[answer.label])
        times = {f"{second:.3f}" for fault in faults for second in (fault.start, fault.end)}
        times |= {f"{second:.1f}" for fault in faults for second in (fault.start, fault.end)}
        printed = re.findall(r"(?:from|to|at) (\d+\.\d+)", answer.other_times)
        assert set(printed) <= times
        assert state != "a tradeoff" or printed == ["0.000", "0.060"]


@pytest.mark.parametrize("state", AUDITED)
def test_answer_has_what_and_when_if_it_has_a_moment(state):
    """The moment is that of the worst fault; an answer without a fault has none."""
    answers = run_with_steady_times(state).answers
    assert answers
    for answer in answers:
        assert bool(answer.when) == bool(answer.what) == (answer.moment is not None)
        assert answer.moment is None or answer.when.startswith(f"At {words.moment(answer.moment.seconds)}: ")


@pytest.mark.parametrize("state", AUDITED)
def test_what_when_and_why_describe_the_same_fault(state):
    """The fault of the answer's moment: its bodies, and no others, and its cause."""
    result = run_with_steady_times(state)
    for answer in (answer for answer in result.answers if answer.moment is not None):
        faults = {"miss": result.misses, "false": result.false}[answer.moment.kind][answer.label]
        fault = next(fault for fault in faults if fault.number == answer.moment.number)
        pair = " and ".join(fault.bodies)
        assert pair in answer.what and pair in answer.when and answer.why == fault.why
        assert all(f" {other} " not in answer.what for other in result.assembly.names if other not in fault.bodies)


@pytest.mark.parametrize("others", [0.0, 0.6])
def test_busy_machine_is_mentioned_exactly_once(others):
    """``others``: fraction of the machine that other programs take; of 0 nothing is said."""
    for state in AUDITED:
        reasons = section_of(on_a_busy_machine(run_with_steady_times(state), others), SectionName.ANSWER).reasons
        text = " ".join(f"{reason.text} {reason.figures}" for reason in reasons)
        assert text.count("The machine was busy") == (others > 0.0), state
        assert busy_sentence(others) in text, state


def rank_of(label, contacts=9, missed=0, false=0.0, mean=1e-4, p99=2e-4, **more):
    """A detector's rank: ``missed`` of 9 contacts, ``false``: fraction of its contact time; 0.1 ms a frame, p99 0.2."""
    counts = {} if label == "exact" else {"missed_counts": (missed, missed), "late_counts": (0, 0)}
    rank = Rank(label, label, label, contacts, mean, p99, missed=proportion(missed, max(1, contacts)), **counts)
    return replace(rank, false=proportion(round(100 * false), 100), **more)


def document_of(*labels, not_live=(), others=0.0):
    """The document of a run with these detectors; ``others``: fraction of the processor that other work took."""
    seconds = structs.replace(times_of(mean=1e-4, p99=2e-4), processor_fraction=1.0 - others)
    detectors = {label: detector_of(label, live=label not in not_live, seconds=seconds) for label in labels}
    return document_with(detectors=detectors, oracle="exact")


SLOW = 1.1e-3 * BUDGET_MS
"""Seconds that do not fit into the frame of 90 Hz."""


@pytest.mark.parametrize(
    ("ranks", "settings", "ships"),
    [
        ([rank_of("a", missed=1), rank_of("exact")], {}, "exact"),
        ([rank_of("a", missed=1), rank_of("exact", p99=SLOW)], {}, "a"),
        ([rank_of("a", missed=1), rank_of("exact")], {"not_live": ["exact"]}, "a"),
        ([rank_of("a", missed=1), rank_of("exact")], {"not_live": ["exact", "a"]}, "exact"),
        ([rank_of("a", missed=1), rank_of("b"), rank_of("exact")], {}, "exact"),
        ([rank_of("b", mean=5e-5), rank_of("exact")], {}, "b"),
        ([rank_of("b", mean=5e-5), rank_of("exact")], {"others": 0.5}, "exact"),
        ([rank_of("b", mean=None, p99=None), rank_of("exact")], {}, "exact"),
        # Other programs ran in the slowest frames.
        ([rank_of("a", missed=1), rank_of("exact", p99=SLOW)], {"others": 0.5}, "exact"),
        ([rank_of("a", undecided=2), rank_of("exact")], {}, "exact"),
        ([rank_of("a", undecided=2), rank_of("exact", p99=SLOW)], {}, None),
        ([rank_of("a", contacts=0), rank_of("exact", contacts=0)], {}, None),
        ([rank_of("a", missed=1), rank_of("b", false=0.5), rank_of("exact")], {}, "exact"),
        # Of two without an error the quicker, and the measured, first or last.
        ([rank_of("a", mean=5e-5), rank_of("b", mean=3e-5), rank_of("exact")], {}, "b"),
        ([rank_of("b", mean=3e-5), rank_of("a", mean=5e-5), rank_of("exact")], {}, "b"),
        ([rank_of("a", mean=None, p99=None), rank_of("b", mean=5e-5), rank_of("exact")], {}, "b"),
    ],
)
def test_shipped_detector_has_no_error_and_fits_the_frame(ranks, settings, ships):
    """``settings``: detectors that were not live, and what other work took; ``ships``: whom the decision names.

    A next best, where it is named, has the least error of the others but the reference.
    """
    made = shipping_decision(document_of(*(rank.label for rank in ranks), **settings), ranks)
    assert (None if made.rank is None else made.rank.label) == ships
    assert made.text.endswith(".") and made.figures.endswith(":") == bool(made.command)
    assert ships is None or made.text.startswith(f"Ship {ships}")
    rest = [rank for rank in ranks[:-1] if not rank.undecided and rank.loss]
    if "Next best" in made.figures:
        assert f"Next best is {min(rest, key=lambda rank: rank.loss).label}:" in made.figures


def fix_of(false, missed):
    """A measured Fix, of nine contacts."""
    none = proportion(0, 9)  # of the contacts
    figures = FixFigures(
        what="32 convex pieces",
        missed=proportion(missed, 9),
        late_or_cut_short=none,
        time_missed=none,
        false=proportion(round(100 * false), 100),
        missed_counts=(missed, missed),
        late_counts=(0, 0),
        offsets=16,
        mean=1e-4,
        p99=2e-4,
    )
    change = f"False 86 % -> {round(100 * false)} %, but missed 0 -> {missed} of 9."
    return Fix(
        "Split b.",
        measured=True,
        command="replay fix SESSION --engine unity",
        setting="collider",
        figures=figures,
        change=change,
    )


@pytest.mark.parametrize(("false", "missed", "ships"), [(0.1, 1, "fix"), (0.1, 8, "a"), (0.8, 1, "a")])
def test_a_shipped_fix_has_its_trade_in_the_same_sentence(false, missed, ships):
    """``false``: fraction; ``missed``: of nine contacts. Detector a has 86 % false contact; ``exact`` is too slow."""
    ranks = [rank_of("a", false=0.86), rank_of("exact", p99=SLOW)]
    fix = fix_of(false, missed)
    made = shipping_decision(structs.replace(document_of("a", "exact"), answers=(Answer("a", "", fix=fix),)), ranks)
    assert made.rank.label == ships and made.is_fix == (ships == "fix")
    if made.is_fix:
        assert (
            made.text == "In your engine, split b."
            and made.figures == f"{fix.change} {FIX_FILES_SENTENCE}"
            and made.command == fix.command
        )
        assert made.rank.loss == pytest.approx(false + missed / 9)


@pytest.mark.parametrize(("false", "place"), [(0.1, "In your engine, split b"), (0.8, "Ship exact")])
def test_decision_advises_the_fix_if_its_error_is_small(false, place):
    """Split meshes leave 10 % false contact: they are advised; 80 % is too much, and exact is shipped."""
    ranks = [rank_of("a", false=0.86), rank_of("exact")]
    answers = (Answer("a", "", fix=fix_of(false, missed=1)),)
    made = shipping_decision(structs.replace(document_of("a", "exact"), answers=answers), ranks)
    assert made.text.startswith(place)
    assert (made.in_code is not None) == made.is_fix
    if made.in_code is not None:
        assert made.in_code.text.startswith(
            "In your own code, ship exact, which Unity and Unreal do not offer: exact, right by definition"
        )


@pytest.mark.parametrize(
    ("state", "does"),
    [("in a hollow that is cut", "In your engine, split gate"), ("in a hollow", "Decide with another")],
)
def test_without_a_contact_only_false_contact_is_judged(state, does):
    """A ball in the hollow of a gate: false contact by its hull, which a cut into two pieces ends."""
    reasons = {
        reason.heading: reason for reason in section_of(run_with_steady_times(state), SectionName.ANSWER).reasons
    }
    assert reasons["Do"].text.startswith(does)
    assert reasons["Sure"].text == "Only of false contact: exact found no contact to compare, so none could be missed."
    if "cut" in state:
        assert (
            reasons["Do"].figures == f"False 100 % -> 0 %, no contact to miss. {FIX_FILES_SENTENCE}"
            and reasons["Do"].command
        )
        assert reasons["Or"].text.startswith(
            "In your own code, ship exact, which Unity and Unreal do not offer: every triangle, every frame"
        )


def test_without_a_contact_no_other_detector_is_called_right():
    """Detector b reports nothing, and nothing happened: the Fix of a is advised, in code a reference that is fast."""
    ranks = [rank_of("a", contacts=0, false=0.86), rank_of("b", contacts=0, mean=5e-5), rank_of("exact", contacts=0)]
    fix = structs.replace(fix_of(false=0.0, missed=0), command=SHIP_COMMAND)
    document = structs.replace(
        document_of("a", "b", "exact"), answers=(Answer("a", "", fix=fix),), audit={"a": audit_of()}
    )
    *others, fast_reference = ranks
    for reference in (fast_reference, replace(fast_reference, p99=SLOW)):
        made = shipping_decision(document, [*others, reference])
        assert made.is_fix and "b" not in (made.in_code.text if made.in_code else "").split()
        assert (made.in_code is None) == (reference.p99 == SLOW)


@pytest.mark.parametrize(
    ("missed", "late", "false", "undecided", "text"),
    [
        ((0, 1), (1, 3), 0.9, 0, "a misses up to 1 of 9 contacts; 1 to 3 are late or cut short."),
        ((1, 1), (1, 1), 0.9, 0, "a misses 1 of 9 contacts; 1 is late or cut short."),
        ((0, 0), (2, 2), 0.9, 0, "a reports 2 of 9 contacts late or cut short."),
        ((9, 9), (0, 0), 0.1, 0, "10 % of a's contact time is false."),
        ((9, 9), (0, 0), 0.0, 0, ""),
        ((9, 9), (0, 0), 0.1, 2, "a misses 9 of 9 contacts. 10 % of a's contact time is false."),
    ],
    ids=[
        "false leads",
        "false leads, one late",
        "false leads, none missed",
        "misses lead",
        "misses alone",
        "undecided",
    ],
)
def test_lesser_faults_are_whole_sentences(missed, late, false, undecided, text):
    """All faults but the largest, which the title has; undecided contacts are always the largest.

    The larger of false fraction and missed fraction leads. ``missed``, ``late``: least and most of nine contacts.
    """
    rank = rank_of("a", missed=missed[1], false=false, undecided=undecided, time_missed=proportion(0, 9))
    assert lesser_faults(replace(rank, missed_counts=missed, late_counts=late)) == text


def test_untimed_reference_is_not_said_to_fit_a_frame():
    """The reference has neither a mean nor a slowest time, and is shipped nevertheless."""
    ranks = [rank_of("a", missed=1), rank_of("exact", mean=None, p99=None)]
    text = shipping_decision(document_of("a", "exact"), ranks).text
    assert "time not measured" in text and "90 Hz" not in text


def test_undecided_detector_is_never_shipped_with_its_fix():
    """The fix would make it the better choice, but two of its contacts are undecided."""
    ranks = [rank_of("a", false=0.86, undecided=2), rank_of("exact")]
    answers = (Answer("a", "", fix=fix_of(false=0.1, missed=0)),)
    made = shipping_decision(structs.replace(document_of("a", "exact"), answers=answers), ranks)
    assert made.rank.label == "exact" and not made.is_fix


def test_without_an_audit_nothing_is_recommended_or_sure():
    """Without a reference there is no ranking."""
    assert shipping_decision(document_of("a"), ()) is None and certainty(document_of("a"), ()) == []


@pytest.mark.parametrize("state", AUDITED)
def test_interval_of_the_answer_is_that_of_the_ranking(state):
    """The first sentence of certainty has it where there are contacts; an interval of over 50 % is not very certain."""
    result = run_with_steady_times(state)
    first = certainty(result.document, result.ranking)[0]
    worst = result.ranking[0]
    assert (words.plural(worst.contacts, "contact") in first) == bool(worst.contacts)
    printed = re.search(r"ith .*, (.* %) (false|missed) may be (.*)\.$", first)
    assert bool(printed) == bool(worst.contacts)
    if printed:
        leading = worst.false if printed[2] == "false" else worst.missed
        assert printed[3] == words.interval(leading.lower, leading.upper)
        assert printed[1] == words.as_percentage(leading.value or 0.0)
        assert first.startswith("Not very") == (leading.upper - leading.lower > 0.5)


@pytest.mark.parametrize(("facts", "made_up"), [({"synthetic": "true"}, True), ({}, False)])
def test_certainty_mentions_a_made_up_session(facts, made_up):
    """``facts``: of the session, by which it is made up."""
    document = run_with_steady_times("several").document
    document = structs.replace(document, session=structs.replace(document.session, facts=facts))
    text = " ".join(certainty(document, run_with_steady_times("several").ranking))
    assert ("made-up session" in text) == made_up


@pytest.mark.parametrize("state", AUDITED)
def test_why_explains_missed_and_false_contacts(state):
    """The cause of one miss is named, where there are misses, and that of one false contact."""
    result = run_with_steady_times(state)
    assert result.answers
    for answer in result.answers:
        misses, false_contacts = result.misses[answer.label], result.false[answer.label]
        named = f"{answer.why} {answer.other_causes}"
        assert (answer.moment is not None) == bool(misses or false_contacts)
        assert not misses or any(miss.why in named for miss in misses)
        assert not false_contacts or any(false_contact.why in named for false_contact in false_contacts)
