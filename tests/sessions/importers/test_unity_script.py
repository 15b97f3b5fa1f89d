"""The Unity script of the guide writes what the built-in mapping reads: its own format strings are used here."""

import re
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from sessions.importers import import_session

ROOT = Path(__file__).resolve().parents[3]

SCRIPT = "".join(re.findall(r"```csharp\n(.*?)```", (ROOT / "replay/guide/unity.md").read_text("utf-8"), flags=re.S))


def templates():
    """The header and the three kinds of lines as the script writes them."""
    (header,) = re.findall(r'WriteLine\("(kind,[^"]*)"\)', SCRIPT)
    lines = re.findall(r'Invariant\(\$"([^"]*)"\)', SCRIPT)
    return header, *(
        next(line for line in lines if line.startswith(start)) for start in ("pose,", "trigger,", "{kind},")
    )


def filled(template, values):
    """One line: ``F6`` is six decimals, ``R`` of a float the shortest text that reads back the same."""

    def cell(match):
        expression, _, form = match.group(1).partition(":")
        value = values[expression]
        return f"{value:.6f}" if form == "F6" else str(np.float32(value)) if form == "R" else str(value)

    return re.sub(r"\{([^{}]*)\}", cell, template)


def pose_values(time, name, position, quaternion, tracked=1):
    parts = {f"p.{axis}": value for axis, value in zip("xyz", position, strict=True)}
    parts |= {f"q.{axis}": value for axis, value in zip("xyzw", quaternion, strict=True)}
    return {"Time.timeAsDouble": time, "Cell(body.name)": name, "Tracked(body)": tracked, **parts}


def test_a_session_that_the_script_writes_is_imported_as_it_was(tmp_path):
    header, pose, trigger, contact = templates()
    rng = np.random.default_rng(8)
    count = 40
    turns, places = Rotation.random(count, random_state=8), rng.normal(size=(count, 3)) * [1, 1, 1e-5]
    lines = [header]
    for k in range(count):
        time = k / 90
        lines.append(filled(pose, pose_values(time, "LeftHand", places[k], turns[k].as_quat(), int(k != 3))))
        lines.append(filled(trigger, {"Time.timeAsDouble": time, "hand": "left", "value": k / count}))
        if k in (10, 20):
            kind = {10: "enter", 20: "exit"}[k]
            both = (("LeftHand", "Beaker"), ("Beaker", "LeftHand"))
            lines += [
                filled(contact, {"kind": kind, "Time.timeAsDouble": time, "Cell(body)": a, "Cell(other)": b})
                for a, b in both
            ]
    path = tmp_path / "session.csv"
    path.write_text("\r\n".join(lines) + "\r\n", encoding="utf-8")

    session = import_session("csv", path, proxies=False)
    assert session.names == ("LeftHand",)
    assert session.frames.stamp_ns.tolist() == [round(round(k / 90, 6) * 1e9) for k in range(count)]
    mirror = np.diag([1.0, 1.0, -1.0])
    assert np.allclose(session.frames.position[:, 0], places @ mirror, rtol=1e-7, atol=1e-12)
    got = Rotation.from_quat(session.frames.quaternion_xyzw[:, 0]).as_matrix()
    assert np.allclose(got, mirror @ turns.as_matrix() @ mirror, atol=1e-6)
    assert np.flatnonzero(~session.tracks["LeftHand"].valid).tolist() == [3]
    assert np.allclose(session.hands["student/left"].trigger, np.arange(count) / count)
    assert [(one.body_a, one.body_b, one.phase) for one in session.live_contacts] == [
        ("LeftHand", "Beaker", "enter"),
        ("LeftHand", "Beaker", "exit"),
    ]
    assert "left out" not in session.facts["conversions"]
