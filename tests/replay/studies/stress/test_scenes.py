"""Scenes, cases and relations are what they say, and what is written of them is read back bit for bit."""

from dataclasses import replace

import numpy as np
import pytest

from cdcore import Verdict, create_detector
from cdcore.narrow.triangles.integers import pair_intersects_integers
from replay.errors import OutputError, StressError
from replay.studies.stress import attempts
from replay.studies.stress.attempts import ATTEMPTS
from replay.studies.stress.cases import Cases, read_cases, write_cases
from replay.studies.stress.crossings import OVER_INTERVALS, PHASES, SPEEDS, crossing, grazing, thin_wall
from replay.studies.stress.families import FAMILIES
from replay.studies.stress.relations import RELATIONS, relations_of
from replay.studies.stress.scene_files import FailedScene, read_scenes, write_scenes
from replay.studies.stress.scenes import AT_INSTANTS, degenerate, meeting, resting


def scenes(number, seed=7):
    return list(AT_INSTANTS[number][1](np.random.default_rng(seed)))


@pytest.mark.parametrize("number", AT_INSTANTS)
def test_exact_is_right_on_every_frame_of_every_scene(number):
    for scene in scenes(number):
        verdict = create_detector("exact", scene.bodies).detect(scene.motion).verdict[:, 0]
        assert np.array_equal(verdict, scene.truth), scene.name
        assert len(scene.truth) == len(scene.motion)


@pytest.mark.parametrize("number", [37, 38, 39, 41])
def test_cases_of_contact_hold_frames_with_and_without(number):
    truth = np.concatenate([scene.truth for scene in scenes(number)])
    assert {Verdict.CLEAR, Verdict.CONTACT} == set(truth.tolist())


def test_the_same_seed_makes_the_same_worlds_and_another_other_ones():
    first, again, other = (scenes(41, seed)[0].motion.translations for seed in (1, 1, 2))
    assert np.array_equal(first, again) and not np.array_equal(first, other)


def test_a_lifted_glass_is_clear_as_it_stands_and_a_sunk_one_meets_the_table():
    for scene in resting(np.random.default_rng(0)):
        assert (scene.truth[0] == Verdict.CONTACT) == (float(scene.name.split()[2]) <= 0), scene.name


def test_icospheres_kiss_in_36_face_pairs():
    (kiss,) = (scene for scene in degenerate(np.random.default_rng(0)) if "kissing" in scene.name)
    assert len(meeting(kiss.bodies, kiss.motion, 0)) == 36


def first_scenes(number, count):
    return list(OVER_INTERVALS[number][1](np.random.default_rng(5)))[:count]


@pytest.mark.parametrize(("speed", "missed"), list(zip(SPEEDS, (0, 0.1, 0.46, 0.73, 0.865), strict=True)))
def test_instants_miss_the_share_of_phases_that_arithmetic_says(speed, missed):
    scene = list(thin_wall(np.random.default_rng(0)))[2 * SPEEDS.index(speed)]
    verdict = create_detector("exact", scene.bodies).detect(scene.motion).verdict.reshape(PHASES, -1)
    assert (verdict != Verdict.CONTACT).all(axis=1).mean() == pytest.approx(missed, abs=0.005 + 1e-9)


@pytest.mark.parametrize("number", [30, 31, 32, 33])
def test_continuous_agrees_with_every_scene(number):
    for scene in first_scenes(number, 10):
        verdict = create_detector("continuous", scene.bodies).detect(scene.motion).verdict
        assert (verdict == Verdict.CONTACT).any() == bool(scene.truth[0]), scene.name
        assert not (verdict == Verdict.UNRESOLVED).any(), scene.name


def test_every_case_of_motion_holds_contacts_and_misses():
    for number in OVER_INTERVALS:
        assert {0, 1} == set(np.concatenate([scene.truth for scene in first_scenes(number, 99)]).tolist())


def test_crossings_are_apart_at_both_ends_and_not_linked_to_each_other():
    motion = crossing(1.0, 7)
    height = motion.translations[:, 0, 2].reshape(7, -1)
    assert (height[:, 0] > 0.003).all() and (height[:, -1] < -0.003).all()
    assert not motion.linked.reshape(7, -1, 2)[:, 0].any() and motion.linked.reshape(7, -1, 2)[:, 1:].all()


def failed():
    scenes = [next(resting(np.random.default_rng(0))), next(grazing(np.random.default_rng(0)))]
    return [FailedScene(scene, np.zeros(len(scene.truth), dtype=np.uint8)) for scene in scenes]


def test_what_is_written_is_read_back_bit_for_bit(tmp_path):
    path = write_scenes(failed(), "Hybrid:x", 41, 5, tmp_path / "new")
    assert path.name == "case-41-hybrid-x-seed-5.npz"
    for one, back in zip(failed(), read_scenes(path), strict=True):
        assert (one.scene.name, one.scene.covers) == (back.scene.name, back.scene.covers)
        for name in ("times", "translations", "rotations", "valid", "linked"):
            assert getattr(one.scene.motion, name).tobytes() == getattr(back.scene.motion, name).tobytes()
        for a, b in zip(one.scene.bodies, back.scene.bodies, strict=True):
            assert a.mesh.triangles.tobytes() == b.mesh.triangles.tobytes()
        assert np.array_equal(one.scene.truth, back.scene.truth) and np.array_equal(one.said, back.said)


def test_a_folder_that_is_a_file_and_a_file_that_is_none_are_one_sentence(tmp_path):
    (tmp_path / "taken").write_text("")
    with pytest.raises(OutputError, match="give another folder with --out"):
        write_scenes(failed(), "a", 41, 5, tmp_path / "taken")
    for content in (b"", b"PK\x03\x04 torn"):
        (tmp_path / "x.npz").write_bytes(content)
        with pytest.raises(StressError, match="give a file that replay stress wrote"):
            read_scenes(tmp_path / "x.npz")


def some(detector="hybrid"):
    triangles = FAMILIES[14].pairs(3)
    return Cases(
        detector,
        15,
        100,
        3,
        np.arange(3),
        triangles,
        np.array([True, False, True]),
        np.array([0, 1, 6], dtype=np.uint8),
    )


def test_what_is_written_is_read_back_bit_for_bit_cases(tmp_path):
    cases = some()
    back = read_cases(write_cases(cases, tmp_path / "new" / "folder"))
    assert back.triangles.tobytes() == cases.triangles.tobytes()
    assert (back.detector, back.family, back.seed, back.count) == ("hybrid", 15, 100, 3)
    for name in ("row", "truth", "verdict"):
        assert np.array_equal(getattr(back, name), getattr(cases, name))


def test_the_family_and_seed_of_a_file_make_its_triangles_again(tmp_path):
    back = read_cases(write_cases(some(), tmp_path))
    again = FAMILIES[back.family - 1].pairs(back.count, back.seed)[back.row]
    assert again.tobytes() == back.triangles.tobytes()


def test_the_name_of_a_detector_of_somebody_else_makes_a_file_name(tmp_path):
    assert write_cases(some("lab.engine:Detector"), tmp_path).name == "family-15-lab-engine-detector-seed-100.npz"


def test_nothing_half_written_stays(tmp_path):
    write_cases(some(), tmp_path)
    assert [path.suffix for path in tmp_path.iterdir()] == [".npz"]


def test_a_folder_that_is_a_file_is_one_sentence(tmp_path):
    (tmp_path / "taken").write_text("")
    with pytest.raises(OutputError, match="give another folder with --out"):
        write_cases(some(), tmp_path / "taken")


@pytest.mark.parametrize("content", [b"", b"not a zip", b"PK\x03\x04 torn"])
def test_a_file_that_is_none_is_refused(tmp_path, content):
    (tmp_path / "x.npz").write_bytes(content)
    with pytest.raises(StressError, match="give a file that replay stress wrote"):
        read_cases(tmp_path / "x.npz")


def test_arrays_of_different_lengths_are_refused(tmp_path):
    with pytest.raises(StressError, match="different lengths"):
        read_cases(write_cases(replace(some(), truth=np.array([True])), tmp_path))


PAIRS = np.concatenate([family.pairs(12, seed=8) for family in FAMILIES])


def asked(name, pairs=PAIRS):
    return RELATIONS[name](pairs, np.random.default_rng(1))


@pytest.mark.parametrize("name", RELATIONS)
def test_the_integers_answer_both_questions_alike_and_most_questions_are_new(name):
    before, after = ([pair_intersects_integers(pair.tolist()) for pair in pairs] for pairs in (PAIRS, asked(name)))
    assert before == after
    changed = (asked(name) != PAIRS).any(axis=(1, 2, 3))
    assert changed.mean() > (0.1 if name == "shift" else 0.7)


def test_swapping_twice_and_reordering_keep_the_corners():
    assert np.array_equal(asked("swap", asked("swap")), PAIRS)
    assert np.array_equal(np.sort(asked("order"), axis=2), np.sort(PAIRS, axis=2))


def test_a_shift_that_would_round_is_not_made():
    lattice, rounded = FAMILIES[23].pairs(100), FAMILIES[1].pairs(100)
    assert (asked("shift", lattice) != lattice).any(axis=(1, 2, 3)).mean() > 0.9
    assert (asked("shift", rounded) != rounded).any(axis=(1, 2, 3)).mean() < 0.1


def test_names_choose_relations_in_the_order_given():
    assert list(relations_of("axes,swap")) == ["axes", "swap"]
    assert relations_of("all") == RELATIONS
    with pytest.raises(StressError, match="no relation 'wave'; there are: swap"):
        relations_of("swap,wave")


@pytest.mark.parametrize("detector", ["exact", "hybrid"])
@pytest.mark.parametrize("number", ATTEMPTS)
def test_nothing_goes_wrong_with_a_sound_detector(number, detector):
    found = {name: attempt(detector) for name, attempt in ATTEMPTS[number][1]()}
    assert set(found.values()) == {""}
    assert len(found) >= 5


@pytest.mark.parametrize("number", [34, 36])
def test_an_engine_that_takes_everything_is_seen(number, monkeypatch):
    monkeypatch.setattr(attempts, "_matrix", lambda values: attempts.at([[0, 0, 0]]))
    found = {name: attempt("exact") for name, attempt in ATTEMPTS[number][1]()}
    assert "taken as if it were sound" in found.values()


def test_an_answer_that_depends_on_blocks_is_seen(monkeypatch):
    monkeypatch.setattr(attempts, "join", lambda parts: parts[0])
    found = {name: attempt("exact") for name, attempt in ATTEMPTS[43][1]()}
    assert found["blocks of 1"] == "another digest" and found["1 threads"] == ""
