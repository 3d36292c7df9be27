"""The RO-Crate of a small run, held to what RO-Crate 1.1 asks of a crate; that of the smoke run: tests/workflow."""

import json
import os
from urllib.parse import urlparse

import pytest

from gpca.jobs.provenance import record_provenance
from gpca.page.crate import NAME, write_crate


def faults(crate, folder):
    """What the specification would not allow: its sections 3 (structure), 4 (metadata) and 5 (data entities)."""
    entities = {entity["@id"]: entity for entity in crate["@graph"]}
    about, root = entities[NAME], entities["./"]
    data = [part["@id"] for part in root["hasPart"]]
    found = ["an identifier appears twice"] if len(entities) < len(crate["@graph"]) else []
    found += [f"{entity} has no type" for entity in entities.values() if not entity.get("@type")]
    if about["@type"] != "CreativeWork" or about["about"] != {"@id": "./"}:
        found.append("the descriptor is not about the root")
    if not about["conformsTo"]["@id"].startswith("https://w3id.org/ro/crate/1."):
        found.append("no version of the specification")
    found += [f"the root has no {key}" for key in ("name", "description", "datePublished", "license") if not root[key]]
    for entity in entities.values():
        if entity["@type"] in ("File", "Dataset") and entity["@id"] not in ("./", *data):
            found.append(f"{entity['@id']} is no part of the root")
        for values in entity.values():
            for value in values if isinstance(values, list) else [values]:
                if isinstance(value, dict) and value["@id"] not in {*entities}:
                    found += [] if urlparse(value["@id"]).scheme else [f"{value['@id']} is not described"]
    return found + [f"{name} is not there" for name in data if not (folder / name).exists()]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A run of two jobs: objects from a file elsewhere, and a table with its figure from the objects."""
    monkeypatch.chdir(tmp_path)
    outside, folder = tmp_path / "data/secret/cup.ply", tmp_path / "results/tiny"
    for path in (outside, folder / "objects/cup.npz", folder / "tables/table1.csv", folder / "figures/fig1.png"):
        path.parent.mkdir(parents=True)
    outside.write_text("a cup")

    def job(outputs, inputs):
        with record_provenance(outputs, inputs, {"sharpness": 2}, seed=0):
            for path in outputs:
                path.write_text("made")
        for path in outputs:
            os.utime(f"{path}.provenance.json", (1.7e9, 1.7e9))

    job([folder / "objects/cup.npz"], [outside])
    job([folder / "tables/table1.csv", folder / "figures/fig1.png"], [folder / "objects/cup.npz"])
    return folder


def crate_of(folder):
    write_crate(folder, "tiny", ["Cups", "Mugs"], [0, 1])
    return json.loads((folder / NAME).read_text())


def test_a_crate_is_what_the_specification_asks_for(folder):
    crate = crate_of(folder)
    assert crate["@context"][0] == "https://w3id.org/ro/crate/1.1/context"
    assert faults(crate, folder) == []
    crate["@graph"].append({"@id": "tables/no.csv", "@type": "File", "about": {"@id": "#nobody"}})
    assert faults(crate, folder) == ["tables/no.csv is no part of the root", "#nobody is not described"]


def test_each_job_names_what_it_read_and_wrote(folder):
    entities = {entity["@id"]: entity for entity in crate_of(folder)["@graph"]}
    assert entities["./"]["datePublished"] == "2023-11-14"
    assert "on Cups, Mugs; seeds 0, 1." in entities["./"]["description"]
    drawn, objects = (entities[part["@id"]] for part in entities["./"]["mentions"])
    assert drawn["object"] == objects["result"] == {"@id": "objects/cup.npz"}
    assert sorted(part["@id"] for part in drawn["result"]) == ["figures/fig1.png", "tables/table1.csv"]
    assert entities[objects["object"]["@id"]]["name"] == "cup.ply"
    assert "secret" not in (folder / NAME).read_text()  # where data lies is nobody's business
    assert entities[drawn["instrument"]["@id"]]["name"] == "GP-CA Bench"
    record = json.loads((folder / "tables/table1.csv.provenance.json").read_text())
    assert entities["objects/cup.npz"]["sha256"] == record["inputs_sha256"][str(folder / "objects/cup.npz")]
    assert entities["tables/table1.csv"]["encodingFormat"] == "text/csv"
    assert all("encodingFormat" in entity for entity in entities.values() if entity["@type"] == "File")
    assert entities[entities["./"]["license"]["@id"]]["name"] == "MIT"


def test_the_same_run_is_described_by_the_same_bytes(folder):
    with record_provenance([folder / "index.html", folder / NAME], [], {}):  # of the job that writes it
        (folder / "index.html").touch()
        crate_of(folder)
    first = (folder / NAME).read_bytes()
    assert b"index.html" not in first
    crate_of(folder)
    assert (folder / NAME).read_bytes() == first
