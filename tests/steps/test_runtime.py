import numpy as np

from gpca.active_learning.rounds import make_task
from gpca.active_learning.settings import ActiveLearningSettings
from gpca.classifier.settings import GPCSettings
from gpca.evaluation.runtime_file import COMPONENTS
from gpca.steps.runtime import measure


def test_every_component_is_measured_so_often_and_an_explanation_takes_longer_than_its_embedding(model, registrations):
    from dataclasses import replace

    h_S_d = np.random.default_rng(0).normal(size=(len(registrations), 32)).astype(np.float32)
    settings = ActiveLearningSettings(initial=8, batch=2, gpc=GPCSettings(iterations=3, inducing=6, draws=20))
    task = make_task(replace(registrations, attached={"embedding": h_S_d}), "overlap", settings, "tiny", 0)
    runtime = measure(model, registrations, task, settings, 3, 1, "tiny", 0)
    on_cpu = runtime[runtime["device"] == "CPU"]
    assert on_cpu["component"].tolist() == list(COMPONENTS)
    assert (runtime["repeats"] == 3).all()
    assert (runtime[["mean_s", "median_s"]] > 0).all(axis=None)
    assert on_cpu["hardware"].str.endswith("cores").all()
    median_s = runtime.drop_duplicates("component").set_index("component")["median_s"]
    assert median_s["explanation"] > median_s["features"]
