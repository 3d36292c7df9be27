import json

import pytest


def own_file(project, **sections):
    (project.folder / "mine.yaml").write_text(json.dumps(sections))
    return "--configfile", "mine.yaml"


def own_text(project, text):
    (project.folder / "mine.yaml").write_text(text)
    return "--configfile", "mine.yaml"


BOMB = "a0: &a0 [x]\n" + "\n".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 7))
ABSOLUTE = {"title": "x", "kind": "mesh_folder", "unit": "mm", "location": ".", "files": ["/etc/*.ply"]}
BAD = {
    "unknown nested key": (
        lambda project: own_file(project, registrations={"severities": {"crops": [0.2, 0.3]}}),
        "registrations.severities.crops: unknown; did you mean crop?",
    ),
    "range downwards": (
        lambda project: own_file(project, registrations={"severities": {"noise": [0.3, 0.2]}}),
        "registrations.severities: severity noise: [0.3, 0.2] runs downwards",
    ),
    "key twice": (
        lambda project: own_text(project, "seeds: [0]\nseeds: [1]\n"),
        "mine.yaml: line 2: key 'seeds' stands twice; keep one of them",
    ),
    "bomb": (
        lambda project: own_text(project, BOMB),
        "mine.yaml: its aliases unfold to more than",
    ),
    "template": (
        lambda project: own_text(project, "__use_yte__: true\nseeds: [0]\n"),
        "mine.yaml: is a template",
    ),
    "number as a source's name": (
        lambda project: own_text(project, "sources: {1: {title: x, kind: procedural, family: ycb}}\n"),
        "sources.1: the key 1 is no text",
    ),
    "folder of the references": (
        lambda project: ("--config", "run=reference"),
        "config key run: results/reference is no run's folder; take another name",
    ),
    "size that cannot be": (
        lambda project: ("--config", "registrations={train: 1000000000000}"),
        "registrations.train: 1000000000000 is greater than the maximum of 1000000",
    ),
    "pattern elsewhere": (
        lambda project: own_file(project, data_dir=str(project.folder), sources={"ycb": ABSOLUTE}),
        "sources.ycb: pattern '/etc/*.ply': finds no files",
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
