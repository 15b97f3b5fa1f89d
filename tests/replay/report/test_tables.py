from replay.report.tables import cost_table, fact_table, settings_table


def test_facts_name_every_body_and_the_length(run):
    text = fact_table(run)
    assert all(f"{body.name} ({len(body.mesh.faces):,} faces)" in text for body in run.assembly.bodies)
    assert f"{len(run.assembly.motion):,} frames" in text


def test_settings_hold_what_it_takes_to_run_again(run):
    text = settings_table(run)
    assert "&quot;rate_hz&quot;: 22.5" in text and run.detections["slow"].digest in text and "numpy" in text


def test_the_oracle_is_named_in_the_table_of_times(run):
    assert "oracle" in cost_table(run) and "frame by frame" in cost_table(run)
