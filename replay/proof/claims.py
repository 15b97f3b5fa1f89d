"""The proof and what it speaks of, as arrays; ``proof.npz``, its file, is laid out as the guide's page *Proof* says."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Rows = NDArray[Any]

SCHEMA: Final = "vrlab-replay/proof/1"
Kind = IntEnum("Kind", {"CLEAR": 0, "CONTACT": 1, "CONTAINED": 2, "NO_POSE": 7})
"""Kinds of claims; numbers as in the verdict tables."""
KINDS: Final = {kind.value: kind.name for kind in Kind}
COLUMNS: Final = ("pair", "first", "last", "kind", "front", "a", "b")
"""A claim: a pair in frames ``first`` to ``last``. CONTACT: faces ``a`` and ``b`` meet. CLEAR: ``front`` says why.
CONTAINED: ``front`` says why surfaces are apart; corner ``b`` of body ``a`` (0 first, 1 second) is inside."""
MOST_BYTES: Final = 1 << 31
"""A file that claims to hold more is not read."""
SHAPES: Final[dict[str, tuple[str, tuple[int, ...]]]] = {
    "claims": ("<i4", (-1, len(COLUMNS))), "fronts": ("|u1", (-1,)), "front_ends": ("<i8", (-1,)),
    "given_rows": ("<i4", (-1, 4)), "given_poses": ("<f8", (-1, 12)),
}  # fmt: skip
OF_BODY: Final[dict[str, tuple[str, tuple[int, ...]]]] = {
    "faces": ("<i4", (-1,)), "nodes": ("<i4", (-1, 3)), "axes": ("<f4", (-1, 6)),
}  # fmt: skip


class Mesh(NamedTuple):
    """Vertices (v, 3) and faces (f, 3) of a body."""

    vertices: Floats
    faces: Rows


class Poses(NamedTuple):
    """Of N bodies in T frames: ``valid`` (T, N), ``rotation`` (T, N, 3, 3), ``translation`` (T, N, 3)."""

    valid: Flags
    rotation: Floats
    translation: Floats

    def part(self, first: int, stop: int) -> Poses:
        """A copy of some frames."""
        rows = slice(first, stop)
        return Poses(self.valid[rows].copy(), self.rotation[rows].copy(), self.translation[rows].copy())


class WrongRecord(Exception):  # noqa: N818  (it is an answer, not a failure)
    """The first record that does not hold, and why."""


@dataclass(frozen=True, eq=False)
class Proof:
    """What is claimed of N bodies and P pairs in T frames.

    Parameters
    ----------
    header : ``schema``; ``detector``; ``bodies``, their names; ``meshes``, a SHA-256 each; ``scene``, its SHA-256;
        ``pairs``: two body numbers and the word on containment; ``frames``: the first and the one after the last, of
        those whose stamp increases; ``flags``: kind, body, first and last stamp (ns), rule of what a policy replaced.
    arrays : ``claims`` (c, 7), ``COLUMNS``; ``fronts``, letters, the k-th up to ``front_ends[k]``; ``given_rows``
        (g, 4): body, first frame, last frame, origin of ``given_poses`` (g, 12), rotation by rows, then translation;
        of body k ``faces/k`` (f,), face numbers in the order of its tree, ``nodes/k`` (n, 3): first place, faces, first
        child (its sibling follows) or -1, and ``axes/k`` (n, 6), the first two axes of its box.
    """

    header: Mapping[str, Any]
    arrays: Mapping[str, NDArray[Any]]

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.arrays[name]

    def verdicts(self, frames: int) -> NDArray[np.uint8]:
        """The verdict of every pair in every frame, (T, P); only of a proof that was verified."""
        table = np.zeros((frames, len(self.header["pairs"])), dtype=np.uint8)
        for pair, first, last, kind in self["claims"][:, :4].tolist():
            table[first : last + 1, pair] = kind
        return table

    def written(self) -> bytes:
        """The bytes of the file, the same for the same proof."""
        text = np.frombuffer(json.dumps(self.header, sort_keys=True).encode(), dtype=np.uint8)
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as packed:
            for name, array in {"header": text, **self.arrays}.items():
                part = io.BytesIO()
                np.lib.format.write_array(part, np.asfortranarray(array), version=(1, 0))
                packed.writestr(zipfile.ZipInfo(f"{name}.npy"), part.getvalue(), zipfile.ZIP_DEFLATED)
        return stream.getvalue()

    @classmethod
    def read(cls, data: bytes | Path) -> Proof:
        """The proof in a file or its bytes; ``WrongRecord``: it is none."""
        try:
            with zipfile.ZipFile(io.BytesIO(data) if isinstance(data, bytes) else data) as packed:
                if sum(one.file_size for one in packed.infolist()) > MOST_BYTES:
                    raise WrongRecord("the proof claims to be larger than 2 GiB")
                arrays = {
                    one.removesuffix(".npy"): np.lib.format.read_array(io.BytesIO(packed.read(one)), allow_pickle=False)
                    for one in packed.namelist()
                }
            header = json.loads(arrays.pop("header").tobytes())
            if header["schema"] != SCHEMA:
                raise WrongRecord(f"the proof has schema {header['schema']!r}, not {SCHEMA!r}")
            bodies = range(len(header["bodies"]))
            if not all(i in bodies and j in bodies and i != j for i, j, _ in header["pairs"]):
                raise WrongRecord("the proof names a pair of bodies that there is not")
            of_bodies = {f"{name}/{k}": row for k in bodies for name, row in OF_BODY.items()}
            for name, (kind, shape) in {**SHAPES, **of_bodies}.items():
                have = arrays[name]
                if have.dtype != np.dtype(kind) or have.ndim != len(shape) or have.shape[1:] != shape[1:]:
                    raise WrongRecord(f"table {name} holds {have.dtype} of shape {have.shape}")
        except WrongRecord:
            raise
        except Exception as error:
            # A hostile file may raise whatever zip, numpy and JSON raise: none of it is a proof.
            raise WrongRecord(f"the proof cannot be read ({error})") from error
        return cls(header, arrays)
