"""Plain code that knows the answer: trees, rays, samples, matrices, poses, PHREEQC, frames by messages.

    python tests/support/second_opinions.py tests/replay/effects/chemistry/mixtures.toml

prints PHREEQC's answers to every mixture that minteq.v4 can answer, to be compared with those in the file. In the
paper's equations (1) to (14) points are rows and matrices act from the right: ``[x' y' z' 1] = [x y z 1] C``, so the
product ``A @ B`` acts with A first, and a body goes to the world by scale, then rotation, then translation. Poses in
this project are column matrices: the transpose. Angles are radians.
"""

import re
import sys
import tomllib
from collections import Counter
from contextlib import suppress
from functools import cache
from itertools import product
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from mcap.reader import NonSeekingReader
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation
from support.random_worlds import placed

from cdcore import triangles_intersect
from cdcore.kernels.compiling import kernel
from cdcore.kernels.memory import doubles_of
from cdcore.numerics import FloatArray, readonly
from cdcore.triangles import filter as triangle_filter
from cdcore.triangles.decide import answer_pairs, checked_triangles
from cdcore.triangles.filter import UNDECIDED
from cdcore.triangles.sums import new_digits
from sessions.mcap.schemas import TF, TRACKING, message_class
from sessions.model.session import Frames, Status
from sessions.synthetic.truth import inside

SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])


class Enough(Exception):  # noqa: N818 - not an error
    """The budget is spent, or the first hit was all that was wanted."""


class SlowSearch:
    """Goes down two trees of a kind by its rule, counts the tests, and keeps the faces that meet.

    Boxes are told apart by their corners in the world: along its axes (``aabb``), or along their own, without
    (``solid-style``) or with the products of their edges.
    """

    def __init__(self, kind, trees, poses, *, every=True, budget=None):
        self.kind, self.trees, self.poses = kind, trees, poses
        self.world = [placed(tree.corners, *pose) for tree, pose in zip(trees, poses, strict=True)]
        self.every, self.budget = every, budget
        self.node_tests = self.leaf_tests = 0
        self.truncated = False
        self.result = []
        with suppress(Enough):
            self.descend(0, 0)

    def spend(self):
        if self.node_tests + self.leaf_tests == self.budget:
            self.truncated = True
            raise Enough

    def descend(self, *nodes):
        self.spend()
        self.node_tests += 1
        if self.separated(nodes):
            return
        children = [self.children(tree, node) for tree, node in zip(self.trees, nodes, strict=True)]
        if not any(children):
            faces = [range(tree.start[node], tree.stop[node]) for tree, node in zip(self.trees, nodes, strict=True)]
            for i, j in product(*faces):
                self.ask_faces(i, j)
            return
        both = [some or [node] for some, node in zip(children, nodes, strict=True)]
        if self.kind == "obb":  # which splits both
            both = [some[::-1] for some in both]
        elif all(children):
            kept = 1 if self.splits_first(nodes) else 0
            both[kept] = [nodes[kept]]
        for pair in product(*both):
            self.descend(*pair)

    def children(self, tree, node):
        first = tree.child[node]
        return [] if first < 0 else [first, first + 1]

    def ask_faces(self, i, j):
        self.spend()
        self.leaf_tests += 1
        if triangles_intersect([[self.world[0][i], self.world[1][j]]])[0]:
            self.result.append((int(self.trees[0].number[i]), int(self.trees[1].number[j])))
            if not self.every:
                raise Enough

    def corners(self, nodes):
        """World corners (8, 3) of both boxes, whose axes are rows."""
        for tree, node, (orientation, move) in zip(self.trees, nodes, self.poses, strict=True):
            yield (tree.centre[node] + (SIGNS * tree.half[node]) @ tree.axes[node]) @ orientation.T + move

    def separated(self, nodes):
        axes = np.eye(3)
        if self.kind != "aabb":
            own = [
                tree.axes[node] @ orientation.T
                for tree, node, (orientation, _) in zip(self.trees, nodes, self.poses, strict=True)
            ]
            axes = np.concatenate(own)
            if self.kind != "solid-style":
                axes = np.concatenate([axes, *(np.cross(u, own[1]) for u in own[0])])
            axes = axes[np.linalg.norm(axes, axis=1) > 1e-9]
        a, b = (corners @ axes.T for corners in self.corners(nodes))
        return bool(((a.min(axis=0) > b.max(axis=0)) | (b.min(axis=0) > a.max(axis=0))).any())

    def splits_first(self, nodes):
        first, second = (tree.half[node].max() for tree, node in zip(self.trees, nodes, strict=True))
        if self.kind == "aabb":
            first, second = (np.ptp(corners, axis=0).max() for corners in self.corners(nodes))
        return first > second or (first == second and self.kind != "rapid-style")


def faces_below(tree, node):
    """Faces, by their number in the mesh, in the leaves below a node of a ``BoxTree``."""
    todo, result = [node], []
    while todo:
        node = todo.pop()
        child = int(tree.child[node])
        if child < 0:
            result.append(tree.faces[tree.start[node] : tree.stop[node]])
        else:
            todo += [child, child + 1]
    return np.sort(np.concatenate(result)).astype(np.int64)


AT_ONCE = 100_000
"""Rays times triangles that are in memory together."""


def distances_along_rays(triangles, origins, directions, merge=1e-7):
    """Return, for each ray, the sorted distances at which it meets a triangle; hits within ``merge`` count once."""
    origins, directions = np.asarray(origins, dtype=float), np.asarray(directions, dtype=float)
    step = max(1, AT_ONCE // max(1, len(triangles)))
    result = []
    for k in range(0, len(origins), step):
        for row in np.sort(_distances(triangles, origins[k : k + step], directions[k : k + step]), axis=1):
            ahead = row[np.isfinite(row)]
            result.append(ahead[np.diff(ahead, prepend=-1.0) > merge])
    return result


def _distances(triangles, origins, directions):
    """Return (rays, triangles) distances, infinity where a ray meets no triangle."""
    a = triangles[:, 0]
    edge1, edge2 = triangles[:, 1] - a, triangles[:, 2] - a
    across = np.cross(directions[:, None], edge2)
    determinant = np.einsum("tj,rtj->rt", edge1, across)
    with np.errstate(divide="ignore", invalid="ignore"):
        from_a = origins[:, None] - a
        u = np.einsum("rtj,rtj->rt", from_a, across) / determinant
        perpendicular = np.cross(from_a, edge1)
        v = np.einsum("rtj,rj->rt", perpendicular, directions) / determinant
        t = np.einsum("tj,rtj->rt", edge2, perpendicular) / determinant
        hit = (u >= -1e-12) & (v >= -1e-12) & (u + v <= 1 + 1e-12) & (t > 0) & (determinant != 0)
    return np.where(hit, t, np.inf)


def points_on_faces(mesh, count, seed):
    """Return points (n, 3) spread over the faces by area, each with the outward unit normal of its face."""
    rng = np.random.default_rng(seed)
    triangles = mesh.triangles
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    chosen = rng.choice(len(areas), count, p=areas / areas.sum())
    weights = rng.dirichlet([2.0, 2.0, 2.0], count)  # away from the edges, where two faces would be hit
    return np.einsum("nk,nki->ni", weights, triangles[chosen]), normals[chosen] / areas[chosen, None]


TICK_SLACK_NS = 1
"""A stamp is rounded to a nanosecond, so a tick that falls on a stamp may come out one below or above it."""


def sampled_frames(stamps_ns, rate_hz, offset_s=0.0):
    """Indices of the frames at which a detector of this rate looks: the first frame at or after each tick.

    Ticks are ``offset_s`` + k / rate after the first stamp. A frame serves at most once, so after a gap ticks are
    skipped, as in a live engine that is late.
    """
    stamps = np.asarray(stamps_ns, dtype=np.int64)
    count = int((stamps[-1] - stamps[0]) * 1e-9 * rate_hz) + 2
    ticks = stamps[0] + np.floor(1e9 * offset_s + np.arange(count) * (1e9 / rate_hz)).astype(np.int64)
    frames = np.searchsorted(stamps, ticks - TICK_SLACK_NS)
    return np.unique(frames[frames < len(stamps)])


def predicted(truth, stamps_ns, rate_hz, offset_s=0.0):
    """The outcome of each contact for a detector that samples at ``rate_hz``, from the closed form alone.

    ``caught``: at least one look falls surely into the episode. ``missed``: no look falls possibly into it, but at
    least one recorded frame surely does. ``unseen``: no recorded frame falls possibly into it, so that no detector of
    instants can see it at any rate. ``undecided``: tessellation or noise decides.
    """
    frames = truth.seconds_of(stamps_ns)
    sampled = frames[sampled_frames(stamps_ns, rate_hz, offset_s)]
    groups = SimpleNamespace(caught=[], missed=[], unseen=[], undecided=[])
    for episode in truth.episodes:
        if episode.kind == "contact" and episode.nominal is not None:
            getattr(groups, fate(episode, frames, sampled)).append(episode)
    return groups


def fate(episode, frames, sampled):
    """Whether an episode is caught, missed, unseen or undecided by a detector that samples some of all frames."""
    surely = episode.surely or (np.inf, np.inf)
    if inside(sampled, surely).any():
        return "caught"
    if not inside(frames, episode.possibly).any():
        return "unseen"
    return "missed" if inside(frames, surely).any() and not inside(sampled, episode.possibly).any() else "undecided"


ROS = np.array([[0.0, -1, 0], [0, 0, 1], [-1, 0, 0]])
"""REP 103 to right-handed, +Y up, -Z forward."""
UNITY = np.diag([1.0, 1.0, -1.0])
"""Left-handed, +Y up, +Z forward to the same."""


def has_poses(track, expected_positions, rotations, axes=None, stamps=None, tolerance=1e-9):
    """Whether all its samples are valid, at these stamps, with positions (n, 3) and rotations in ``axes``."""
    axes = np.eye(3) if axes is None else axes
    result = Rotation.from_quat(track.quaternions_xyzw).as_matrix()
    return (
        track.valid.all()
        and np.allclose(track.positions, np.asarray(expected_positions) @ axes.T, rtol=0, atol=tolerance)
        and np.allclose(result, axes @ rotations.as_matrix() @ axes.T, rtol=0, atol=tolerance)
        and (stamps is None or track.times_ns.tolist() == np.asarray(stamps).tolist())
    )


def row_translation(amount: ArrayLike) -> FloatArray:
    """C_1: moves by ``amount`` (3,), which stands in the last row. Source: equations (1), (2)."""
    matrix = np.eye(4)
    matrix[3, :3] = amount
    return matrix


def row_scale(scale: ArrayLike, centre: ArrayLike = 0.0) -> FloatArray:
    """C_2 = diag(u, v, w, 1): scales by ``scale`` (3,) about ``centre`` (3,). Source: equation (4).

    Differs: the paper speaks of a scale about the centre P of a body, but its matrix scales about the origin.
    """
    middle, matrix = np.asarray(centre, dtype=np.float64), np.eye(4)
    matrix[[0, 1, 2], [0, 1, 2]] = scale
    return row_translation(-middle) @ matrix @ row_translation(middle)


def row_rotation(axis: int, angle: float) -> FloatArray:
    """C_3, C_4 or C_5: turns about x (``axis`` 0), y (1) or z (2). Source: equations (6)-(9), (11), (13)."""
    matrix, i, j = np.eye(4), (axis + 1) % 3, (axis + 2) % 3
    matrix[i, i] = matrix[j, j] = np.cos(angle)
    matrix[i, j], matrix[j, i] = np.sin(angle), -np.sin(angle)
    return matrix


def apply_row(points: ArrayLike, matrix: FloatArray) -> FloatArray:
    """``[x y z 1] C`` for points (..., 3). Source: equations (3), (5), (10), (12), (14)."""
    return np.asarray(points, dtype=np.float64) @ matrix[:3, :3] + matrix[3, :3]


def read_frames_plainly(path, names=()):
    """All frames of a file in file order; columns in the order given, then in that of first appearance."""
    recorded = list(recorded_frames(path))
    columns = {name: column for column, name in enumerate(names)}
    for _, message, _ in recorded:
        for pose in message.transforms:
            columns.setdefault(pose.child_frame_id, len(columns))
    shape = (len(recorded), len(columns))
    stamps = np.array([stamp for stamp, *_ in recorded], dtype=np.int64).reshape(-1, 2)
    sample, status = np.zeros(shape, dtype=np.int64), np.zeros(shape, dtype=np.uint8)
    position, quaternion = np.full((*shape, 3), np.nan), np.full((*shape, 4), np.nan)
    for row, ((published, _), message, note) in enumerate(recorded):
        for pose in message.transforms:
            cell = row, columns[pose.child_frame_id]
            stamp, p, q = pose.timestamp, pose.translation, pose.rotation
            sample[cell] = stamp.seconds * 10**9 + stamp.nanos if pose.HasField("timestamp") else published
            position[cell], quaternion[cell], status[cell] = (p.x, p.y, p.z), (q.x, q.y, q.z, q.w), Status.VALID
        for body in note.bodies:
            status[row, columns[body.name]] = body.status
    return Frames(tuple(columns), *stamps.T, sample, position, quaternion, status)


def recorded_frames(path):
    """Stamps of each frame, its poses, and the validity note that stands before it, if the two have the same stamps."""
    tracking = message_class("Tracking")
    nothing = pending = (None, tracking())
    with path.open("rb") as stream:
        for _, channel, message in NonSeekingReader(stream).iter_messages(log_time_order=False):
            identity = (message.sequence, message.publish_time, message.log_time)
            if channel.topic == TRACKING:
                pending = (identity, tracking.FromString(message.data))
                if pending[1].frame_without_samples:
                    yield identity[1:], FrameTransforms(), nothing[1]
                    pending = nothing
            elif channel.topic == TF:
                yield (
                    identity[1:],
                    FrameTransforms.FromString(message.data),
                    (pending if pending[0] == identity else nothing)[1],
                )
                pending = nothing


@kernel
def filtered(pair):
    """0, 1 or UNDECIDED for one pair (6, 3)."""
    return triangle_filter.pair_meets_filtered(doubles_of(pair))


def left_open(triangles):
    """How many pairs the float filter leaves open, and how many of them exact sums leave to integers."""
    pairs = checked_triangles(triangles)
    answers = np.empty(len(pairs), dtype=np.uint8)
    answer_pairs(readonly(pairs[:]), answers, False, new_digits())
    undecided = [filtered(pair.reshape(6, 3)) == UNDECIDED for pair in pairs]
    return sum(undecided), int((answers == UNDECIDED).sum())


TOTALS = {
    "HCl": "Cl", "HBr": "Br", "HNO3": "N(5)", "H2SO4": "S(6)", "H3PO4": "P", "CH3COOH": "Acetate", "HCOOH": "Formate",
    "C6H8O7": "Citrate", "KHC8H4O4": "K Phthalate", "NaOH": "Na", "KOH": "K", "Ba(OH)2": "Ba", "Ca(OH)2": "Ca",
    "LiOH": "Li", "NH3": "N(-3)", "NH4Cl": "N(-3) Cl", "NH4NO3": "N(-3) N(5)", "CH3COONa": "Na Acetate",
    "HCOONa": "Na Formate", "Na2CO3": "Na Na C(4)", "NaHCO3": "Na C(4)", "K2CO3": "K K C(4)", "Na2SO4": "Na Na S(6)",
    "NaH2PO4": "Na P", "Na2HPO4": "Na Na P", "K2HPO4": "K K P", "Na3PO4": "Na Na Na P", "NaF": "Na F", "HF": "F",
    "NaNO2": "Na N(3)", "AlCl3": "Al Cl Cl Cl", "FeCl3": "Fe(3) Cl Cl Cl", "FeSO4": "Fe(2) S(6)", "AgNO3": "Ag N(5)",
    "NaCl": "Na Cl", "KCl": "K Cl", "KBr": "K Br", "KI": "K I", "K2CrO4": "K K Cr(6)", "BaCl2": "Ba Cl Cl",
    "CuSO4": "Cu(2) S(6)", "CuCl2": "Cu(2) Cl Cl", "Pb(NO3)2": "Pb N(5) N(5)", "ZnSO4": "Zn S(6)", "ZnCl2": "Zn Cl Cl",
    "MgCl2": "Mg Cl Cl", "MgSO4": "Mg S(6)", "CaCl2": "Ca Cl Cl", "SrCl2": "Sr Cl Cl", "NiSO4": "Ni S(6)",
    "NiCl2": "Ni Cl Cl", "CoCl2": "Co(2) Cl Cl", "MnSO4": "Mn(2) S(6)", "CdCl2": "Cd Cl Cl", "CrCl3": "Cr(3) Cl Cl Cl",
    "H3BO3": "B", "Na2B4O7": "Na Na B B B B", "CaCO3": "Ca C(4)", "CuO": "Cu(2)", "CuSO4.5H2O": "Cu(2) S(6)",
    "AgCl": "Ag Cl", "Na2SO4.10H2O": "Na Na S(6)", "FeS": "Fe(2) S(-2)", "Mg(OH)2": "Mg", "NaHSO4": "Na S(6)",
    "Na2S": "Na Na S(-2)", "Na2B4O7.10H2O": "Na Na B B B B",
    "C2H5COOH": "Propionate", "NH2CH2COOH": "Glycine", "CH3NH2": "Methylamine", "C7H6O3": "Salicylate",
    "KCN": "K Cyanide", "KH2PO4": "K P", "Al2(SO4)3": "Al Al S(6) S(6) S(6)", "Na3C6H5O7": "Na Na Na Citrate",
    "Hg(NO3)2": "Hg(2) N(5) N(5)", "C2H8N2": "Ethylenediamine", "Na2C10H14N2O8": "Na Na Edta", "Al(OH)3": "Al",
    "Zn(OH)2": "Zn", "BaCO3": "Ba C(4)", "CaO": "Ca", "BaO": "Ba", "Na2O": "Na Na", "K2O": "K K", "MgO": "Mg",
    "ZnO": "Zn", "Cu(OH)2": "Cu(2)", "KAl(SO4)2.12H2O": "K Al S(6) S(6)", "PbCl2": "Pb Cl Cl", "SrCO3": "Sr C(4)",
}  # fmt: skip
"""Formula -> the elements of minteq.v4 that a mol of it brings; protons and hydroxide follow from the charges."""


WITHOUT_POLYSULFIDES = "SOLUTION_SPECIES\n" + "".join(
    f"HS- = S{count}-2 + H+\n log_k -99\n -no_check\n" for count in range(2, 7)
)
"""minteq.v4 writes them unbalanced, beside solid sulfur: a solution without any has none."""


KIELLAND = {
    "Cd+2": 5, "Hg2+2": 4, "Pb+2": 4.5, "Ni+2": 6, "Co+2": 6, "Be+2": 8, "Co+3": 6,
    "CrO4-2": 4, "MoO4-2": 4.5, "SeO4-2": 4, "Citrate-3": 5, "Tartarate-2": 5, "Phthalate-2": 6, "Mn+3": 6, "Fe+3": 6,
}  # fmt: skip
"""Angstrom of ions whose activities minteq.v4 does not have. Source: J. Kielland, J. Am. Chem. Soc. 59, 1937."""

PARKHURST = {
    "H+": (5, 0.1), "Mg+2": (5.5, 0.2), "Ca+2": (5, 0.165), "Sr+2": (5.26, 0.121), "Ba+2": (4, 0.153),
    "SO4-2": (5, -0.04), "CO3-2": (5.4, 0), "PO4-3": (4, 0), "Al+3": (6, 0), "Fe+2": (6, 0), "Mn+2": (6, 0),
    "Cu+2": (6, 0), "Zn+2": (5, 0),
}  # fmt: skip
"""The same, with a term linear in the ionic strength, by phreeqc.dat; H+ as measured in hydrochloric acid."""

CONSTANTS = {"NaCO3-": -9, "NaHCO3": -9, "NaHPO4-": -9, "KHPO4-": -9, "Fe(OH)3-": -31}
"""log_k that differ from those of minteq.v4: no pairs with which standard buffers of phosphate and carbonate have a pH
that is 0.08 and 0.14 too low, and the hydroxide of iron(II) of wateq4f and llnl: by minteq.v4 it dissolves in lye.
"""

ANIONIC_COMPLEX = re.compile(r"(Ag|Al|Be|Cd|Co(?!3|OH)|Cr(?!O)|Cu|Fe|Hg|Mn(?!O)|Ni|Pb|Sn|Tl|V|Zn).*-\d+$")


@cache
def minteq():
    """Text of minteq.v4 with activities for strong solutions.

    Its "-gamma 0 0" is the equation of Davies in MINTEQA2, for which it was written, and the limiting law in PHREEQC.
    Ions of two charges or more get a size.
    """
    import phreeqc

    sizes = {**{name: (size, 0) for name, size in KIELLAND.items()}, **PARKHURST}
    text = (Path(phreeqc.__file__).parent / "databases" / "minteq.v4.dat").read_text("utf-8", errors="replace")
    species, phases, rest = text.partition("\nPHASES")
    lines, ion = [], ""
    for line in filter(str.strip, species.splitlines()):
        if " = " in line and not line.lstrip().startswith("#"):
            ion = line.split(" = ")[1].split(" + ")[0].split()[-1]
            if ion in sizes:
                lines += [line, "\t-gamma {} {}".format(*sizes[ion])]
                continue
        if ion in CONSTANTS and line.split()[0] == "log_k":
            lines.append(f"\tlog_k {CONSTANTS[ion]}")
            continue
        charge = re.search(r"[+-](\d*)$", ion)
        if line.split() == ["-gamma", "0", "0"] and charge:
            if ion not in sizes and int(charge[1] or 1) > 1 and not ANIONIC_COMPLEX.match(ion):
                lines.append("\t-gamma 5 0")
            continue
        lines.append(line)
    return "\n".join(lines) + phases + rest


@cache
def library_with_minteq(changes=""):
    """PHREEQC with the data of ``minteq``, and changes of them, read once."""
    import phreeqc

    library = phreeqc.Phreeqc()
    library.LoadDatabaseString(minteq())
    if changes and library.RunString(f"{changes}END\n"):
        raise ValueError(library.GetErrorString())
    return library


def answer(moles, phases, kilograms, species=()):
    """pH, and mol of each phase and species, of so many mol of formulas in so much water at 25 degC."""
    totals = Counter()
    for formula, amount in moles.items():
        for element in TOTALS[formula].split():
            totals[element] += amount
    lines = ["SOLUTION 1", " units mol/kgw", f" water {kilograms}", " pH 7 charge"]
    lines += [f" {element} {float(amount / kilograms)!r}" for element, amount in totals.items() if amount]
    if phases:
        lines += ["EQUILIBRIUM_PHASES 1", *(f" {phase} 0 0" for phase in phases.values())]
    names = " ".join(phases.values())
    molal = {formula: f"m_{name}(mol/kgw)" for formula, name in dict(species).items()}
    output = "SELECTED_OUTPUT\n -reset false\n -pH true\n -water true\n -high_precision true\n"
    output += f" -equilibrium_phases {names}\n -molalities {' '.join(dict(species).values())}\n"
    library = library_with_minteq(WITHOUT_POLYSULFIDES if "S(-2)" in totals else "")
    if library.RunString(output + "\n".join([*lines, "END\n"])):
        raise ValueError(library.GetErrorString())
    columns = library.GetSelectedOutput()
    dissolved = {formula: columns[name][-1] * columns["mass_H2O"][-1] for formula, name in molal.items()}
    return {"pH": columns["pH"][-1], **{formula: columns[phase][-1] for formula, phase in phases.items()}, **dissolved}


def mixture(row):
    """mol of everything in the three vessels of a row, and kg of water, a litre being one."""
    moles, litres = Counter(), 0.0
    for vessel in (row.get(name, {}) for name in "abc"):
        volume = vessel.get("ml", 0.0) * 1e-3
        litres += volume
        for formula, molar in vessel.get("solutes", {}).items():
            moles[formula] += volume * molar
        if "solid" in vessel:
            moles[vessel["solid"]] += vessel["moles"]
    return moles, litres


if __name__ == "__main__":
    for row in tomllib.loads(Path(sys.argv[1]).read_text("utf-8"))["mixture"]:
        moles, litres = mixture(row)
        if row.get("by") == "PHREEQC":
            result = answer(moles, row.get("phases", {}), litres, row.get("species", {}))
            print(row["name"], {name: float(f"{value:.6g}") for name, value in result.items()}, sep=": ")
