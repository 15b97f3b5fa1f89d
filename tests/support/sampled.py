"""Which tests run a part of their cases among the quick tests."""

SAMPLED = {
    "tests/acceptance/test_doctor_policy.py::test_a_policy_changes_verdicts_in_the_flagged_span_only_and_says_how": 5,
    "tests/acceptance/test_doctor_synthetic.py::test_two_planted_faults_are_both_found": 4,
    "tests/acceptance/test_doctor_synthetic.py::"
    "test_with_noise_every_loss_is_found_and_nothing_else_is_above_a_warning": 5,
    "tests/cdcore/detectors/test_qaco.py::test_every_contact_and_every_face_pair_is_true": 3,
    "tests/cdcore/narrow/spacetime/test_whole_motion.py::test_every_dismissal_holds_when_it_is_asked_again": 3,
    "tests/cdcore/narrow/test_ill_posed.py::test_the_answer_is_that_of_every_face_pair_in_integers": 2,
    "tests/cdcore/narrow/trees/test_search.py::test_counts_and_faces_are_those_of_a_recursive_search": 3,
    "tests/cdcore/search/test_tracing.py::test_a_traced_look_counts_the_same_and_ends_as_the_run_did": 4,
    "tests/contracts/test_detectors.py::test_bodies_in_another_order_give_the_same_digests": 4,
    "tests/contracts/test_detectors.py::test_pairs_written_in_another_order_give_the_same_digests": 4,
    "tests/contracts/test_table_one.py::test_run_to_completion_it_finds_every_face": 3,
    "tests/hard_cases/test_fuzz.py::test_four_verbs_do_not_contradict_each_other_about_a_file_made_by_hand": 7,
    "tests/replay/api/test_places.py::test_sessions_and_runs_in_a_store_have_the_digest_of_those_here": 2,
    "tests/replay/api/test_places.py::test_verbs_take_urls_for_sessions_and_runs": 2,
    "tests/replay/outputs/report/test_faults.py::test_every_number_of_a_card_is_in_the_summary": 4,
    "tests/replay/outputs/report/test_faults.py::test_every_number_of_a_pair_is_in_the_summary": 4,
    "tests/replay/outputs/report/test_faults.py::test_events_clusters_and_stages_are_rows_of_the_summary": 4,
    "tests/replay/studies/class_study/test_class_page.py::"
    "test_a_question_is_answered_by_clicks_as_a_recount_answers_it": 4,
    "tests/replay/studies/class_study/test_resampling.py::test_intervals_hold_the_truth_in_about_95_of_100_classes": 2,
    "tests/replay/comparison/test_causes.py::test_the_table_is_diagonal_in_other_sessions_too": 4,
    "tests/replay/effects/models/test_sliced.py::"
    "test_onset_and_volume_of_every_vessel_are_those_of_slices_by_another_library": 5,
    "tests/replay/proof/test_verifier.py::test_it_rejects_every_alteration_that_makes_a_claim_false": 5,
    "tests/replay/studies/paper/test_contestants.py::test_an_engine_is_the_detector_of_the_same_budget": 3,
    "tests/replay/studies/stress/test_system.py::test_exact_passes_or_speaks_of_frames": 4,
    "tests/replay/test_engine_analytic.py::test_misses_at_a_low_rate_are_exactly_those_the_closed_form_predicts": 3,
    "tests/replay/test_engine_analytic.py::test_no_frame_contradicts_the_closed_form": 5,
    "tests/sessions/glassware/test_vessel.py::test_the_glass_itself_encloses_the_capacity": 5,
}
"""Tests of many like cases: one case in so many is quick, the others run with the slow tests."""
