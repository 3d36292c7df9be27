import copy

import pytest

from gpca.config.check import check
from gpca.config.layers import DEFAULTS, in_order, read_file, with_defaults, without_false
from gpca.errors import InputError

from .configs import CONFIG, MISSING, changed, load, merged


def test_rows_that_a_config_adds_stand_where_the_defaults_have_them():
    own = read_file(CONFIG / "full.yaml")
    own["controls"]["explainers"]["my_own"] = None
    given = merged(own, *map(read_file, DEFAULTS), own)  # as Snakemake does it, with the given keys first
    lower = with_defaults()
    usual = list(lower["controls"]["explainers"])
    assert next(iter(given["controls"]["explainers"])) == "gpca_pair_dgcnn"
    found = in_order(given)
    assert found == given
    assert list(found) == list(lower)
    assert list(found["controls"]["explainers"]) == [*usual, "my_own"]


@pytest.mark.parametrize(
    "key",
    [
        *(
            "sources.linemod",
            "encoders.pointnet2",
            "reductions.umap",
            "uncertainty.oracle",
            "explainers.shap_supervised",
        ),
        *("methods.trimmed", "estimators.stein_icp", "estimator_pairs.methods.point_to_plane"),
        *("learners.learner_forest", "recovery.policies.random", "active_learning.strategies.badge"),
    ],
)
def test_what_is_false_is_left_out_as_if_it_were_not_there(key):
    config, never_there = changed(key, False), changed(key, MISSING)
    if key == "uncertainty.oracle":
        config["explainers"]["shap_oracle"] = {}
    # The rows that need it.
    for section, names in (("kernel_grid", "sources"), ("cause_shifts", "sources"), ("controls", "hard_sources")):
        named = never_there[section][names]
        never_there[section][names] = [name for name in named if name in never_there["sources"]]
    for part in ("backbones", "training"):
        named = never_there["real_world"][part]
        there = [name for name in named if name in never_there["encoders"]]
        never_there["real_world"][part] = there if part == "backbones" else {name: named[name] for name in there}
    never_there["frame_labels"]["backbones"] = [n for n in ("dgcnn", "pointnet2") if n in never_there["encoders"]]
    never_there["real_world"]["reductions"] = ["none", *never_there["reductions"]]
    never_there["exchange"]["estimators"] = [
        name for name in never_there["exchange"]["estimators"] if name in never_there["estimators"]
    ]
    of_scans = never_there["scans"]["methods"]
    never_there["scans"]["methods"] = {name: of_scans[name] for name in of_scans if name in never_there["methods"]}
    if key == "uncertainty.oracle":
        del never_there["explainers"]["shap_oracle"]
    given = copy.deepcopy(config)
    assert without_false(config) == without_false(never_there)
    assert check(config) == check(never_there)
    assert config == given  # for a Snakemake that is given this config once more


def test_actions_and_uncertainties_take_their_policies_along():
    config = merged(load(), {"recovery": {"actions": {"new_view": False}, "treatments": {"overlap": "denoise"}}})
    recovery = without_false(config)["recovery"]
    assert list(recovery["actions"]) == ["reinitialize", "denoise"]
    assert "always_denoise" in recovery["policies"]
    assert "always_new_view" not in recovery["policies"]
    assert not any("new_view" in policy for policy in recovery["policies"])
    whole = without_false(changed("uncertainty.removal", False))
    assert "shap_removal" not in whole["recovery"]["policies"]
    assert not {"shap_removal", "shap_removal_residual", "sa_local_removal"} & set(whole["explainers"])
    check(changed("uncertainty.removal", False))


def test_switches_are_a_list_in_their_order_and_a_list_may_stand_in_their_place():
    strategies = without_false(changed("active_learning.strategies.entropy", False))["active_learning"]["strategies"]
    assert strategies[:4] == ["random", "random_stratified", "margin", "bald"]
    given = changed("active_learning.strategies", ["bald", "random"])
    assert without_false(given)["active_learning"]["strategies"] == ["bald", "random"]


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("methods.fgr", "method_pairs.global_start: registration method 'fgr' is left out; choose one of point_to_"),
        ("estimators.gauss", "estimators: no estimator 'gauss'; choose one of bonnabel, "),
        ("methods.icp", "methods: no registration method 'icp'; choose one of point_to_point, "),
        ("encoders.dgcnn", "embedding.encoder: encoder 'dgcnn' is left out; choose one of pointnet, "),
        ("sources.ycb", "exchange.sources: source 'ycb' is left out; choose one of coffee_cup, linemod"),
        ("sources.coffee_cup", "figures.source: source 'coffee_cup' is left out; choose one of linemod, ycb"),
        ("recovery.actions.denoise", "recovery.treatments.noise: action 'denoise' is left out; choose one of reinit"),
        ("uncertainty.causal", "uncertainty.causal: is missing; add it"),
        # Names of nothing.
        ("explainers.shap_orcale", "explainers: no explainer 'shap_orcale'; choose one of "),
        ("learners.learner_tree", "learners: no learner 'learner_tree'; choose one of "),
        ("reductions.tsne", "reductions: no reduction 'tsne'; choose one of none, pca, umap, autoencoder"),
        ("uncertainty.sobol", "uncertainty: no uncertainty 'sobol'; choose one of additive, "),
        ("active_learning.strategies.bold", "active_learning.strategies: no strategy 'bold'; choose one of random, "),
        ("recovery.policies.always_pray", "recovery.policies: no policy 'always_pray'; choose one of gpca, "),
        ("recovery.actions.pray", "recovery.actions: no action 'pray'; choose one of reinitialize, "),
    ],
)
def test_what_cannot_be_left_out_is_one_line_that_names_the_key(key, message):
    with pytest.raises(InputError) as caught:
        check(changed(key, False))
    assert str(caught.value).startswith(f"config key {message}")
