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


def on_a_busy_machine(result, fraction):
    """The same result, timed while other work took this fraction of the processor."""
    detectors = {
        label: structs.replace(detector, seconds=structs.replace(detector.seconds, processor_fraction=1.0 - fraction))
        for label, detector in result.document.detectors.items()
    }
    return replace(result, document=structs.replace(result.document, detectors=detectors))


def test_headings_keep_their_order_and_end_as_sentences():
    """Runs in all states, as "one missed" or "only false": Do, Cost and Sure are in every answer.

    Text ends in a full stop, or in a colon before a command.
    """
    order = ["What", "When", "Why", "Do", "Cost", "Sure", "Also", "Or"]
    for state in AUDITED:
        reasons = section_of(run_with_steady_times(state), SectionName.ANSWER).reasons
        headings = [reason.heading for reason in reasons]
        assert headings == [heading for heading in order if heading in headings], state
        assert {"Do", "Cost", "Sure"} <= {*headings}, state
        for reason in reasons:
            assert reason.text.endswith((".", ":")), state
            assert reason.figures == "" or reason.figures.endswith((".", ":")), state
            last_sentence = reason.figures or reason.text
            assert not last_sentence.endswith(":") or reason.command, state


@pytest.mark.parametrize("busy", [0.0, 0.6])
def test_answer_of_every_state_fits_a_terminal_of_24_lines(busy):
    """``busy``: the fraction of the machine that other programs take, which adds a line; lines have 80 columns.

    Two more lines, *See it* and *Read it*, follow the answer.
    """
    for state in AUDITED:
        stream = io.StringIO()
        answer = answer_lines(on_a_busy_machine(run_with_steady_times(state), busy), "session.mcap")
        Console(file=stream, width=80).print(Group(*answer))
        lines = stream.getvalue().strip().splitlines()
        see_it_and_read_it = 2
        assert len(lines) + see_it_and_read_it <= 24, state
        assert max(map(len, lines)) <= 80, state


def answers_of_all_states():
    """A state, its run, and an answer of the run: of every answer in every state."""
    for state in AUDITED:
        result = run_with_steady_times(state)
        assert result.answers, state
        yield from ((state, result, answer) for answer in result.answers)


def test_times_printed_in_an_answer_are_times_of_faults():
    """Seconds after "from", "to" and "at", with one or three decimals, are those at which a fault starts or ends."""
    all_printed = []
    for state, result, answer in answers_of_all_states():
        faults = (*result.misses[answer.label], *result.false[answer.label])
        seconds = [second for fault in faults for second in (fault.start, fault.end)]
        times = {f"{second:.3f}" for second in seconds} | {f"{second:.1f}" for second in seconds}
        printed = re.findall(r"(?:from|to|at) (\d+\.\d+)", answer.other_times)
        assert set(printed) <= times, state
        all_printed += printed
    assert all_printed


def test_answer_prints_from_when_to_when_other_faults_are():
    """Six frames of 10 ms: two cubes touch in frames 0, 2, 4 and 5, of which the only detector reports 2 and 4.

    So the contact of frame 0 is missed, and frame 5 of the last one: from 0 to 0.06 s, where frame 5 ends.
    """
    answers = run_with_steady_times("a tradeoff").answers
    assert answers
    for answer in answers:
        assert re.findall(r"(?:from|to|at) (\d+\.\d+)", answer.other_times) == ["0.000", "0.060"]


def test_answer_has_what_and_when_if_it_has_a_moment():
    """The moment is that of the worst fault; an answer without a fault has none, and neither What nor When."""
    for state, _, answer in answers_of_all_states():
        assert bool(answer.when) == bool(answer.what) == (answer.moment is not None), state
        if answer.moment is not None:
            assert answer.when.startswith(f"At {words.moment(answer.moment.seconds)}: "), state


def test_what_when_and_why_describe_the_same_fault():
    """The fault is that of the answer's moment: What and When name its two bodies, What no other; Why is its cause."""
    answers_with_a_moment = [row for row in answers_of_all_states() if row[-1].moment is not None]
    assert answers_with_a_moment
    for state, result, answer in answers_with_a_moment:
        faults = {"miss": result.misses, "false": result.false}[answer.moment.kind][answer.label]
        (fault,) = (fault for fault in faults if fault.number == answer.moment.number)
        pair = " and ".join(fault.bodies)
        assert pair in answer.what and pair in answer.when, state
        assert answer.why == fault.why, state
        other_bodies = [name for name in result.assembly.names if name not in fault.bodies]
        assert [name for name in other_bodies if f" {name} " in answer.what] == [], state


@pytest.mark.parametrize(("busy", "mentions"), [(0.0, 0), (0.6, 1)])
def test_busy_machine_is_mentioned_exactly_once(busy, mentions):
    """Runs in all states; ``busy``: fraction of the machine that other programs take."""
    for state in AUDITED:
        reasons = section_of(on_a_busy_machine(run_with_steady_times(state), busy), SectionName.ANSWER).reasons
        text = " ".join(f"{reason.text} {reason.figures}" for reason in reasons)
        assert text.count("The machine was busy") == mentions, state
        assert busy_sentence(busy) in text, state


def rank_of(label, contacts=9, missed=0, false=0.0, mean=1e-4, p99=2e-4, **more):
    """A detector's row of the ranking; "exact" is the reference.

    ``missed``: of 9 contacts; ``false``: fraction of its contact time; ``mean``, ``p99``: seconds of a frame, on
    average and in 99 % of the frames, None: not measured.
    """
    counts = {} if label == "exact" else {"missed_counts": (missed, missed), "late_counts": (0, 0)}
    rank = Rank(label, label, label, contacts, mean, p99, missed=proportion(missed, max(1, contacts)), **counts)
    return replace(rank, false=proportion(round(100 * false), 100), **more)


def document_of(*labels, offline=(), busy=0.0, answers=()):
    """The document of a run with these detectors.

    ``offline``: those that got all frames at once; ``busy``: fraction of the processor that other work took.
    """
    seconds = structs.replace(times_of(mean=1e-4, p99=2e-4), processor_fraction=1.0 - busy)
    detectors = {label: detector_of(label, live=label not in offline, seconds=seconds) for label in labels}
    return structs.replace(document_with(detectors=detectors, oracle="exact"), answers=answers)


TOO_SLOW = 1.1e-3 * BUDGET_MS
"""Seconds that do not fit into the frame of 90 Hz, 11.1 ms."""
MISSES_ONE = {"missed": 1}
FAST, FASTER = {"mean": 5e-5}, {"mean": 3e-5}
"""Seconds of a frame; usual are 1e-4."""
NOT_TIMED = {"mean": None, "p99": None}
UNDECIDED = {"undecided": 2}
"""Contacts."""


@pytest.mark.parametrize(
    ("ranks", "settings", "shipped"),
    [
        pytest.param([rank_of("a", **MISSES_ONE), rank_of("exact")], {}, "exact", id="a misses one"),
        pytest.param(
            [rank_of("a", **MISSES_ONE), rank_of("exact", p99=TOO_SLOW)], {}, "a", id="a misses one, exact too slow"
        ),
        pytest.param(
            [rank_of("a", **MISSES_ONE), rank_of("exact")], {"offline": ["exact"]}, "a", id="exact not run live"
        ),
        pytest.param(
            [rank_of("a", **MISSES_ONE), rank_of("exact")], {"offline": ["exact", "a"]}, "exact", id="none run live"
        ),
        pytest.param(
            [rank_of("a", **MISSES_ONE), rank_of("b"), rank_of("exact")], {}, "exact", id="b right, not faster"
        ),
        pytest.param([rank_of("b", **FAST), rank_of("exact")], {}, "b", id="b right and faster"),
        pytest.param([rank_of("b", **FAST), rank_of("exact")], {"busy": 0.5}, "exact", id="b faster on a busy machine"),
        pytest.param([rank_of("b", **NOT_TIMED), rank_of("exact")], {}, "exact", id="b right, not timed"),
        pytest.param(
            # Other programs ran in the slowest frames.
            [rank_of("a", **MISSES_ONE), rank_of("exact", p99=TOO_SLOW)],
            {"busy": 0.5},
            "exact",
            id="exact slow on a busy machine",
        ),
        pytest.param([rank_of("a", **UNDECIDED), rank_of("exact")], {}, "exact", id="a undecided"),
        pytest.param(
            [rank_of("a", **UNDECIDED), rank_of("exact", p99=TOO_SLOW)], {}, None, id="a undecided, exact too slow"
        ),
        pytest.param([rank_of("a", contacts=0), rank_of("exact", contacts=0)], {}, None, id="no contact"),
        pytest.param(
            [rank_of("a", **MISSES_ONE), rank_of("b", false=0.5), rank_of("exact")], {}, "exact", id="both wrong"
        ),
        pytest.param(
            [rank_of("a", **FAST), rank_of("b", **FASTER), rank_of("exact")], {}, "b", id="two right, b faster"
        ),
        pytest.param(
            [rank_of("b", **FASTER), rank_of("a", **FAST), rank_of("exact")], {}, "b", id="two right, b faster, first"
        ),
        pytest.param(
            [rank_of("a", **NOT_TIMED), rank_of("b", **FAST), rank_of("exact")], {}, "b", id="two right, b timed"
        ),
    ],
)
def test_shipped_detector_has_no_error_and_fits_the_frame(ranks, settings, shipped):
    """Detectors over nine contacts, of which none is missed, false or undecided but as said; exact is the reference.

    A frame takes 0.1 ms, FAST 0.05, FASTER 0.03, TOO_SLOW more than the 11.1 ms of a headset's frame. ``shipped``: the
    detector that the decision advises to build into one's own program; None: it advises none.
    """
    decision = shipping_decision(document_of(*(rank.label for rank in ranks), **settings), ranks)
    assert (None if decision.rank is None else decision.rank.label) == shipped
    assert decision.text.endswith(".")
    assert decision.figures.endswith(":") == bool(decision.command)
    assert shipped is None or decision.text.startswith(f"Ship {shipped}")


@pytest.mark.parametrize("labels", [("a", "b"), ("b", "a")])
def test_next_best_detector_has_the_smallest_error_of_the_others(labels):
    """a misses 1 of 9 contacts, half of the contact time of b is false: a is next best to exact, in any order."""
    others = {"a": rank_of("a", **MISSES_ONE), "b": rank_of("b", false=0.5)}
    ranks = [*(others[label] for label in labels), rank_of("exact")]
    decision = shipping_decision(document_of("a", "b", "exact"), ranks)
    assert "Next best is a: " in decision.figures


def fix_that_splits_the_beaker(false, missed):
    """A measured fix of a detector with 86 % false contact: the mesh of a beaker is split into 32 convex pieces.

    ``false``: fraction of contact time that is false then; ``missed``: of nine contacts, as many at each of the 16
    sampling offsets.
    """
    none_of_nine = proportion(0, 9)
    figures = FixFigures(
        what="32 convex pieces",
        missed=proportion(missed, 9),
        late_or_cut_short=none_of_nine,
        time_missed=none_of_nine,
        false=proportion(round(100 * false), 100),
        missed_counts=(missed, missed),
        late_counts=(0, 0),
        offsets=16,
        mean=1e-4,
        p99=2e-4,
    )
    change = f"False 86 % -> {round(100 * false)} %, but missed 0 -> {missed} of 9."
    return Fix("Split beaker.", measured=True, command=SHIP_COMMAND, setting="collider", figures=figures, change=change)


def test_a_shipped_fix_has_its_trade_in_the_same_sentence():
    """Detector a is 86 % false; its measured fix leaves 10 % and misses 1 of 9: a loss of 0.1 + 1/9, which is less.

    Exact, the reference, takes longer than the 11.1 ms of a frame, so that no detector but the fix is advised.
    """
    fix = fix_that_splits_the_beaker(false=0.1, missed=1)
    document = document_of("a", "exact", answers=(Answer("a", "", fix=fix),))
    decision = shipping_decision(document, [rank_of("a", false=0.86), rank_of("exact", p99=TOO_SLOW)])
    assert decision.is_fix and decision.rank.label == "fix"
    assert decision.text == "In your engine, split beaker."
    assert decision.figures == f"{fix.change} {FIX_FILES_SENTENCE}"
    assert decision.command == fix.command
    assert decision.rank.loss == pytest.approx(0.1 + 1 / 9)


@pytest.mark.parametrize(("false", "missed"), [(0.1, 8), (0.8, 1)])
def test_fix_that_adds_more_errors_is_not_shipped(false, missed):
    """Detector a is 86 % false, a loss of 0.86. With its fix it is 0.1 (false) + 8/9 (missed), or 0.8 + 1/9: more.

    So a is shipped as it is; exact, the reference, takes longer than a frame.
    """
    document = document_of("a", "exact", answers=(Answer("a", "", fix=fix_that_splits_the_beaker(false, missed)),))
    decision = shipping_decision(document, [rank_of("a", false=0.86), rank_of("exact", p99=TOO_SLOW)])
    assert decision.rank.label == "a" and not decision.is_fix


def test_decision_is_fix_in_engine_and_exact_in_own_code():
    """The fix of detector a, a split mesh, leaves 10 % false contact and 1 of 9 missed: less than the 86 % false of a.

    Exact, the reference, fits into a frame, but engines do not have it: for one's own code (``in_code``) it is advised.
    """
    answers = (Answer("a", "", fix=fix_that_splits_the_beaker(false=0.1, missed=1)),)
    ranks = [rank_of("a", false=0.86), rank_of("exact")]
    decision = shipping_decision(document_of("a", "exact", answers=answers), ranks)
    assert decision.text.startswith("In your engine, split beaker")
    assert decision.in_code.text.startswith(
        "In your own code, ship exact, which Unity and Unreal do not offer: exact, right by definition"
    )


def test_decision_is_exact_alone_if_the_fix_is_no_better():
    """The fix of detector a leaves 80 % false contact and misses 1 of 9: 0.8 + 1/9 is no less than the 0.86 of a.

    Exact, the reference, fits into a frame.
    """
    answers = (Answer("a", "", fix=fix_that_splits_the_beaker(false=0.8, missed=1)),)
    ranks = [rank_of("a", false=0.86), rank_of("exact")]
    decision = shipping_decision(document_of("a", "exact", answers=answers), ranks)
    assert decision.text.startswith("Ship exact")
    assert decision.in_code is None and not decision.is_fix


def reasons_of(state):
    """Heading -> the sentences below it, of a run in a state."""
    reasons = section_of(run_with_steady_times(state), SectionName.ANSWER).reasons
    return {reason.heading: reason for reason in reasons}


@pytest.mark.parametrize("state", ["in a hollow that is cut", "in a hollow"])
def test_without_a_contact_only_false_contact_is_sure(state):
    """A ball in the hollow of a gate touches nothing; the convex hull of the gate reports false contact."""
    sure = reasons_of(state)["Sure"]
    assert sure.text == "Only of false contact: exact found no contact to compare, so none could be missed."


def test_without_a_contact_another_session_is_to_decide():
    """A ball in the hollow of a gate touches nothing; no measured fix ends the false contact of the gate's hull."""
    assert reasons_of("in a hollow")["Do"].text.startswith("Decide with another")


def test_cut_that_ends_false_contact_is_advised_without_a_contact():
    """A ball in the hollow of a gate touches nothing: the hull of the gate reports contact, two pieces of it do not.

    The gate is to be cut in an engine; in code of one's own exact, the reference, is proposed.
    """
    reasons = reasons_of("in a hollow that is cut")
    assert reasons["Do"].text.startswith("In your engine, split gate")
    assert reasons["Do"].figures == f"False 100 % -> 0 %, no contact to miss. {FIX_FILES_SENTENCE}"
    assert reasons["Do"].command != ""
    assert reasons["Or"].text.startswith(
        "In your own code, ship exact, which Unity and Unreal do not offer: every triangle, every frame"
    )


@pytest.mark.parametrize(
    ("p99", "has_advice_for_code"), [(2e-4, True), (TOO_SLOW, False)], ids=["exact is fast", "exact is too slow"]
)
def test_without_a_contact_no_other_detector_is_called_right(p99, has_advice_for_code):
    """Nothing touches, and detector b reports nothing, in half the time of exact; still b is not advised.

    What a reports is 86 % false, and 0 % after its measured fix: that is advised for an engine. For one's own code
    (``in_code``) exact is advised, or nothing if 99 % of its frames do not fit into 11.1 ms (TOO_SLOW).
    """
    others = [rank_of("a", contacts=0, false=0.86), rank_of("b", contacts=0, **FAST)]
    fix = fix_that_splits_the_beaker(false=0.0, missed=0)
    document = document_of("a", "b", "exact", answers=(Answer("a", "", fix=fix),))
    document = structs.replace(document, audit={"a": audit_of()})
    decision = shipping_decision(document, [*others, rank_of("exact", contacts=0, p99=p99)])
    assert decision.is_fix
    advised_for_code = decision.in_code.rank.label if decision.in_code else None
    assert advised_for_code == ("exact" if has_advice_for_code else None)


@pytest.mark.parametrize(
    ("missed", "late", "false", "undecided", "text"),
    [
        pytest.param(
            (0, 1), (1, 3), 0.9, 0, "a misses up to 1 of 9 contacts; 1 to 3 are late or cut short.", id="false leads"
        ),
        pytest.param(
            (1, 1), (1, 1), 0.9, 0, "a misses 1 of 9 contacts; 1 is late or cut short.", id="false leads, one late"
        ),
        pytest.param(
            (0, 0), (2, 2), 0.9, 0, "a reports 2 of 9 contacts late or cut short.", id="false leads, none missed"
        ),
        pytest.param((9, 9), (0, 0), 0.1, 0, "10 % of a's contact time is false.", id="misses lead"),
        pytest.param((9, 9), (0, 0), 0.0, 0, "", id="misses alone"),
        pytest.param(
            (9, 9), (0, 0), 0.1, 2, "a misses 9 of 9 contacts. 10 % of a's contact time is false.", id="undecided leads"
        ),
    ],
)
def test_lesser_faults_are_whole_sentences(missed, late, false, undecided, text):
    """All faults but the leading one, which the title has: undecided contacts, else the larger fraction.

    ``missed``, ``late``: fewest and most of nine contacts over the sampling offsets; ``false``: fraction.
    """
    _fewest, most = missed
    rank = rank_of("a", missed=most, false=false, undecided=undecided, time_missed=proportion(0, 9))
    assert lesser_faults(replace(rank, missed_counts=missed, late_counts=late)) == text


def test_untimed_reference_is_not_said_to_fit_a_frame():
    """Detector a misses a contact; exact, the reference, was not timed, and is shipped nevertheless."""
    ranks = [rank_of("a", **MISSES_ONE), rank_of("exact", **NOT_TIMED)]
    text = shipping_decision(document_of("a", "exact"), ranks).text
    assert text.startswith("Ship exact")
    assert "time not measured" in text and "90 Hz" not in text


def test_undecided_detector_is_never_shipped_with_its_fix():
    """The fix of detector a would leave 10 % of 86 % false contact, but a left two of nine contacts undecided.

    So exact, the reference, is shipped.
    """
    ranks = [rank_of("a", false=0.86, **UNDECIDED), rank_of("exact")]
    answers = (Answer("a", "", fix=fix_that_splits_the_beaker(false=0.1, missed=0)),)
    decision = shipping_decision(document_of("a", "exact", answers=answers), ranks)
    assert decision.rank.label == "exact" and not decision.is_fix


def test_without_an_audit_nothing_is_recommended_or_sure():
    """Without a reference there is no ranking: no decision, and no sentence on how sure it is."""
    no_ranks = ()
    assert shipping_decision(document_of("a"), no_ranks) is None
    assert certainty(document_of("a"), no_ranks) == []


def test_interval_of_the_answer_is_that_of_the_ranking():
    """With contacts, the first sentence on certainty has their number and the worst detector's 95 % interval.

    Its larger fault, false contact or missed contacts, is stated; with an interval of over 50 % "Not very" begins it.
    """
    for state in AUDITED:
        result = run_with_steady_times(state)
        first, *_ = certainty(result.document, result.ranking)
        worst = result.ranking[0]
        assert (words.plural(worst.contacts, "contact") in first) == (worst.contacts > 0), state
        printed = re.search(r"ith .*, (?P<value>.* %) (?P<fault>false|missed) may be (?P<interval>.*)\.$", first)
        assert (printed is not None) == (worst.contacts > 0), state
        if printed:
            leading = worst.false if printed["fault"] == "false" else worst.missed
            assert printed["interval"] == words.interval(leading.lower, leading.upper), state
            assert printed["value"] == words.as_percentage(leading.value or 0.0), state
            assert first.startswith("Not very") == (leading.upper - leading.lower > 0.5), state


@pytest.mark.parametrize(("facts", "is_made_up"), [({"synthetic": "true"}, True), ({}, False)])
def test_certainty_mentions_a_made_up_session(facts, is_made_up):
    """``facts``: of the session; a fact ``synthetic`` says that nobody recorded it."""
    run = run_with_steady_times("several")
    document = structs.replace(run.document, session=structs.replace(run.document.session, facts=facts))
    assert ("made-up session" in " ".join(certainty(document, run.ranking))) == is_made_up


def test_why_explains_missed_and_false_contacts():
    """An answer names the cause of a miss and of a false contact, if its detector has any; else it has no moment."""
    for state, result, answer in answers_of_all_states():
        misses, false_contacts = result.misses[answer.label], result.false[answer.label]
        causes = f"{answer.why} {answer.other_causes}"
        assert (answer.moment is not None) == bool(misses or false_contacts), state
        assert not misses or any(miss.why in causes for miss in misses), state
        assert not false_contacts or any(contact.why in causes for contact in false_contacts), state
