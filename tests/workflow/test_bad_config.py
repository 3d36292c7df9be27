import json

import pytest


def own_file(project, **sections):
    (project.folder / "mine.yaml").write_text(json.dumps(sections))
    return "--configfile", "mine.yaml"


def own_text(project, text):
    (project.folder / "mine.yaml").write_text(text)
    return "--configfile", "mine.yaml"


BOMB = "a0: &a0 [x]\n" + "\n".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 7))
BAD = {
    "range downwards": (
        lambda project: own_file(project, registrations={"severities": {"noise": [0.3, 0.2]}}),
        "registrations.severities: severity noise: [0.3, 0.2] is in descending order",
    ),
    "key twice": (
        lambda project: own_text(project, "seeds: [0]\nseeds: [1]\n"),
        "mine.yaml: line 2: key 'seeds' appears twice; keep one of them",
    ),
    "bomb": (lambda project: own_text(project, BOMB), "mine.yaml: its aliases expand to more than"),
    "template": (lambda project: own_text(project, "__use_yte__: true\nseeds: [0]\n"), "mine.yaml: is a template"),
    "folder of the references": (
        lambda project: ("--config", "run=reference"),
        "config key run: results/reference is reserved; choose another name",
    ),
    "size that cannot be": (
        lambda project: ("--config", "registrations={train: 1000000000000}"),
        "registrations.train: 1000000000000 should be less than or equal to 1000000",
    ),
}


# The others are told apart in tests/config; here is what Snakemake reads before the suite does, and one of each way.
@pytest.mark.parametrize("fault", BAD)
def test_a_bad_config_stops_at_load_with_one_line(project, fault):
    arguments, message = BAD[fault]
    done = project.plan("all", *arguments(project), check=False)
    assert done.returncode != 0
    lines = [line for line in done.stderr.splitlines() if line.startswith("gpca: ")]
    assert len(lines) == 1
    assert message in lines[0]
    assert "Traceback" not in done.stdout + done.stderr
    assert not (project.folder / "results").exists()
