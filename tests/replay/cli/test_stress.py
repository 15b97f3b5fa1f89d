"""``replay stress`` prints each word of the audit, writes what failed, and exits with 4 for a broken promise."""

import numpy as np

from replay.cli.main import main
from replay.studies.stress import runner


def test_a_wrong_answer_of_exact_exits_with_4(capsys, monkeypatch):
    """`replay stress` has the exact detector judge five pairs of triangles that share a corner; it is made to miss all.

    A detector that claims exactness and is wrong breaks a gate, which is named with the family of the pairs.
    """
    monkeypatch.setattr(runner, "verdicts_of", lambda name, pairs: np.zeros(len(pairs), dtype=np.uint8))
    assert main(["stress", "--detector", "exact", "--family", "3", "--pairs", "5"]) == 4
    output = capsys.readouterr().err
    assert "gate: exact claims exactness" in output and "5 of 5" in output and "03 shared vertex" in output
