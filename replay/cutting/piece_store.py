"""Convex pieces of a mesh, cut once on a machine: by a process of its own, and kept in the user's cache folder."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from time import monotonic
from typing import Final

import numpy as np
from platformdirs import user_cache_path

from cdcore.bounding.hull import hull_collider, hull_of
from cdcore.mesh import TriangleMesh
from replay.cutting.convex_solids import within_triangles
from replay.cutting.joins import Ladder
from replay.cutting.methods import METHODS, Method, method_of
from replay.errors import CutError
from replay.words import duration, joined_names
from sessions.temporary_folders import temporary_folder
from sessions.whole_files import whole_file

LONGEST_SECONDS: Final = 600.0
"""That a method may take for one mesh where no other limit is given."""

POLL_SECONDS: Final = 0.05
"""How often a process that cuts is looked at."""

WATCH_SECONDS: Final = 0.5
"""How often somebody who waits for pieces is called."""

MOST_FACES: Final = 150_000
"""Of a mesh that is cut: beyond, every method takes minutes and gigabytes."""

SHIPPED_FOLDER: Final = Path(__file__).parent / "shipped"
"""Pieces of the instruments and hands that come with the project: a first demo does not wait for them."""

PIECES_ARE_KEPT: Final = "the pieces that are cut are kept: the same command goes on from them"
"""What somebody reads whose time was up, or who stopped the cutting; true where ``pieces_are_stored``."""

Watch = Callable[[], None]
"""Called while pieces are cut; raises to end that."""


@dataclass(frozen=True, eq=False)
class Cut:
    """A mesh to be cut into at most so many convex pieces by a method of the table, or by ``auto``."""

    mesh: TriangleMesh
    method: str
    most: int

    @cached_property
    def name(self) -> str:
        """The row of the table that cuts it; a flat mesh, which has no inside, is never cut."""
        if self.most == 1 and METHODS.get(self.method, METHODS["coacd"]).counts:
            return "hull"
        if hull_collider(self.mesh) is self.mesh:
            return "hull"
        return method_of(self.method, self.mesh)

    @property
    def row(self) -> Method:
        """The same, as the row."""
        return METHODS[self.name]

    @property
    def key(self) -> str:
        """The name under which its ladder is kept: what decides it, and nothing else."""
        piece_count = "all" if self.row.ladder else str(self.most)
        return f"{self.mesh.content_hash[:32]}-{self.name}-{piece_count}-{self.row.version()}"

    @property
    def is_ready(self) -> bool:
        """Whether its pieces are kept, in a file or in memory, or need no process of their own."""
        return self.row.seconds is None or self.key in in_memory or ladder_file(self).is_file()

    @property
    def seconds(self) -> float:
        """About how long it takes; 0 where it is ready."""
        return 0.0 if self.row.seconds is None or self.is_ready else self.row.seconds(self.mesh)


@dataclass(frozen=True)
class NotCut:
    """Why a cut is not ready, as the end of a sentence; ``late``: its time was up, else the method failed.

    ``spent``: seconds that a process cut before its time was up; 0: none was begun.
    """

    reason: str
    late: bool
    spent: float = field(default=0.0, compare=False)


def convex_pieces(
    cut: Cut, watch: Watch | None = None, time_limit: float = LONGEST_SECONDS
) -> tuple[TriangleMesh, ...]:
    """At most so many convex solids that together stand for a mesh, always the same ones; of one, the hull.

    Each has at most 255 triangles, as engines want it, so that corners of a mesh stick out by tenths of a millimetre. A
    flat mesh, which has no inside, is its own piece. ``watch`` is called twice a second; what it raises ends the
    cutting and is raised here. Raises ``CutError``: no pieces within ``time_limit`` seconds, or none at all.
    """
    hull = hull_collider(cut.mesh)
    if hull is cut.mesh:
        return (hull,)
    cut_all([cut], watch, time_limit)
    file = _pieces_file(cut)
    with suppress(Exception):  # whatever a damaged file raises, it is made again
        return _read_pieces(file)
    corners = _ladder(cut).pieces(cut.most)
    pieces = tuple(within_triangles(piece) for points in corners if (piece := hull_of(points)) is not None)
    if not pieces:
        raise CutError(f"{cut.row.words} gives no solid piece of this mesh; take another method")
    if cut.row.seconds:
        _write_pieces(file, pieces)
    return pieces


def cut_all(cuts: Sequence[Cut], watch: Watch | None = None, time_limit: float = LONGEST_SECONDS) -> None:
    """Cut what is not kept, as ``cut_ahead``. Raises ``CutError``: a cut is not ready."""
    not_cut_by_key = cut_ahead(cuts, watch, time_limit)
    for cut in cuts:
        if cut.key in not_cut_by_key:
            raise CutError(f"{not_cut_by_key[cut.key].reason}; take another method of cutting")


def cut_ahead(
    cuts: Sequence[Cut], watch: Watch | None = None, time_limit: float = LONGEST_SECONDS
) -> dict[str, NotCut]:
    """Cut what is not kept, in as many processes as the machine has cores; key of a cut -> why it is not ready.

    A process that is not done after ``time_limit`` seconds is killed, as all are where ``watch`` raises.
    """
    waiting_cuts = list({cut.key: cut for cut in cuts if cut.row.seconds and not _is_kept(cut)}.values())
    not_cut_by_key = {
        cut.key: NotCut(cut.row.not_installed, late=False) for cut in waiting_cuts if cut.row.not_installed
    }
    waiting_cuts = [cut for cut in waiting_cuts if cut.key not in not_cut_by_key]
    cut_of_process: dict[subprocess.Popen[bytes], Cut] = {}
    start_of_key: dict[str, float] = {}
    start_time = last_call = monotonic()
    if not waiting_cuts:
        return not_cut_by_key
    with temporary_folder() as folder, ExitStack() as exit_stack:
        exit_stack.callback(_kill_processes, cut_of_process)
        while waiting_cuts or cut_of_process:
            if monotonic() - start_time >= time_limit:
                not_cut_by_key |= _late_cuts([*cut_of_process.values(), *waiting_cuts], time_limit, start_of_key)
                break
            while waiting_cuts and len(cut_of_process) < (os.cpu_count() or 1):
                cut = waiting_cuts.pop(0)
                start_of_key[cut.key] = monotonic()
                cut_of_process[_start_cutting(cut, folder)] = cut
            with suppress(subprocess.TimeoutExpired):
                next(iter(cut_of_process)).wait(POLL_SECONDS)
            for process in [child for child in cut_of_process if child.poll() is not None]:
                cut = cut_of_process.pop(process)
                if process.returncode == 0:
                    _store_cut(cut, folder)
                else:
                    not_cut_by_key[cut.key] = NotCut(f"{cut.row.words} cannot cut this mesh", late=False)
            if watch is not None and monotonic() - last_call >= WATCH_SECONDS:
                last_call = monotonic()
                watch()
    return not_cut_by_key


def seconds_of_cuts(cuts: Sequence[Cut]) -> float:
    """About how long cutting what is not kept takes, in as many processes as the machine has cores."""
    seconds_of_key = {cut.key: cut.seconds for cut in cuts}
    return max(sum(seconds_of_key.values()) / (os.cpu_count() or 1), *seconds_of_key.values(), 0.0)


def not_tried_sentences(cuts: Sequence[tuple[str, Cut]]) -> list[str]:
    """Say which cuts there was no time for, and how long they take; ``cuts``: name of a body, and its cut.

    Bodies that a method would cut into as many pieces are in one sentence.
    """
    cuts_of_method: dict[tuple[str, int], list[tuple[str, Cut]]] = {}
    for name, cut in cuts:
        cuts_of_method.setdefault((cut.row.words, cut.most), []).append((name, cut))
    sentences = []
    for (method, most), cuts_of_bodies in cuts_of_method.items():
        names = joined_names([name for name, _ in cuts_of_bodies])
        seconds = seconds_of_cuts([cut for _, cut in cuts_of_bodies])
        sentences.append(f"{method} of {names} ({most} pieces) was not tried: it takes about {duration(seconds)}.")
    return sentences


def _late_cuts(cuts: Sequence[Cut], time_limit: float, start_of_key: Mapping[str, float]) -> dict[str, NotCut]:
    """Key of a cut -> that it is late; ``start_of_key``: when a process began to cut it."""
    now = monotonic()
    return {
        cut.key: NotCut(
            reason=f"{cut.row.words} did not cut this mesh within {duration(time_limit)}",
            late=True,
            spent=now - start_of_key.get(cut.key, now),
        )
        for cut in cuts
    }


def why_not_cut(mesh: TriangleMesh) -> str:
    """Why a mesh keeps its hull, as the end of a sentence; ``""``: it can be cut."""
    if hull_collider(mesh) is mesh:
        return "it is flat and has no inside"
    if not mesh.is_closed:
        return "its surface has holes, so nobody knows its inside (replay mesh mends it)"
    if len(mesh.faces) > MOST_FACES:
        return f"it has {len(mesh.faces):,} faces, and at most {MOST_FACES:,} are cut in a reasonable time"
    return ""


def cache_folder() -> Path:
    """Cache folder of this user."""
    return user_cache_path("vrlab-replay", appauthor=False, opinion=False)


def ladder_file(cut: Cut) -> Path:
    """File of the pieces of a cut before the limits of engines are applied."""
    return _cached_file(f"cut-{cut.key}.npz")


def _pieces_file(cut: Cut) -> Path:
    return _cached_file(f"pieces-{cut.most}-{cut.key}.npz")


def _cached_file(file_name: str) -> Path:
    """The file of a name among those that come with the project, else in the user's cache folder."""
    shipped_file = SHIPPED_FOLDER / file_name
    return shipped_file if shipped_file.is_file() else cache_folder() / file_name


def _ladder(cut: Cut) -> Ladder:
    """The pieces of a cut that is kept, or that needs no process of its own."""
    if cut.row.seconds:
        return in_memory.get(cut.key) or _read_ladder(ladder_file(cut))
    ladder = cut.row.cut(cut.mesh, cut.most)
    assert ladder is not None  # every solid has a hull, a box, a sphere and a capsule
    return ladder


in_memory: dict[str, Ladder] = {}
"""Pieces that could not be kept: their file cannot be written."""


def pieces_are_stored() -> bool:
    """Whether the cache folder has pieces, and all that this process cut: none are in memory alone."""
    if in_memory:
        return False
    with suppress(OSError):
        return any(cache_folder().glob("cut-*.npz"))
    return False


def _is_kept(cut: Cut) -> bool:
    """Whether the pieces are kept, in a file that is whole."""
    file = ladder_file(cut)
    if cut.key in in_memory:
        return True
    try:
        _read_ladder(file)
    except FileNotFoundError:
        return False
    except Exception:  # whatever a damaged file raises, it is made again
        return False
    return True


def _store_cut(cut: Cut, folder: Path) -> None:
    """Take what a process left into the cache folder: whole or not at all, another process may be reading."""
    unfinished_file, file = folder / f"{cut.key}.out.npz", ladder_file(cut)
    try:
        if file.parent == SHIPPED_FOLDER:  # damaged, and not ours to replace
            raise PermissionError
        with whole_file(file, OSError, parents=True) as stream:
            stream.write(unfinished_file.read_bytes())
    except OSError:
        in_memory[cut.key] = _read_ladder(unfinished_file)


def _read_ladder(file: Path) -> Ladder:
    with np.load(file) as archive:
        return Ladder(archive["corners"], archive["ends"], archive["joins"])


def _read_pieces(file: Path) -> tuple[TriangleMesh, ...]:
    with np.load(file) as archive:
        corners, faces = (np.split(archive[name], archive[f"{name}_ends"][:-1]) for name in ("corners", "faces"))
    return tuple(TriangleMesh(*piece) for piece in zip(corners, faces, strict=True))


def _write_pieces(file: Path, pieces: Sequence[TriangleMesh]) -> None:
    with suppress(OSError), whole_file(file, OSError, parents=True) as stream:
        np.savez(
            stream,
            corners=np.concatenate([piece.vertices for piece in pieces]),
            corners_ends=np.cumsum([len(piece.vertices) for piece in pieces]),
            faces=np.concatenate([piece.faces for piece in pieces]),
            faces_ends=np.cumsum([len(piece.faces) for piece in pieces]),
        )


def _start_cutting(cut: Cut, folder: Path) -> subprocess.Popen[bytes]:
    """A process that cuts a mesh from a file and leaves its pieces in another one: libraries cannot be interrupted."""
    shipped_file = folder / f"{cut.key}.npz"
    np.savez(shipped_file, vertices=cut.mesh.vertices, faces=cut.mesh.faces)
    arguments = [
        sys.executable,
        "-P",
        "-c",
        CUTTING_PROGRAM,
        str(shipped_file),
        cut.name,
        str(cut.most),
        str(folder / f"{cut.key}.out.npz"),
    ]
    # CoACD of several threads gives other pieces in every call, its seed notwithstanding.
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    no_output = subprocess.DEVNULL
    return subprocess.Popen(arguments, stdin=no_output, stdout=no_output, stderr=no_output, env=environment)


def _kill_processes(cut_of_process: dict[subprocess.Popen[bytes], Cut]) -> None:
    """Kill the processes that still cut."""
    for process in cut_of_process:
        process.kill()
    for process in cut_of_process:
        process.wait()


CUTTING_PROGRAM: Final = """
import sys
import numpy as np
from cdcore.mesh import TriangleMesh
from replay.cutting.methods import METHODS
with np.load(sys.argv[1]) as mesh:
    ladder = METHODS[sys.argv[2]].cut(TriangleMesh(mesh["vertices"], mesh["faces"]), int(sys.argv[3]))
if ladder is None:
    sys.exit(1)
np.savez(sys.argv[4], corners=ladder.corners, ends=ladder.ends, joins=ladder.joins)
"""
"""What a process that cuts runs."""
