import re

import pytest

from gpca.__main__ import main
from gpca.config import check as run_config
from gpca.config.check import check
from gpca.config.layers import with_types
from gpca.errors import InputError

from .configs import MISSING, changed, load, merged

NAN = float("nan")


@pytest.mark.parametrize("name", ["config", "smoke", "full", "stand_ins", "bop"])
def test_the_shipped_configs_are_sound(name):
    sources = run_config.check(load(name))
    assert list(sources) == (["coffee_cup", "ycb"] if name == "smoke" else ["coffee_cup", "linemod", "ycb"])
    for entry in sources.values():
        assert entry["stand_in"] == (name in ("smoke", "stand_ins"))
        assert entry["origin"] == {"config": "local", "full": "local", "bop": "download"}.get(name, "procedural")


def test_the_development_config_has_no_object_and_no_scene_of_the_evaluation():
    config = load("development")
    sources = run_config.check(config)
    assert list(sources) == ["ycb_development"]
    assert config["splits"]["role"] == "development"
    assert min(config["seeds"]) >= 100


def test_local_data_comes_before_the_download(tmp_path):
    (tmp_path / "bop/lm/models").mkdir(parents=True)
    for number in range(1, 16):
        (tmp_path / f"bop/lm/models/obj_{number:06d}.ply").write_text("ply")
    (tmp_path / "bop/lm/test/000001").mkdir(parents=True)
    (tmp_path / "bop/lm/test/000001/scene_gt.json").write_text("{}")
    linemod, ycb = map(run_config.check(load("bop") | {"data_dir": str(tmp_path)}).get, ("linemod", "ycb"))
    assert (linemod["origin"], linemod["location"], ycb["origin"]) == ("local", str(tmp_path / "bop/lm"), "download")


def folder(**more):
    return {"title": "Mine", "kind": "mesh_folder", "location": "/", "unit": "mm"} | more


LINK = {"title": "Mine", "kind": "mesh_folder", "unit": "mm", "url": "https://a.org/b.zip"}
FAULTS = [
    # unknown keys, with a hint
    ("sedes", [1], "sedes: unknown; did you mean seeds?"),
    ("zzz", 1, "zzz: unknown; choose one of run, data_dir, "),
    ("registrations.trian", 5, "registrations.trian: unknown; did you mean train?"),
    ("encoders.dgcnn.options.kk", 3, "encoders.dgcnn: option kk: unknown; did you mean k?"),
    ("reductions.tsne", {}, "reductions.tsne: unknown; choose one of none, pca, umap, autoencoder"),
    ("explainers.gpca.iteratons", 3, "setting iteratons: unknown; did you mean iterations?"),
    ("sources.ycb.famly", "ycb", "sources.ycb.famly: unknown; did you mean family?"),
    ("comparison.tolerances.labels.close", 1, "comparison.tolerances.labels: tolerance: 1.5 and 1; must satisfy 1 <="),
    ("comparison.tolerances.weeks", {"reproduced": 1, "close": 2}, "comparison.tolerances.weeks: unknown; choose one"),
    ("reference.tolerances.share", -1, "reference.tolerances.share: -1 should be greater than or equal to 0"),
    ("recovery.thresholds.improvement", 0.5, "recovery.thresholds: recovery thresholds: improvement 0.5 is not below"),
    ("recovery.policies", ["gpac"], "recovery.policies: recovery policy 'gpac': unknown; choose one of gpca, "),
    ("recovery.treatments.noise", "pray", "recovery.treatments.noise: no action 'pray'; choose one of reinitialize, "),
    ("recovery.treatments.noise", "new_view", "recovery.treatments: one action treats two concepts"),
    ("recovery.actions.pray", {}, "recovery.actions.pray: recovery action 'pray': unknown; choose one of reinitializ"),
    ("recovery.actions.denoise", {"framse": 3}, "recovery.actions.denoise: recovery action 'denoise': setting framse"),
    ("recovery.objects", "ycbv", "recovery.objects: no source 'ycbv'; choose one of coffee_cup, linemod, ycb"),
    ("recovery.costs", {"denoise": 0.1, "new_view": 0.1}, "recovery.costs: lacks the action 'reinitialize'"),
    ("recovery.costs.pray", 0.1, "recovery.costs: no action 'pray'; choose one of reinitialize, "),
    ("recovery.hidden", [0.9, 0.5], "recovery: recovery.hidden: [0.9, 0.5] is in descending order"),
    ("active_learning.strategies", ["bold"], "active_learning.strategies: no strategy 'bold'; choose one of random, "),
    ("frame_labels.initial", 200, "frame_labels.initial: 200 labeled samples of two concepts leave none of 120"),
    ("frame_labels.targets", [0.7, 0.701], "frame_labels.targets: two are equal in whole percent"),
    ("real_world.backbones", ["dgcnn", "pointnet3"], "real_world.backbones: no encoder 'pointnet3'; choose one of dg"),
    ("real_world.datasets", {}, "real_world.virtual: needs real_world.datasets: it renders their models"),
    ("real_world.virtual", {"count": 4, "views": 1}, "real_world.virtual.objects: is missing; add it, as in config/c"),
    ("real_world.virtual.objects", "tested", "real_world.virtual.objects: 'tested' should be 'training' or 'all'"),
    ("real_world.scenes.distance_m", [0.9, 0.6], "real_world.scenes: scenes distance_m: [0.9, 0.6] is in descending "),
    ("real_world.scenes.families", ["tools"], "real_world.scenes.families: family 'tools': no such procedural family"),
    ("real_world.datasets", {"lm": {"location": "lost"}}, "real_world.datasets: source 'lm': lost does not exist"),
    ("real_world.datasets", {"lm": {}}, "real_world.datasets.lm.location: is missing; add it, as in config/config.ya"),
    ("real_world.initial_pose.form", "guess", "real_world.initial_pose.form: 'guess' should be 'results', "),
    ("real_world.reductions", ["tsne"], "real_world.reductions.0: 'tsne' should be "),
    ("sources.real_rgbd", folder(), "sources.real_rgbd: is reserved for the frames of real_world"),
    ("methods.icp", {}, "methods.icp: registration method 'icp': unknown; choose one of point_to_point, "),
    ("methods.gicp.voxel", 0.1, "methods.gicp: registration method 'gicp': setting voxel: unknown"),
    ("methods.huber.kernel", "Huber", "methods.huber: registration method 'huber': setting kernel: unknown"),
    ("methods", {}, "methods: {} should have at least 1 item"),
    ("exchange.methods", ["icp"], "exchange.methods: no registration method 'icp'; choose one of point_to_point, "),
    ("exchange.explainers.shap_removal", {}, "explainer 'shap_removal': reads design 'removal', which"),
    ("estimators.gauss", {}, "estimators.gauss: estimator 'gauss': unknown; choose one of bonnabel, "),
    ("estimators.censi.sigma", 1, "estimators.censi: estimator 'censi': setting sigma: unknown"),
    ("estimators.stein_icp.steps", -1, "estimators.stein_icp: estimator 'stein_icp': setting steps: -1 should be gre"),
    ("estimator_pairs.methods", {"fgr": 3}, "estimator_pairs.methods.fgr: registration method 'fgr': is global, so"),
    ("estimator_pairs.methods", {}, "estimator_pairs.methods: is empty"),
    ("method_pairs.samples", 20, "method_pairs.samples: 20 should be a multiple of 3"),
    ("method_pairs.global_start", "gicp", "method_pairs.global_start: registration method 'gicp': needs an init"),
    ("learning_curve.sizes", [99999], "learning_curve.sizes: 99999 is more than the "),
    ("shift.severities.crops", [0.6, 0.7], "shift.severities.crops: unknown; did you mean crop?"),
    # missing keys
    ("seeds", MISSING, "seeds: is missing; add it"),
    ("sources.ycb.kind", MISSING, "sources.ycb.kind: is missing; add it, as in config/config.yaml"),
    ("sources.my", {key: folder()[key] for key in ("title", "kind", "location")}, "sources.my: unit: is missing; say"),
    # wrong types
    ("registrations.train", "many", "registrations.train: 'many' should be a valid integer"),
    ("registrations.train", 36.0, "registrations.train: 36.0 should be a valid integer"),
    ("registrations.train", True, "registrations.train: True should be a valid integer"),
    ("registrations", None, "registrations: None should be an object"),
    ("registrations.severities.crop", 0.2, "registrations.severities.crop: 0.2 should be a valid array"),
    ("registrations.severities.crop", ["a", 0.2], "registrations.severities.crop.0: 'a' should be a valid number"),
    ("explainers.gpca", [1], "explainers.gpca: [1] should be an object"),
    # out of range
    ("kernel_grid.kernels", ["cubic"], "kernel_grid.kernels.0: 'cubic' should be "),
    ("learners.gpca", {"draws": 0}, "setting draws: 0 should be greater than or equal to 2"),
    ("registrations.severities.crop", [0.2], "registrations.severities.crop: [0.2] is too short"),
    ("registrations.severities.noise", [NAN, 0.2], "registrations.severities.noise.0: nan should be a finite number"),
    ("registrations.severities.crop", [0.6, 0.2], "severity crop: [0.6, 0.2] is in descending order; swap the two"),
    ("registrations.icp.method", "icp2", "registrations.icp.method: 'icp2' should be 'point_to_point', "),
    ("registrations.icp.correspondence_distance", 0, "registrations.icp.correspondence_distance: 0 should be greater"),
    ("registrations.icp.method", "generalized", "is 'generalized', but uncertainty and causes are measured by reruns"),
    ("methods.trimmed.overlap", 5, "setting overlap: 5 should be less than or equal to 1"),
    ("encoders.pointnext.options.radius", 0, "encoders.pointnext: option radius: 0 should be greater than 0"),
    ("explainers.gpca.kernel", "cubic", "setting kernel: 'cubic' should be 'rbf', 'matern32' or 'polynomial'"),
    ("seeds", [], "seeds: is empty; name at least 1"),
    ("seeds", [0, 1, 0], "seeds: [0, 1, 0] holds a value twice; keep one of them"),
    ("run", "../elsewhere", "run: '../elsewhere' should match pattern"),
    # names of what does not exist
    ("encoders.dgcnn.backbone", "dgcn", "encoders.dgcnn.backbone: backbone 'dgcn': unknown; choose one of dgcnn"),
    ("embedding.encoder", "voxelnet", "embedding.encoder: no encoder 'voxelnet'; choose one of dgcnn"),
    ("explainers.shapley", {}, "explainers.shapley: explainer 'shapley': unknown; choose one of gpca_paper, gpca"),
    ("figures.source", "ycbv", "figures.source: no source 'ycbv'; choose one of coffee_cup, linemod, ycb"),
    ("model.source", "lab", "model.source: no source 'lab'; choose one of coffee_cup, linemod, ycb, real_rgbd"),
    ("learners.learner_forest", {"tree": 3}, "learners.learner_forest: explainer 'learner_forest': setting tree: unk"),
    ("learners.residuals_forest", {}, "learners.residuals_forest: does not read embeddings; choose another"),
    # sources
    ("sources.ycb.kind", "procedurl", "sources.ycb: kind 'procedurl': is not a kind of source; choose one of"),
    ("sources.My", folder(), "sources.My: 'My' should match pattern"),
    ("sources.my", folder(location="lost"), "sources.my: source 'Mine': lost does not exist; correct location, or se"),
    ("sources.my", folder(unit="inch"), "sources.my.unit: 'inch' should be 'm', 'cm' or 'mm'"),
    ("sources.my", LINK | {"url": "ftp://a.org/b.zip"}, "sources.my.url: 'ftp://a.org/b.zip' should match pattern"),
    ("sources.my", LINK | {"sha256": "abc"}, "sources.my.sha256: 'abc'"),
    ("sources.my", LINK | {"sha256": ["0" * 64, "1" * 64]}, "sources.my: source 'Mine': has 1 url(s) but 2 sha256"),
    ("data_dir", "/nowhere/at/all", "/nowhere/at/all: no such folder; correct data_dir in the config"),
]


@pytest.mark.parametrize(
    ("key", "value", "message"), FAULTS, ids=[f"{key}-{i}" for i, (key, _, _) in enumerate(FAULTS)]
)
def test_a_fault_is_one_line_that_names_the_key(key, value, message):
    with pytest.raises(InputError) as caught:
        run_config.check(changed(key, value))
    line = str(caught.value)
    assert line.startswith("config key ")
    assert message in line
    assert "\n" not in line


def test_the_command_lists_all_faults_with_their_files(tmp_path, capsys):
    (tmp_path / "first.yaml").write_text("seedz: [1]\ncauses: {train: -5}\n")
    (tmp_path / "other.yaml").write_text("causes: {points: 7}\n")
    assert main(["check-config", *map(str, sorted(tmp_path.glob("*.yaml")))]) == 2
    lines = [line.removeprefix(f"gpca check-config: {tmp_path}/") for line in capsys.readouterr().err.splitlines()]
    assert lines == [
        "first.yaml: config key seedz: unknown; did you mean seeds?",
        "first.yaml: config key causes.train: -5 should be greater than or equal to 12",
        "other.yaml: config key causes.points: 7 should be a valid array; give a list: [7]",
    ]
    # A setting of an explainer that several experiments ask is one fault; further ones are found beside it.
    (tmp_path / "first.yaml").write_text("explainers: {gpca: {bar: 1}}\nfigures: {source: nowhere}\n")
    assert main(["check-config", str(tmp_path / "first.yaml")]) == 2
    keys = [line.split(": ")[2] for line in capsys.readouterr().err.splitlines()]
    assert keys == ["config key explainers.gpca", "config key figures.source"]


FAULTS_OF_STAND_INS = [
    ({"sources": {"ycb": {"family": "ycbb"}}}, "sources.ycb: family 'ycbb': no such procedural family; choose one "),
    ({"sources": {"ycb": {"family": ""}}}, "sources.ycb: source 'YCB': names no family"),
    ({"real_world": {"initial_pose": {"form": "results"}}}, "real_world.initial_pose: form 'results' needs a dataset"),
]


@pytest.mark.parametrize(("changes", "message"), FAULTS_OF_STAND_INS)
def test_a_fault_of_a_run_on_stand_ins_is_one_line_too(changes, message):
    with pytest.raises(InputError, match=re.escape(message)):
        run_config.check(merged(load("stand_ins"), changes))


def test_what_is_allowed_passes_and_an_explainer_whose_design_is_not_configured_does_not():
    run_config.check(changed("explainers.gpca", None))
    run_config.check(changed("registrations.severities.noise", [0, 0]))
    run_config.check(changed("encoders.other", {"backbone": "dgcnn"}))
    run_config.check(changed("sources.my", LINK | {"sha256": None}))
    asked = changed("explainers.shap_oracle", {})
    run_config.check(asked)
    del asked["uncertainty"]["oracle"]
    with pytest.raises(InputError, match=r"key explainers\.shap_oracle: no uncertainty 'oracle'; choose one of addit"):
        run_config.check(asked)


def given(**values):
    """The default config below values of the command line, which Snakemake reads as text inside lists and mappings."""
    return with_types(merged(load(), values), values)


def test_values_of_the_command_line_have_the_types_of_a_config_file_or_are_refused_in_one_line():
    registrations = {"train": "36", "severities": {"noise": ["0.01", "0.02"]}}
    values = {"seeds": ["0", "3"], "registrations": registrations, "sources": {"linemod": "false"}}
    config = given(**values, data_dir="null", run="mine")
    assert config["seeds"] == [0, 3]
    assert config["registrations"]["train"] == 36
    assert config["registrations"]["severities"]["noise"] == [0.01, 0.02]
    assert config["sources"]["linemod"] is False
    assert config["data_dir"] is None
    assert config["run"] == "mine"
    assert list(check(config)) == ["coffee_cup", "ycb"]
    with pytest.raises(InputError) as caught:
        check(given(seeds=0))
    assert str(caught.value) == "config key seeds: 0 should be a valid array; give a list: [0]"
