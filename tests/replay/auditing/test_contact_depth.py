from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import cube, cubes

from replay import run
from replay.cli.main import main
from replay.document.gates import Gates
from sessions import MeshData, write_session

PATH = {"a": [0] * 9, "b": [3, 0.9, 0.8, 0.7, 0.9, 3, 3, 0.95, 3]}
"""Unit cubes: they are 0.3 in each other at the worst frame of the first contact, and 0.05 in the second."""


@pytest.fixture(scope="module")
def audited():
    return run(cubes(PATH), detectors="slow=discrete[rate_hz=20],exact", oracle="exact")


def test_contacts_have_depth_and_volume_of_their_worst_frame(audited):
    rows = audited.tables["episodes"].where(detector="exact").plain()
    assert [row["depth"] for row in rows] == pytest.approx([0.3, 0.05])
    assert [row["common_volume"] for row in rows] == pytest.approx([0.3, 0.05])
    assert [row["deepest"] for row in rows] == [3, 7]
    assert {row["depth_unknown"] for row in rows} == {""}


def test_misses_have_the_depth_of_their_own_frames(audited):
    for miss in audited.misses["slow"]:
        overlaps = [1 - PATH["b"][frame] for frame in range(miss.first, miss.last + 1)]
        assert miss.depth == pytest.approx(max(overlaps))
    deepest = max(miss.depth for miss in audited.misses["slow"])
    assert audited.document.audit["slow"].missed_depth.deepest == deepest


def test_gate_refuses_misses_that_are_deeper(audited):
    audit = audited.document.audit
    deepest = audit["slow"].missed_depth.deepest
    assert Gates(max_missed_depth=deepest * 1.001).broken(audit, []) == []
    (sentence,) = Gates(max_missed_depth=deepest * 0.999).broken(audit, [])
    assert sentence.startswith(f"slow missed contact that is {1e3 * deepest:g} mm deep, more than --max-missed-depth")


def test_open_bodies_make_the_gate_fail_with_the_reason():
    session, whole = cubes(PATH), cube()
    session = replace(session, meshes=session.meshes | {"b": MeshData(whole.vertices, whole.faces[:-2])})
    result = run(session, detectors="slow=discrete[rate_hz=20],exact", oracle="exact")
    misses = result.misses["slow"]
    assert misses and all(np.isnan(miss.depth) and miss.not_measured == "b is open" for miss in misses)
    assert all(miss.metres > 0 for miss in misses)
    (sentence,) = Gates(max_missed_depth=1.0).broken(result.document.audit, [])
    assert "how deep misses of slow are is unknown: b is open" in sentence


@pytest.mark.parametrize(("limit", "code"), [("1mm", 4), ("0.4 m", 0), ("40cm", 0), ("3", 2), ("-1mm", 2)])
def test_gate_on_the_command_line_takes_a_length(limit, code, tmp_path, capsys):
    write_session(cubes(PATH), tmp_path / "s.mcap")
    command = ["run", str(tmp_path / "s.mcap"), "-o", str(tmp_path / "out"), "--no-picture", "--fix-time", "0"]
    assert main([*command, "--detectors", "slow=discrete[rate_hz=20]", f"--max-missed-depth={limit}"]) == code
    capsys.readouterr()
