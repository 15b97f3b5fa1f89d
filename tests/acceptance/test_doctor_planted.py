"""Every planted fault is found, with the right body and span, alone and beside any other; a clean session has none."""

from __future__ import annotations

from itertools import combinations

import pytest
from support.planted_faults import BODIES, FAULTS, clean, teleport

from sessions import Severity, examine

SIZES = (0.05, 0.1, 3.0, *(pytest.param(size, marks=pytest.mark.slow) for size in (0.2, 0.3, 0.5, 1.0, 2.0)))


def test_a_clean_session_has_nothing_above_a_note(tmp_path):
    findings = examine(clean().write(tmp_path / "clean.mcap"))
    assert [one for one in findings if one.severity > Severity.NOTE] == []


@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("body", [0, 1])
def test_a_planted_fault_is_found_with_its_body_and_span(name, body, tmp_path):
    draft = clean()
    planted = FAULTS[name](draft, body, 300)
    findings = examine(draft.write(tmp_path / "one.mcap"))
    assert planted.is_found(findings, draft), [(one.code, one.body, one.message) for one in findings]
    found = next(one for one in findings if one.code == planted.code)
    assert found.severity > Severity.NOTE and found.meaning and found.fix
    about = {planted.body, ""} if planted.body else set(BODIES) | {""}
    assert {one.body for one in findings if one.severity > Severity.NOTE} <= about


@pytest.mark.parametrize(("one", "other"), [*combinations(FAULTS, 2)])
def test_two_planted_faults_are_both_found(one, other, tmp_path):
    draft = clean()
    planted = [FAULTS[one](draft, 0, 200), FAULTS[other](draft, 1, 600)]
    in_file = {one, other} & {"unknown frame", "wrong hash"}
    findings = examine(draft.write(tmp_path / "two.mcap") if in_file else draft.session())
    said = [(found.code, found.body, found.start, found.message) for found in findings]
    assert [what.is_found(findings, draft) for what in planted] == [True, True], said


@pytest.mark.parametrize("size", SIZES)
def test_teleports_are_found_from_five_centimetres(size, record_property):
    """Recall per size, printed; every one of ten centimetres and more must be found."""
    hits = tries = 0
    for body in (0, 1, 2):
        for at in range(40, 880, 60):
            draft = clean()
            planted = teleport(size)(draft, body, at)
            hits, tries = hits + planted.is_found(examine(draft.session()), draft), tries + 1
    print(f"teleports of {size} m: {hits} of {tries} found")
    record_property("recall", hits / tries)
    assert hits == tries if size >= 0.1 else hits >= 0.9 * tries
