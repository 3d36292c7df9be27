import json

import pytest


def own_file(project, **sections):
    (project.folder / "mine.yaml").write_text(json.dumps(sections))
    return "--configfile", "mine.yaml"


BAD = {
    "unknown nested key": (
        lambda project: own_file(project, registrations={"severities": {"crops": [0.2, 0.3]}}),
        "registrations.severities.crops: unknown; did you mean crop?",
    ),
    "range downwards": (
        lambda project: own_file(project, registrations={"severities": {"noise": [0.3, 0.2]}}),
        "registrations.severities: severity noise: [0.3, 0.2] runs downwards",
    ),
    "no such folder": (
        lambda project: ("--config", "data_dir=/nowhere/at/all"),
        "/nowhere/at/all: no such folder; correct data_dir",
    ),
}


@pytest.mark.parametrize("fault", BAD)
def test_a_bad_config_stops_at_load_with_one_line(project, fault):
    arguments, message = BAD[fault]
    done = project.snakemake("-n", "all", *arguments(project), check=False)
    assert done.returncode != 0
    lines = [line for line in done.stderr.splitlines() if line.startswith("gpca: ")]
    assert len(lines) == 1
    assert message in lines[0]
    assert "Traceback" not in done.stdout + done.stderr
    assert not (project.folder / "results").exists()
