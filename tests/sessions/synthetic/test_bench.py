import numpy as np
import pytest

from sessions.errors import SceneError
from sessions.geometry.rotations import rotated
from sessions.model.scene import Pose, Scene, SceneBody, SceneEffect
from sessions.scene_files.scene_toml import parse_scene
from sessions.synthetic.assembly import Recording
from sessions.synthetic.bench import BENCH_TOP, STAND_M, Layout, Placed, standing, with_text
from sessions.synthetic.bench_bumps import PLACED, SECONDS
from sessions.synthetic.bump_scripts import Plan, left_hand, right_hand, watching
from sessions.synthetic.planting import Blinks

SCENE = Scene(
    "a test",
    (
        SceneBody("bench", instrument="bench", fixed=Pose(), tags=("bench",)),
        SceneBody("glass", instrument="beaker_250", group="g", tags=("glass",), extra={"faces": 600, "mass": 0.25}),
    ),
    effects=(SceneEffect("contact", {"between": ["tag:glass", "tag:bench"]}),),
)


@pytest.fixture(scope="module")
def layout():
    return Layout(
        {
            "bench": Placed("bench", moves=False),
            "glass": Placed("beaker_100", standing(0.1, -0.2), properties={"liquid": "water"}, tags=("hot",)),
            "hand": Placed("hand_left", options={"grip_radius": 0.02}, faces=800),
        },
        600,
    )


def test_what_stands_is_lifted_from_the_bench_by_a_tenth_of_a_millimetre(layout):
    base = layout.at("glass")[1] + layout.mesh("glass").bounds[0, 1]
    top = layout.mesh("bench").bounds[1, 1]
    assert base - top == pytest.approx(STAND_M, abs=1e-6)
    assert top == pytest.approx(BENCH_TOP)


def test_bodies_of_the_scene_carry_mass_cavity_tags_and_own_keys(layout):
    bench, glass, hand = layout.bodies()
    assert bench.fixed is not None and glass.fixed is None
    assert glass.extra["cavity"]["capacity_ml"] == 100.0
    assert 0.0 < glass.extra["cavity"]["floor"] < glass.extra["cavity"]["mark"] < 0.07
    assert glass.extra["properties"] == {"liquid": "water"} and "hot" in glass.tags and "glass" in glass.tags
    assert hand.extra["options"] == {"grip_radius": 0.02}
    assert (glass.extra["faces"], hand.extra["faces"]) == (600, 800)
    assert all(type(value) is float for value in glass.extra["cavity"]["lip"])
    assert 0.02 < glass.extra["mass"] < 0.05


def test_meshes_have_the_resolution_asked_for(layout):
    assert len(layout.mesh("glass").faces) == pytest.approx(600, rel=0.3)
    assert len(layout.mesh("hand").faces) == pytest.approx(800, rel=0.3)
    assert set(layout.meshes) == {"bench", "glass", "hand"}


def test_sites_are_in_the_bodys_frame_and_only_a_vessel_has_a_cavity(layout):
    assert layout.site("hand", "grip").tolist() == [0.0, 0.0, 0.0]
    with pytest.raises(ValueError, match="hand is no vessel"):
        layout.cavity("hand")


def test_the_text_read_again_is_the_scene():
    done = with_text(SCENE, ["a remark", "and another"])
    assert done.text.startswith("# a remark\n# and another\n")
    assert parse_scene(done.text) == done
    assert (done.name, done.bodies, done.effects) == (SCENE.name, SCENE.bodies, SCENE.effects)


def test_a_scene_that_declares_no_effect_says_so():
    assert with_text(Scene("none", effects=())).effects == ()
    assert with_text(Scene("unsaid")).effects is None


def test_an_effect_between_what_is_not_there_is_refused():
    with pytest.raises(SceneError, match="tag:lamp"):
        with_text(Scene("x", SCENE.bodies, effects=(SceneEffect("contact", {"between": ["tag:lamp", "glass"]}),)))


@pytest.fixture(scope="module")
def played():
    how = Recording(seconds=SECONDS, noise="vive", jitter="steady")
    plan = Plan(Layout(PLACED, 600), Blinks(how.stamps() * 1e-9, how.latency_s), how, np.random.default_rng(0))
    return plan, right_hand(plan), left_hand(plan)


def test_both_scripts_end_within_the_session(played):
    _, right, left = played
    assert 45.0 < right.now < SECONDS
    assert 40.0 < left.now < SECONDS


def test_half_of_the_taps_are_brief(played):
    plan, _, _ = played
    lengths = sorted(episode.nominal[1] - episode.nominal[0] for episode in plan.episodes)
    assert len(lengths) == 18
    assert lengths[8] < 0.026 < 0.15 < lengths[9]
    assert sum("briefly" in episode.note for episode in plan.episodes) == 9


def test_every_bump_lies_in_a_window_in_which_its_hand_is_not_lost(played):
    plan, _, _ = played
    left = {"hand-left", "cylinder"}
    for episode in plan.episodes:
        hand = "hand-left" if left & set(episode.pair) else "hand-right"
        assert any(a < episode.possibly[0] and episode.possibly[1] < b for a, b in plan.keep[hand])


def test_the_eyes_look_down_at_the_bench(played):
    plan, _, _ = played
    times = np.linspace(0.0, SECONDS, 200)
    position, quaternion = watching(plan)(times)
    gaze = rotated(quaternion, np.array([0.0, 0.0, -1.0]))
    reach = (position[:, 1] - 0.98) / -gaze[:, 1]
    spot = position + reach[:, None] * gaze
    assert (gaze[:, 1] < -0.3).all()
    assert (np.abs(spot[:, 0]) < 0.6).all() and (np.abs(spot[:, 2]) < 0.3).all()
