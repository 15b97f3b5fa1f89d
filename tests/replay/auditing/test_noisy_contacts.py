"""Contacts in noisy copies: shares against the normal distribution, words, and the same answer however it is asked."""

from statistics import NormalDist

import numpy as np
import pytest
from support.small_worlds import STEP_NS, along_x, cube, unit_cubes_on_x

from replay import run
from replay.auditing import noisy_contacts as module
from replay.document.gates import Gates
from replay.document.headline import notes_of
from replay.engine import compute
from sessions import MeshData, Session

SIZE = "1 mm, 0 deg, 1 ms"
"""Noise of a tracker: root mean square of the errors in position and rotation, and the time over which they correlate.

Errors of frames, 10 ms apart, do not correlate."""

SIGMA_MM = 1.0 / np.sqrt(3.0)
"""Standard deviation along one of three axes of a position error of 1 mm in the root mean square: 0.58 mm."""

FAR = [9.0] * 20
"""A gap of 9 mm for 20 frames of 10 ms: more than the noise reaches, for long enough to part two contacts."""
WAVERING = [*FAR, *[0.3, -0.2, 0.1, -0.5] * 10, *FAR, -0.4, *FAR, 0.5, *FAR]
"""Gaps in mm that noise of this size closes and opens: a glass at rest, a contact, and a near pass."""


def cubes_at_gaps_mm(millimetres, names="ab"):
    """Two cubes, the gap between their faces in every frame in millimetres, below 0 how far they overlap."""
    positions = {"a": [0.0] * len(millimetres), "b": [1.0 + 1e-3 * gap for gap in millimetres]}
    return unit_cubes_on_x({name: positions[name] for name in names})


def noisy_run(session, **more):
    """A run of ``slow``, which samples at 25 Hz, with noise of SIZE added to the poses of both bodies.

    The noise is drawn anew in each of 64 copies, unless ``more`` has another number.
    """
    more = {"detectors": "slow=discrete[rate_hz=25]", "noise": [SIZE]} | more
    return compute(session, **more)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("noise_of", "sigma_mm"),
    [
        pytest.param(SIZE, np.sqrt(2.0) * SIGMA_MM, id="both bodies"),
        pytest.param(f"b={SIZE}", SIGMA_MM, id="one body"),
    ],
)
def test_copies_with_contact_follow_the_normal_distribution(noise_of, sigma_mm):
    """Parallel faces are -0.4, 0, 0.7 and 0.8 mm apart in a frame each; noise along one axis closes or opens the gap.

    Noise of 1 mm, the root mean square in three axes, is 1 / sqrt(3) mm in one (SIGMA_MM). The fraction of copies with
    contact is the probability that an error is at least the gap, to 3 points: four standard errors of 4000 copies.
    """
    gaps_mm = [-0.4, 0.0, 0.7, 0.8]
    session = cubes_at_gaps_mm([*FAR, *(item for gap in gaps_mm for item in (gap, *FAR))])
    noise = noisy_run(session, noise=[noise_of], noise_copies=4000).noise
    fractions = [item.fraction for item in (*noise.contacts, *noise.near)]
    assert fractions == pytest.approx([NormalDist(0, sigma_mm).cdf(-gap) for gap in gaps_mm], abs=0.03)


def test_deep_contacts_hold_and_grazing_contacts_are_undecidable(monkeypatch):
    """6 mm deep for 120 frames, 0.1 mm deep once, 0.5 mm apart in frames 181 and 223; the gap has 0.8 mm of noise.

    That is 0.6 mm of each body, times the root of 2. The deep contact holds in all copies; of the other three some
    copies have a contact and some do not. Queried are these 123 frames and not that 6 mm apart. Three blocks are drawn.
    """
    monkeypatch.setattr(module, "BLOCK_FRAMES", 90)
    result = noisy_run(cubes_at_gaps_mm([*FAR, *[-6.0] * 120, *FAR, -0.1, *FAR, 0.5, *FAR, 6.0, *FAR, 0.5, *FAR]))
    noise = result.noise
    assert [item.word for item in noise.contacts] == [module.HOLDS, module.UNDECIDABLE] == list(noise.labels)
    assert [(near.first, near.last) for near in noise.near] == [(181, 181), (223, 223)]
    assert all(0.05 < near.fraction < 0.95 for near in noise.near)
    assert noise.resting == () and noise.queried == 120 + 1 + 2


def test_document_has_the_settings_of_the_noise():
    """Two cubes have noise of 1 mm, 0 degrees and 1 ms in 8 copies: the document of the run says so of either."""
    settings = noisy_run(cubes_at_gaps_mm([9.0, -1.0, 9.0]), noise_copies=8).document.noise
    assert settings.copies == 8
    assert settings.sizes == {"a": pytest.approx((1.0, 0.0, 1e-3)), "b": pytest.approx((1.0, 0.0, 1e-3))}


def test_noise_of_a_distant_body_undoes_no_contact():
    """Unit cubes a and b meet in frame 4 alone; only c has noise, 50 m away: all copies have the contact."""
    positions = {"a": [0.0] * 9, "b": [3.0] * 4 + [0.9] + [3.0] * 4, "c": [50.0] * 8 + [51.0]}
    (contact,) = noisy_run(unit_cubes_on_x(positions), noise=[f"c={SIZE}"]).noise.contacts
    assert (contact.fraction, contact.word) == (1.0, module.HOLDS)


@pytest.mark.parametrize(
    ("copies_with_contact", "word"),
    [
        pytest.param(0, module.ABSENT, id="none"),
        pytest.param(3, module.ABSENT, id="4.7 %"),
        pytest.param(4, module.UNDECIDABLE, id="6.3 %"),
        pytest.param(60, module.UNDECIDABLE, id="93.8 %"),
        pytest.param(61, module.HOLDS, id="95.3 %"),
        pytest.param(64, module.HOLDS, id="all"),
    ],
)
def test_contact_in_95_percent_of_noisy_copies_holds(copies_with_contact, word):
    """A contact is in so many of 64 noisy copies of a recording: from 95 % on it holds, up to 5 % it is absent."""
    assert module.NoisySpan(pair=0, first=0, last=0, fraction=copies_with_contact / 64).word == word


def test_contacts_of_a_glass_at_rest_are_undecidable():
    """Frames 62 to 171 rest at gaps of -0.1 to 0.3 mm, which noise closes and opens: 0.6 mm a body, in 16 copies.

    They are one interval at rest, to 12 frames, and no near passes. The contact of 6 mm in frames 20 and 21 holds;
    each of the more than ten short contacts at rest is undecidable, and a note says so of the pair.
    """
    rest = 0.1 + 0.2 * np.sin(np.arange(110))
    result = noisy_run(cubes_at_gaps_mm([*FAR, -6.0, -6.0, *FAR, *FAR, *rest.tolist(), *FAR]), noise_copies=16)
    (interval,) = result.noise.resting
    assert (interval.first, interval.last) == pytest.approx((62, 171), abs=12)
    assert result.noise.near == ()
    deep, *at_rest = result.noise.labels
    assert deep == module.HOLDS
    assert len(at_rest) > 10 and set(at_rest) == {module.UNDECIDABLE}
    assert "Noise leaves open whether the bodies of 1 pair at rest touch." in " ".join(notes_of(result))


@pytest.mark.slow
def test_only_the_seed_changes_an_answer_about_noise(monkeypatch):
    """Gaps between two cubes waver by half a millimetre, so that noise closes and opens them in 16 noisy copies.

    The answer is the same for blocks of 7 frames, for 1 and 5 threads, and with the two bodies exchanged.
    """
    session = cubes_at_gaps_mm(WAVERING)
    usual = noisy_run(session, noise_copies=16).noise
    assert noisy_run(session, noise_copies=16, seed=1).noise != usual
    monkeypatch.setattr(module, "BLOCK_FRAMES", 7)
    for threads in (1, 5):
        monkeypatch.setattr(module.os, "cpu_count", lambda threads=threads: threads)
        assert noisy_run(session, noise_copies=16).noise == usual
    assert noisy_run(cubes_at_gaps_mm(WAVERING, names="ba"), noise_copies=16).noise == usual


@pytest.fixture(scope="module")
def run_of_three_misses(tmp_path_factory):
    """A run and its folder: three contacts are missed at 7 Hz, one of 6 mm and two of 0.1 mm, which noise may undo."""
    session = cubes_at_gaps_mm([*FAR, -6.0, -6.0, *FAR, -0.1, *FAR, -0.1, *FAR])
    folder = tmp_path_factory.mktemp("noise") / "run"
    result = run(session, detectors="slow=discrete[rate_hz=7]", noise=SIZE, out=folder, picture=False)
    assert result.document.audit["slow"].contacts_missed == 3
    return result, folder


def test_gates_count_only_contacts_that_hold_despite_noise(run_of_three_misses):
    """Three contacts are missed, one 6 mm deep and two 0.1 mm, which noise of 1 mm may undo: only the deep one holds.

    So 1 of 1 is missed, more than the limit of half, and the gate says what is counted.
    """
    result, _ = run_of_three_misses
    noise_proof = result.document.audit["slow"].noise_proof
    assert (noise_proof.contacts, noise_proof.contacts_missed) == (1, 1)
    (text, *_) = Gates(max_missed=0.5).broken_limits(result.document.audit, [])
    assert "slow missed" in text and " of 1" in text and text.endswith("counted is what holds in spite of the noise")


def test_tables_and_report_say_which_contacts_hold(run_of_three_misses):
    """Three contacts are missed, one 6 mm deep and two 0.1 mm, less than the noise of 1 mm.

    The deep contact and its miss are in all noisy copies (``noise_share`` 1), the two others only in some.
    """
    result, folder = run_of_three_misses
    contacts = result.tables["episodes"].where(detector="exact").column("noise")
    assert contacts == ["holds", "undecidable", "undecidable"]
    misses = zip(*(result.tables["misses"].column(name) for name in ("noise", "noise_share")), strict=True)
    assert {(word, fraction == 1.0) for word, fraction in misses} == {("holds", True), ("undecidable", False)}
    assert "With tracker noise: holds." in (folder / "report.html").read_text()


def test_run_without_noise_reports_nothing_about_noise():
    """Cubes overlap by 1 mm in the second of three frames, and no noise is requested."""
    result = compute(cubes_at_gaps_mm([9.0, -1.0, 9.0]), detectors="hybrid")
    assert result.noise is None
    assert result.document.noise is None
    assert result.document.audit["hybrid"].noise_proof is None
    assert not any("noise" in line for line in notes_of(result))


def test_noise_of_a_rotation_reaches_as_far_as_its_lever():
    """Beside the upper end of a rod of 2 m rests a cube, 3 mm away: half a degree moves that end by 9 mm.

    The rod's pose has noise of 0 mm, 0.5 degrees and 10 ms, which without a lever reaches nothing. So every frame is
    queried, and some noisy copies have a contact: of a near pass, or of bodies at rest.
    """
    frames, rod_end_y, gap_m = 30, 1.0, 0.003
    rod = MeshData(cube().vertices * [0.02, 2.0, 0.02], cube().faces)
    small_cube = cube(edge=0.1)
    rod_x = small_cube.vertices[:, 0].max() + gap_m + rod.vertices[:, 0].max()
    poses = {"rod": along_x([rod_x] * frames), "cube": along_x([0.0] * frames)}
    poses["cube"][0][:, 1] = rod_end_y - 0.1
    poses["cube"][0][0, 1] = rod_end_y - 0.05  # without a move neither of the two would be a moving body
    session = Session.from_arrays(np.arange(frames) * STEP_NS, poses, {"rod": rod, "cube": small_cube})
    noise = compute(session, detectors="hybrid", noise="rod=0 mm, 0.5 deg, 0.01 s").noise
    assert noise.queried == frames
    assert noise.near or noise.resting
