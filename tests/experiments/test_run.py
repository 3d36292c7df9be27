"""What a run consists of, worked out from the config that the suite ships."""

import inspect
from copy import deepcopy

import pytest

from gpca.config.check import check
from gpca.config.layers import without_false
from gpca.declarations.plan import Run
from gpca.declarations.registry import results_of
from gpca.experiments.claims import compared_sources
from gpca.experiments.run import explainer_of, files_behind, names_of
from gpca.objects.entry import title_of
from gpca.process.registry import load as load_function

from ..config.configs import load


@pytest.fixture(scope="module")
def config():
    return without_false(load())


@pytest.fixture(scope="module")
def sources(config):
    return check(deepcopy(config))


def test_every_place_that_the_registry_names_is_there_and_only_readers_of_many_files_are_given_a_list(config, sources):
    names = names_of(config, sources)
    for result in results_of(names):
        files = result.files(names)
        assert all(files.values())
        for given in result.inputs:
            if given.read:
                taken = next(iter(inspect.signature(load_function(given.read)).parameters.values()))
                many = any(word in str(taken.annotation) for word in ("Iterable", "Paths", "Sequence", "list"))
                assert isinstance(files[given.argument], list) == many, f"{result.name}: {given.argument}"


def test_tables_of_what_a_run_leaves_out_are_not_made(config, sources):
    smaller = deepcopy(config)
    smaller["explainers"] = {"softmax_head": {}}
    made = {result.name for result in results_of(names_of(smaller, sources))}
    assert not made & {"table1_single_baselines", "table2_per_concept", "fig2_overview", "fig4_pipeline"}
    assert "table1_extended" in made


@pytest.mark.parametrize("change", [{"iterations": [10]}, {"learning_rates": [0.1]}, {"kernels": []}])
def test_a_grid_without_any_printed_row_has_no_table4_kernels(config, sources, change):
    other = deepcopy(config)
    other["kernel_grid"] |= change
    made = {result.name for result in results_of(names_of(other, sources))}
    assert "table4_kernels" not in made
    assert "kernel_learning_curves" in made


def test_the_rows_of_table_6_are_gp_ca_on_their_own_embeddings(config, sources):
    names = names_of(config, sources)
    assert explainer_of("pointnet-pca", names) == "gpca"
    assert explainer_of("residuals_forest", names) == "residuals_forest"
    assert files_behind("pointnet-pca", names) == {
        "input_timings": "timings/{source}/pointnet/seed{seed}.csv",
        "embeddings": "embeddings/{source}/pointnet/pca/seed{seed}.npz",
    }
    assert files_behind("gpca", names)["embeddings"] == "embeddings/{source}/dgcnn/none/seed{seed}.npz"
    assert files_behind("shap_oracle", names) == {  # it is given its design of uncertainties
        "input_timings": "timings/{source}/icp/seed{seed}.csv",
        "uncertainty": "uncertainty/{source}/oracle/seed{seed}.npz",
        "uncertainty_timings": "timings/{source}/uncertainty_oracle/seed{seed}.csv",
    }


def test_a_stand_in_says_so_wherever_its_title_stands():
    stand_ins = without_false(load("stand_ins"))
    check(deepcopy(stand_ins))
    assert all("procedural stand-in" in title_of(entry) for entry in compared_sources(Run(stand_ins)).values())
