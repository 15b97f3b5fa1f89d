"""Contacts in noisy copies: shares against the normal distribution, words, and the same answer however it is asked."""

from statistics import NormalDist

import numpy as np
import pytest
from support.small_worlds import along_x, cube, unit_cubes_on_x

from replay import run
from replay.auditing import noisy_contacts as module
from replay.document.gates import Gates
from replay.document.headline import notes_of
from replay.engine import compute
from sessions import Session

SIZE = "1 mm, 0 deg, 1 ms"
"""Along one axis 1 mm over the root of three; frames 10 ms apart do not correlate."""

SIGMA = 1e-3 / np.sqrt(3.0)

FAR = [9.0] * 20
WAVERING = [*FAR, *[0.3, -0.2, 0.1, -0.5] * 10, *FAR, -0.4, *FAR, 0.5, *FAR]
"""Gaps that noise of this size closes and opens: a glass at rest, a contact, and a near pass."""


def cubes_at_gaps_mm(millimetres, names="ab"):
    """Two cubes, the gap between their faces in every frame in millimetres, below 0 how far they overlap."""
    positions = {"a": [0.0] * len(millimetres), "b": [1.0 + 1e-3 * gap for gap in millimetres]}
    return unit_cubes_on_x({name: positions[name] for name in names})


def noisy_run(session, **more):
    """A run of ``slow``, which samples at 25 Hz, with noise of SIZE added to the poses."""
    more = {"detectors": "slow=discrete[rate_hz=25]", "noise": [SIZE]} | more
    return compute(session, **more)


@pytest.mark.slow
def test_copies_with_contact_follow_the_normal_distribution():
    """Faces that are parallel meet where the noise along one axis closes the gap: two trackers, or one."""
    wide = [-0.4, 0.0, 0.7, 0.8]
    session = cubes_at_gaps_mm([*FAR, *(item for gap in wide for item in (gap, *FAR))])
    for sizes, sigma in (([SIZE], np.sqrt(2.0) * SIGMA), ([f"b={SIZE}"], SIGMA)):
        noise = noisy_run(session, noise=sizes, noise_copies=4000).noise
        fraction = [item.fraction for item in (*noise.contacts, *noise.near)]
        assert fraction == pytest.approx([NormalDist(0, 1e3 * sigma).cdf(-gap) for gap in wide], abs=0.03)


def test_deep_contacts_hold_and_grazing_contacts_are_undecidable(monkeypatch):
    """6 mm deep for 120 frames, 0.1 mm deep once, 0.5 mm apart in frames 181 and 223; noise has 0.6 mm along the gap.

    The 244 frames are drawn in three blocks; queried are these 123 and not those 6 mm apart.
    """
    monkeypatch.setattr(module, "BLOCK_FRAMES", 90)
    result = noisy_run(cubes_at_gaps_mm([*FAR, *[-6.0] * 120, *FAR, -0.1, *FAR, 0.5, *FAR, 6.0, *FAR, 0.5, *FAR]))
    noise = result.noise
    assert [item.word for item in noise.contacts] == [module.HOLDS, module.UNDECIDABLE] == list(noise.labels)
    assert [(near.first, near.last) for near in noise.near] == [(181, 181), (223, 223)]
    assert all(0.05 < near.fraction < 0.95 for near in noise.near)
    assert noise.resting == () and noise.queried == 123
    settings = result.document.noise
    assert settings.copies == noise.copies and set(settings.sizes) == set(noise.sizes)


def test_noise_of_a_distant_body_undoes_no_contact():
    """a and b meet in frame 4; only c has noise, 50 m away."""
    positions = {"a": [0.0] * 9, "b": [3.0] * 4 + [0.9] + [3.0] * 4, "c": [50.0] * 8 + [51.0]}
    (contact,) = noisy_run(unit_cubes_on_x(positions), noise=[f"c={SIZE}"]).noise.contacts
    assert (contact.fraction, contact.word) == (1.0, module.HOLDS)


def test_contact_in_95_percent_of_noisy_copies_holds():
    """61 of 64 copies are 95.3 %, 60 are 93.8 %; likewise a contact in at most 5 % of copies (3, not 4) is absent."""
    spans = [module.NoisySpan(0, 0, 0, fraction / 64) for fraction in (0, 3, 4, 60, 61, 64)]
    states = [module.ABSENT] * 2 + [module.UNDECIDABLE] * 2 + [module.HOLDS] * 2
    assert [item.word for item in spans] == states


def test_contacts_of_a_glass_at_rest_are_undecidable():
    """Frames 62 to 211 rest at gaps of -0.1 to 0.3 mm, which noise of 0.6 mm closes and opens."""
    rest = 0.1 + 0.2 * np.sin(np.arange(150))
    result = noisy_run(cubes_at_gaps_mm([*FAR, -6.0, -6.0, *FAR, *FAR, *rest.tolist(), *FAR]), noise_copies=32)
    (interval,) = result.noise.resting
    assert (interval.first, interval.last) == pytest.approx((62, 211), abs=12) and result.noise.near == ()
    before, *text = result.noise.labels
    assert before == module.HOLDS and len(text) > 10 and set(text) == {module.UNDECIDABLE}
    assert "Noise leaves open whether the bodies of 1 pair at rest touch." in " ".join(notes_of(result))


@pytest.mark.slow
def test_only_the_seed_changes_an_answer_about_noise(monkeypatch):
    """Neither size of blocks nor number of threads nor names of bodies do."""
    session = cubes_at_gaps_mm(WAVERING)
    whole = noisy_run(session, noise_copies=16).noise
    monkeypatch.setattr(module, "BLOCK_FRAMES", 7)
    for threads in (1, 5):
        monkeypatch.setattr(module.os, "cpu_count", lambda threads=threads: threads)
        assert noisy_run(session, noise_copies=16).noise == whole
    assert noisy_run(cubes_at_gaps_mm(WAVERING, names="ba"), noise_copies=16).noise == whole
    assert noisy_run(session, noise_copies=16, seed=1).noise != whole


def test_gates_count_only_contacts_that_hold_despite_noise(tmp_path):
    """Three contacts, all missed at 7 Hz: one 6 mm deep, which holds, and two of 0.1 mm, which noise may undo."""
    session = cubes_at_gaps_mm([*FAR, -6.0, -6.0, *FAR, -0.1, *FAR, -0.1, *FAR])
    result = run(session, detectors="slow=discrete[rate_hz=7]", noise=SIZE, out=tmp_path / "run", picture=False)
    tables = result.tables
    assert tables["episodes"].where(detector="exact").column("noise") == ["holds", *["undecidable"] * 2]
    misses = zip(*(tables["misses"].column(name) for name in ("noise", "noise_share")), strict=True)
    assert {(word, fraction == 1.0) for word, fraction in misses} == {("holds", True), ("undecidable", False)}
    assert "With tracker noise: holds." in (tmp_path / "run" / "report.html").read_text()
    figures = result.document.audit["slow"]
    assert figures.contacts_missed == 3 and figures.noise_proof.contacts == figures.noise_proof.contacts_missed == 1
    (text, *_) = Gates(max_missed=0.5).broken_limits(result.document.audit, [])
    assert "slow missed" in text and " of 1" in text and text.endswith("counted is what holds in spite of the noise")


def test_run_without_noise_reports_nothing_about_noise():
    """Cubes overlap by 1 mm in the second of three frames."""
    result = compute(cubes_at_gaps_mm([9.0, -1.0, 9.0]), detectors="hybrid")
    assert result.noise is None is result.document.noise and result.document.audit["hybrid"].noise_proof is None
    assert not any("noise" in line for line in notes_of(result))


def test_noise_of_a_rotation_reaches_as_far_as_its_lever():
    """A rod of 2 m: half a degree moves its end by 9 mm, which closes a gap of 3 mm in some copies."""
    rod = cube()
    long = type(rod)(rod.vertices * [0.02, 2.0, 0.02], rod.faces)
    poses = {"rod": along_x([0.063] * 30), "cube": along_x([0.0] * 30)}
    poses["rod"][0][:, 1], poses["cube"][0][:, 1] = 0.2, 1.1
    poses["cube"][0][0, 1] = 1.15
    session = Session.from_arrays(np.arange(30) * 10_000_000, poses, {"rod": long, "cube": cube(edge=0.1)})
    result = compute(session, detectors="hybrid", noise="rod=0 mm, 0.5 deg, 0.01 s")
    assert result.noise.queried == 30 and (result.noise.near or result.noise.resting)
