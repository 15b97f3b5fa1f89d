from __future__ import annotations

from sessions.synthetic.levels import levelled


def ask(spans, tessellation=0.0, kind="contact", latency=0.0, blur=0.001):
    return levelled(("a", "b"), kind, lambda level: spans[round(level, 6)], blur, tessellation, (latency, 9.0))


def test_a_shallow_touch_below_the_noise_is_never_sure():
    spans = {0.001: [(0.0, 3.0)], 0.0: [(1.0, 2.0)], -0.001: []}
    (episode,) = ask(spans)
    assert (episode.nominal, episode.surely, episode.possibly) == ((1.0, 2.0), None, (0.0, 3.0))


def test_a_near_miss_is_an_episode_without_a_nominal_time():
    (episode,) = ask({0.001: [(1.0, 2.0)], 0.0: [], -0.001: []})
    assert (episode.nominal, episode.surely, episode.possibly) == (None, None, (1.0, 2.0))


def test_two_touches_that_noise_may_join_stay_two_episodes_of_one_possible_time():
    first, second = ask({0.001: [(0.0, 5.0)], 0.0: [(1.0, 2.0), (3.0, 4.0)], -0.001: [(1.2, 1.8), (3.2, 3.8)]})
    assert (first.surely, second.surely) == ((1.2, 1.8), (3.2, 3.8))
    assert first.possibly == second.possibly == (0.0, 5.0)


def test_tessellation_shortens_contact_but_can_lengthen_containment():
    spans = {0.001: [(1.0, 2.0)], 0.003: [(0.5, 2.5)], 0.0: [(1.1, 1.9)], -0.001: [(1.2, 1.8)], -0.003: [(1.4, 1.6)]}
    (contact,) = ask(spans, tessellation=0.002)
    (contained,) = ask(spans, tessellation=0.002, kind="contained")
    assert (contact.surely, contact.possibly) == ((1.4, 1.6), (1.0, 2.0))
    assert (contained.surely, contained.possibly) == ((1.2, 1.8), (0.5, 2.5))


def test_poses_recorded_late_shift_the_episode_but_not_the_start_of_the_session():
    spans = {0.001: [(0.0, 1.0)], 0.0: [(0.0, 1.0)], -0.001: [(0.5, 8.99)]}
    (episode,) = ask(spans, latency=0.02)
    assert episode.possibly == (0.0, 1.02)
    spans = {0.001: [(5.0, 8.99)], 0.0: [(5.0, 8.99)], -0.001: [(8.985, 8.99)]}
    (episode,) = ask(spans, latency=0.02)
    assert episode.possibly == (5.02, 9.0)
    assert episode.surely is None
