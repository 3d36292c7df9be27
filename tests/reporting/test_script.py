import json
from types import SimpleNamespace

import pytest
from snakemake.iocontainers import InputFiles, Log, OutputFiles, Params

from gpca.errors import InputError
from gpca.reporting.script import job


@pytest.fixture
def snakemake(tmp_path):
    """The object that Snakemake hands to a script, made of Snakemake's own parts."""
    data, code = tmp_path / "predictions.csv", tmp_path / "module.py"
    data.write_text("sample\n")
    code.write_text("")
    given = SimpleNamespace(
        input=InputFiles(fromdict={"predictions": [str(data)], "code": [str(code)]}),
        output=OutputFiles(toclone=[str(tmp_path / "table.md")]),
        params=Params(fromdict={"title": "A title"}),
        log=Log(toclone=[str(tmp_path / "logs" / "table.log")]),
    )
    given.folder = tmp_path
    return given


def test_a_users_mistake_is_one_line_in_the_log_and_status_2(snakemake, capsys):
    with pytest.raises(SystemExit) as caught, job(snakemake):
        raise InputError("metrics.csv", "is empty", "regenerate it")
    assert caught.value.code == 2
    assert (snakemake.folder / "logs" / "table.log").read_text() == "metrics.csv: is empty; regenerate it\n"
    assert capsys.readouterr().err == ""
    assert not list(snakemake.folder.glob("*.provenance.json"))


def test_provenance_names_data_and_parameters_but_not_code(snakemake):
    with job(snakemake):
        (snakemake.folder / "table.md").write_text("a table")
    record = json.loads((snakemake.folder / "table.md.provenance.json").read_text())
    assert list(record["inputs_sha256"]) == [str(snakemake.folder / "predictions.csv")]
    assert record["settings"] == {"title": "A title"}


def test_other_errors_pass_through(snakemake):
    with pytest.raises(ZeroDivisionError), job(snakemake):
        raise ZeroDivisionError
