import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.small_worlds import cubes

from replay.cli.main import main
from replay.cli.verify import sentences
from replay.outputs.results.seal import write_seal
from replay.proof.claims import Proof
from sessions import write_session

PLACES = {"a": [0.0] * 40, "b": np.linspace(3.0, 0.2, 40), "c": [9.0] * 40}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("proven")
    write_session(cubes(PLACES), folder / "s.mcap")
    out = str(folder / "run")
    assert main(["run", str(folder / "s.mcap"), "-o", out, "--detector", "sphere", "--proof", "-q"]) == 0
    return folder / "run"


@pytest.fixture
def copy(run, tmp_path):
    """The run and its recording in another place."""
    (tmp_path / "run").mkdir()
    for file in run.iterdir():
        (tmp_path / "run" / file.name).write_bytes(file.read_bytes())
    (tmp_path / "s.mcap").write_bytes((run.parent / "s.mcap").read_bytes())
    return tmp_path / "run"


def verified(folder, capsys, *more):
    code = main(["verify", str(folder), "--json", "-q", *more])
    return code, json.loads(capsys.readouterr().out)


def rejected(folder, capsys, words=""):
    code, said = verified(folder, capsys)
    assert (code, said["holds"]) == (4, False)
    assert words in said["wrong"]


def test_a_run_with_a_proof_holds_and_says_what_was_checked(run, capsys):
    code, said = verified(run, capsys)
    assert (code, said["holds"], said["frames"], said["pairs"]) == (0, True, 40, 2)
    assert said["verdicts"]["CONTACT"] > 0 and sum(said["verdicts"].values()) == 80
    assert said["poses"] == {"recorded": 120} and said["pairs_not_asked"] == ["a-c"]
    assert main(["verify", str(run)]) == 0
    text = capsys.readouterr().out
    assert text.splitlines()[0] == "holds: 40 frames of 2 pairs, every verdict proven"
    assert f"{said['verdicts']['CONTACT']} CONTACT" in text and "not asked: a-c" in text


def test_any_changed_byte_of_any_file_is_rejected(copy, capsys):
    rng = np.random.default_rng(5)
    for file in sorted([*copy.iterdir(), copy.parent / "s.mcap"]):
        whole = file.read_bytes()
        for place in {0, len(whole) - 1, *rng.integers(len(whole), size=3).tolist()}:
            file.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
            assert main(["verify", str(copy), "-q"]) == 4, (file.name, place)
        file.write_bytes(whole)
    assert main(["verify", str(copy), "-q"]) == 0


def test_tables_that_say_something_else_are_rejected_though_sealed_anew(copy, capsys):
    def rewritten(name, change):
        before = (copy / name).read_bytes()
        table = pq.read_table(copy / name).to_pylist()
        change(table)
        pq.write_table(pa.Table.from_pylist(table), copy / name)
        write_seal(copy, copy.parent / "s.mcap")
        rejected(copy, capsys, name)
        (copy / name).write_bytes(before)

    rewritten("frames.parquet", lambda rows: rows[-1].update({"verdict/exact": "CLEAR"}))
    rewritten("frames.parquet", lambda rows: rows.pop())
    rewritten("episodes.parquet", lambda rows: [row.update(last=row["last"] - 1) for row in rows])
    right = (copy / "summary.json").read_text()
    for wrong in ("other verdicts", "other pairs"):
        summary = json.loads(right)
        changed = summary["pairs"][0] if wrong == "other pairs" else summary["detectors"]["exact"]["verdicts"]
        changed |= {"name": "b-a", "CONTACT": 1}
        (copy / "summary.json").write_text(json.dumps(summary))
        write_seal(copy, copy.parent / "s.mcap")
        rejected(copy, capsys, wrong)


def test_another_recording_is_rejected_though_sealed_anew(copy, capsys):
    write_session(cubes(PLACES | {"b": np.linspace(3.0, 1.2, 40)}), copy.parent / "t.mcap")
    (copy.parent / "t.mcap").replace(copy.parent / "s.mcap")
    rejected(copy, capsys, "not the recording that was replayed")
    write_seal(copy, copy.parent / "s.mcap")
    rejected(copy, capsys, "pair a-b")


def test_a_proof_may_give_no_pose_that_the_recording_holds(copy, capsys):
    proof = Proof.read(copy / "proof.npz")
    pose = np.array([[1.0, 0, 0, 0, 1, 0, 0, 0, 1, 5, 0, 0]])
    row = np.array([[1, 2, 3, 3]], dtype="<i4")
    forged = Proof(proof.header, {**proof.arrays, "given_rows": row, "given_poses": pose})
    (copy / "proof.npz").write_bytes(forged.written())
    write_seal(copy, copy.parent / "s.mcap")
    rejected(copy, capsys, "body b, frames 2 to 3: the recording holds another pose")


def test_a_header_that_holds_anything_is_rejected(copy, capsys):
    proof = Proof.read(copy / "proof.npz")
    forged = {"pairs": [[0, 1, 7]] * 2, "frames": "ab", "bodies": [1, 2, 3], "meshes": None, "flags": [1]}
    for key, value in forged.items():
        (copy / "proof.npz").write_bytes(Proof({**proof.header, key: value}, proof.arrays).written())
        write_seal(copy, copy.parent / "s.mcap")
        rejected(copy, capsys)


def test_every_sentence_says_what_was_counted():
    told = {
        "frames": 1200, "pairs": 3, "pairs_not_asked": [], "verdicts": {"CLEAR": 3000, "CONTACT": 600, "CONTAINED": 0},
        "checked": {"boxes": 5000, "face_pairs": 70, "by_integers": 2, "rays": 1}, "bytes": 1234,
        "poses": {"recorded": 10, "interpolated": 4, "held": 3, "left_out": 2},
        "containment_refused": ["a-b: refused: a is open"],
    }  # fmt: skip
    assert sentences(told) == [
        "holds: 1,200 frames of 3 pairs, every verdict proven", " 3,000 CLEAR, 600 CONTACT",
        " checked: 5,000 boxes apart, 70 face pairs of which integers decided 2, 1 rays",
        " poses: 10 from the recording; from the proof 4 interpolated, 3 held; left out by the policy: 2",
        " the proof has 1,234 bytes", " containment of a-b: refused: a is open",
    ]  # fmt: skip
    assert sentences({**told, "pairs_not_asked": ["a-c", "b-c"]})[5] == " pairs not asked: a-c, b-c"


def test_without_a_proof_a_sentence_says_how_to_make_one(copy, capsys):
    (copy / "proof.json").unlink()
    assert main(["verify", str(copy), "-q"]) == 1
    assert "make one with `replay run --proof`" in capsys.readouterr().err


def test_a_run_with_another_scene_is_verified_with_that_scene_and_not_without(tmp_path, capsys):
    write_session(cubes(PLACES), tmp_path / "s.mcap")
    (tmp_path / "small.toml").write_text('[[body]]\nid = "b"\nshape = "box"\nsize = [0.5, 0.5, 0.5]\n')
    scene, out = ["--scene", str(tmp_path / "small.toml")], str(tmp_path / "run")
    assert main(["run", str(tmp_path / "s.mcap"), "-o", out, "--detector", "sphere", "--proof", "-q", *scene]) == 0
    capsys.readouterr()
    code, said = verified(out, capsys, *scene)
    assert (code, said["holds"]) == (0, True)
    assert main(["verify", out]) == 1
    assert "replayed with the scene of small.toml; give it with --scene FILE" in capsys.readouterr().err
    (tmp_path / "small.toml").write_text('[[body]]\nid = "b"\nshape = "box"\nsize = [0.6, 0.5, 0.5]\n')
    assert verified(out, capsys, *scene)[0] == 4
