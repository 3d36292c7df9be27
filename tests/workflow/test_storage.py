"""The example of objects that a storage plugin brings, where that plugin and rsync are installed."""

import shutil

import pytest

from .conftest import ROOT


def test_objects_of_a_storage_are_a_source_of_the_run(project, tmp_path_factory):
    pytest.importorskip("snakemake_storage_plugin_fs")
    if shutil.which("rsync") is None:
        pytest.skip("no rsync: the plugin copies by it")
    (project.folder / "workflow/rules/sources").mkdir(exist_ok=True)
    shutil.copy2(ROOT / "examples/storage/shared_objects.smk", project.folder / "workflow/rules/sources")
    stored = tmp_path_factory.mktemp("storage")
    (stored / "shared").mkdir()
    (stored / "shared/objects.npz").write_bytes(b"objects")
    target = "results/smoke/objects/shared.npz"
    options = ("--configfile", "config/smoke.yaml", "--config", f"data_dir={stored}")
    project.snakemake_as_processes("-j1", target, *options)
    assert (project.folder / target).read_bytes() == b"objects"
