"""Mutants of session files, foreign recordings and scenes: no crash, no hang, memory bounded, errors named."""

import json
import subprocess
import sys
import threading
import time
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import bombs, hostile
from support.fuzzing import mutant, outcomes, seeds
from support.hand_made import HAND_MADE, wrong_with
from support.peak_memory import environment

SCRIPT = Path(__file__).resolve().parents[1] / "support" / "fuzzing.py"
LONGEST_S = 10.0
MOST_MIB = 512.0


def tried(folder, first, last):
    """Run mutants in a process of their own; what came of them. A silence longer than ten seconds is a hang."""
    command_environment = environment()
    command = [sys.executable, str(SCRIPT), str(folder), str(first), str(last)]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=command_environment
    )
    lines, heard = [], [time.monotonic() + 60.0]

    def listen():
        for line in process.stdout:
            lines.append(line.strip())
            heard[0] = time.monotonic() + LONGEST_S

    listener = threading.Thread(target=listen, daemon=True)
    listener.start()
    while process.poll() is None and time.monotonic() < heard[0]:
        time.sleep(0.02)
    hung = process.poll() is None
    if hung:
        process.kill()
    listener.join(timeout=10)
    errors = process.stderr.read()
    assert not hung, f"mutant {lines[-1:]} took more than {LONGEST_S} s"
    assert process.returncode == 0, f"mutant {lines[-1:]}: {errors[-2000:]}"
    return json.loads(lines[-1])


@pytest.mark.parametrize(
    ("first", "last"), [(0, 100), *(pytest.param(k, k + 5000, marks=pytest.mark.slow) for k in (0, 5000))]
)
def test_mutants_are_results_or_named_errors(tmp_path, first, last):
    told = tried(tmp_path, first, last)
    print(json.dumps(told))
    count = Counter(told["outcomes"])
    assert told["peak_mib"] < MOST_MIB
    for reader in ("read", "doctor", "recover", "scene", "csv", "aframe"):
        outcomes_of = (value for name, value in count.items() if name.startswith(f"{reader}:"))
        assert sum(outcomes_of) > (last - first) // 60, reader
    assert count["recover: fine"] > count["read: fine"] > 0
    assert count["read: SessionFileError"] > 0


@pytest.fixture(scope="module")
def corpus(tmp_path_factory):
    return seeds(tmp_path_factory.mktemp("corpus"))


def test_a_mutant_is_one_file_for_ever_and_two_are_two(corpus):
    assert mutant(corpus, 11) == mutant(corpus, 11) != mutant(corpus, 12)
    kinds = {mutant(corpus, number)[0] for number in range(60)}
    assert kinds == set(corpus)


def test_a_good_file_is_read_by_all(corpus, tmp_path):
    for name, data in corpus.items():
        assert [told for told in outcomes(name, data, tmp_path) if not told.endswith(": fine")] == [], name


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_spliced_files_are_results_or_named_errors(corpus, tmp_path_factory, data):
    """What hypothesis can cut and join out of two good files of one kind, shrunk where it fails."""
    suffix = data.draw(st.sampled_from([".mcap", ".csv", ".json", ".toml"]))
    names = [name for name in corpus if name.endswith(suffix)]
    one, other = (corpus[data.draw(st.sampled_from(names))] for _ in range(2))
    cut, join = data.draw(st.integers(0, len(one))), data.draw(st.integers(0, len(other)))
    body = one[:cut] + data.draw(st.binary(max_size=20)) + other[join:]
    assert outcomes(names[0], body, tmp_path_factory.getbasetemp())


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    return hostile.good_files(tmp_path_factory.mktemp("good"))


def test_four_verbs_agree_on_a_good_file(good, tmp_path):
    (tmp_path / "s.mcap").write_bytes(good["own.mcap"])
    found = hostile.verbs(tmp_path / "s.mcap", tmp_path / "out.mcap")
    assert all(accepted for accepted, _ in found.values()), found


@pytest.mark.parametrize("case", HAND_MADE)
def test_four_verbs_do_not_contradict_each_other_about_a_file_made_by_hand(good, tmp_path, case):
    assert HAND_MADE[case](good["own.mcap"]) != good["own.mcap"]
    assert wrong_with(case, good["own.mcap"], tmp_path) == []


@pytest.mark.parametrize("count", [24, pytest.param(500, marks=pytest.mark.slow)])
def test_four_verbs_do_not_contradict_each_other_about_mutants(tmp_path, count):
    """Thousands on demand: ``PYTHONPATH=.:tests python -m support.hostile FOLDER FIRST LAST``."""
    told = hostile.tried(tmp_path, 0, count)
    print(told["outcomes"])
    assert told["wrong"] == [] and told["outcomes"]["info accepts"] > count // 10


@pytest.mark.slow
@pytest.mark.parametrize("name", bombs.BOMBS)
def test_a_small_file_costs_every_verb_at_most_100_mb_and_2_s_beyond_what_its_bytes_cost(good, tmp_path, name):
    path, plain = tmp_path / "bomb.mcap", tmp_path / "good.mcap"
    plain.write_bytes(good["own.mcap"])
    path.write_bytes(bombs.BOMBS[name](good["own.mcap"]))
    for verb in bombs.VERBS:
        found = bombs.spent(verb, path, plain)
        assert bombs.within(path.stat().st_size, found), (verb, found)


@pytest.mark.parametrize("name", ["a scene of dots", "two million empty messages"])
def test_what_a_file_unpacks_to_or_nests_is_bounded_by_its_size(good, tmp_path, name):
    path = tmp_path / "bomb.mcap"
    path.write_bytes(bombs.SMALLER[name](good["own.mcap"]))
    found = hostile.verbs(path, tmp_path / "out.mcap")
    assert not found["info"][0] and hostile.contradictions(found) == [], found
