"""Checks the proof of a run, its tables and its seal from the files alone."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.errors import RunFolderError
from replay.outputs.results.parquet import read_table
from replay.outputs.results.run_folder import EPISODES, FRAMES, SUMMARY, RunFolder, read_run_folder
from replay.outputs.results.seal import PROOF, file_hash, read_seal
from replay.proof.claims import KINDS, Kind, Proof, WrongRecord
from replay.proof.loading import load
from replay.proof.verifier import verify
from sessions import read_session
from sessions.doctor.runs import runs
from sessions.errors import SessionError


def verify_run(folder: Path, given: Path | None = None, scene: Path | None = None) -> dict[str, Any]:
    """Check seal, recording, proof and tables of a run folder; what was proven, as plain data.

    ``given``: the recording, where it is not beside the run; ``scene``: that of the run, if not the recording's. Raises
    ``WrongRecord``: the first record that does not hold; ``RunFolderError``: there is no proof, recording or scene.
    """
    seal = read_seal(folder, (SUMMARY, PROOF, FRAMES, EPISODES))
    run = read_run_folder(folder)
    recording = run.recording(given, scene)
    if file_hash(recording) != seal["recording"]:
        raise WrongRecord(f"{recording.name} is not the recording that was replayed; its contents differ")
    proof = Proof.read(run.path / PROOF)
    try:
        session = read_session(recording, scene=scene)
        meshes, poses, whence = load(session, proof)
        told = verify(proof, meshes, poses)
    except SessionError as error:
        raise WrongRecord(f"{recording.name} cannot be read: {error}") from error
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        # A header may hold anything where a number or a word belongs.
        raise WrongRecord(f"{PROOF} is no proof ({error!r})") from error
    table = proof.verdicts(len(poses.valid))
    _check_tables(run, proof, table)
    bodies = proof.header["bodies"]
    asked = {frozenset(pair[:2]) for pair in proof.header["pairs"]}
    left = ["-".join(bodies[k] for k in pair) for pair in combinations(range(len(bodies)), 2) if {*pair} not in asked]
    return {
        "frames": len(table), "pairs": len(asked), "pairs_not_asked": left,
        "verdicts": {word: told[word] for word in KINDS.values()}, "poses": dict(whence),
        "checked": {word: told[word] for word in ("boxes", "face_pairs", "by_integers", "rays")},
        "containment_refused": [
            f"{'-'.join(bodies[k] for k in pair)}: {word}"
            for *pair, word in proof.header["pairs"] if word != "decided"
        ],
        "bytes": (run.path / PROOF).stat().st_size,
    }  # fmt: skip


def _check_tables(run: RunFolder, proof: Proof, table: NDArray[np.uint8]) -> None:
    """Hold summary, frames and episodes to the verdicts (T, P) that were proven."""
    label, bodies = proof.header["detector"], proof.header["bodies"]
    said = run.summary.get("detectors", {}).get(label, {})
    counts = {KINDS[kind]: int((table == kind).sum()) for kind in KINDS if (table == kind).any()}
    if run.summary.get("oracle") != label or said.get("verdicts") != counts:
        raise WrongRecord(f"{SUMMARY}: {label} is said to have other verdicts than were proven")
    pairs = [f"{bodies[i]}-{bodies[j]}" for i, j, _ in proof.header["pairs"]]
    if pairs != [one.get("name") for one in run.summary.get("pairs", [])] or len({*pairs}) != len(pairs):
        raise WrongRecord(f"{SUMMARY}: other pairs were proven")
    column = {frozenset((bodies[i], bodies[j])): k for k, (i, j, _) in enumerate(proof.header["pairs"])}
    contact = np.isin(table, (Kind.CONTACT, Kind.CONTAINED))
    try:
        rows = read_table(run.path / FRAMES).to_pydict()
        pair = _columns(rows, column)
        frame = np.array(rows["frame"], dtype=np.int64)
        words = np.array([KINDS.get(kind, "") for kind in range(max(KINDS) + 1)])
        bad = (frame < 0) | (frame >= len(table)) | (pair < 0)
        bad[~bad] = words[table[frame[~bad], pair[~bad]]] != np.array(rows[f"verdict/{label}"], dtype=np.str_)[~bad]
        if bad.any():
            raise WrongRecord(f"{FRAMES}, row {int(np.flatnonzero(bad)[0])}: another verdict of {label} was proven")
        contact_rows = np.zeros_like(contact)
        contact_rows[frame, pair] = True
        if (contact & ~contact_rows).any():
            t, p = (int(k[0]) for k in np.nonzero(contact & ~contact_rows))
            raise WrongRecord(f"{FRAMES}: frame {t} of pair {p} is in contact and has no row")
        rows = read_table(run.path / EPISODES).to_pydict()
        pair = _columns(rows, column)
        mine = [k for k, one in enumerate(rows["detector"]) if one == label]
        found = sorted((int(pair[k]), rows["first"][k], rows["last"][k]) for k in mine)
    except (RunFolderError, KeyError, ValueError, TypeError, IndexError) as error:
        raise WrongRecord(f"{FRAMES} or {EPISODES} cannot be read ({error})") from error
    proven = [(p, *row) for p in range(contact.shape[1]) for row in runs(contact[:, p]).tolist()]
    if found != proven:
        first, *_ = sorted(set(found) ^ set(proven)) or found
        raise WrongRecord(f"{EPISODES}: contact {first} (pair, first, last) is listed or proven, not both")


def _columns(rows: Mapping[str, list[Any]], column: Mapping[frozenset[str], int]) -> NDArray[np.int64]:
    """The pair of each row, -1 where there is none."""
    named = zip(rows["body_a"], rows["body_b"], strict=True)
    return np.array([column.get(frozenset(two), -1) for two in named], dtype=np.int64)
