"""Values of a config reach the rules: from the command line, and what is left out."""


def test_values_of_the_command_line_and_what_they_leave_out(project):
    values = (
        "seeds=[0]",
        "explainers={shap_supervised: false}",
        "encoders={pointnet: false}",
        "active_learning={strategies: {badge: false}}",
    )
    planned = project.dry_run("all", "--config", *values)
    assert planned.jobs["register"] == 3  # one seed of each source
    of_sources, of_frames, table_vi, estimated = 3 * 21, 6, 3 * 4, 5  # on frames: what needs no embedding; Table VI
    assert planned.jobs["attribute"] == of_sources + estimated
    assert planned.jobs["attribute_on_frames"] == of_frames + table_vi
    assert not any("/seed1" in path or "shap_supervised" in path or "badge" in path for path in planned.outputs)
    refused = project.plan("all", "--config", "seeds=0", check=False)
    assert "gpca: config key seeds: 0 should be a valid array; give a list: [0]" in refused.stderr
