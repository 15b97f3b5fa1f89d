"""A damaged cache of machine code costs time and no answer: a few of the cases of `.ci/damaged_caches.py`."""

import random
import shutil

import pytest
from support.processes import script

damaged_caches = script("damaged_caches")


@pytest.mark.parametrize("damage", damaged_caches.DAMAGES, ids=lambda damage: damage.__name__)
def test_each_kind_of_damage_changes_the_cache(tmp_path, damage):
    """Index, code and seal of two functions, in a cache and in another machine's ("foreign"), of some 10 kB each.

    After the damage a file of the cache has other bytes or is gone.
    """
    for folder in ("cache", "foreign"):
        (tmp_path / folder / "bvh").mkdir(parents=True)
        for name in ("a.nbi", "a.1.nbc", "a.seal", "b.nbi", "b.1.nbc", "b.2.nbc", "b.seal"):
            (tmp_path / folder / "bvh" / name).write_bytes(f"{folder} {name}".encode() * 999)
    files = damaged_caches.cache_files(tmp_path / "cache")
    before = [file.read_bytes() for file in files]
    damage(files, tmp_path / "foreign", random.Random(0))
    assert [file.read_bytes() if file.exists() else None for file in files] != before


@pytest.mark.slow
def test_damaged_machine_code_gives_the_right_answer(monkeypatch, capsys):
    """The script damages the cache once in each way and finds the right answer every time: it ends with 0.

    The kernels of ``sphere`` compile in 2 s, those of ``exact`` in 13 s; both are cached and read by the same code.
    """
    monkeypatch.setattr(damaged_caches, "PROGRAM", damaged_caches.PROGRAM.replace('"exact"', '"sphere"'))
    count = len(damaged_caches.DAMAGES)
    monkeypatch.setattr("sys.argv", ["damaged_caches.py", "--count", str(count), "--seed", "7", "--jobs", "2"])
    assert damaged_caches.main() == 0, capsys.readouterr().out


@pytest.mark.parametrize(
    ("code", "answer"),
    [
        pytest.param(-11, "right", id="ends by a signal"),
        pytest.param(0, "wrong", id="wrong answer"),
        pytest.param(None, "", id="does not end"),
    ],
)
def test_a_wrong_answer_is_a_fault(monkeypatch, tmp_path, code, answer):
    """The expected answer is "right"; a program with a damaged cache crashes, prints "wrong", or does not end.

    The script says so of the first damage of its list, number 0, which flips one bit of a file.
    """
    (tmp_path / "whole").mkdir()
    (tmp_path / "whole" / "a.nbi").write_bytes(b"index" * 99)
    shutil.copytree(tmp_path / "whole", tmp_path / "foreign")
    monkeypatch.setattr(damaged_caches, "answer", lambda _: damaged_caches.Ended(code, answer, ""))
    assert damaged_caches.fault_of(number=0, seed=0, work=tmp_path, right="right") == (
        f"0 flip_one_bit: ended with {code}, printed {answer!r}; "
    )
