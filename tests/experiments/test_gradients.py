"""Saliency maps and the tables of deleted points and of TCAV."""

import pytest

from gpca.declarations.plan import Run
from gpca.experiments.gradients import collect, saliency_deletion, tcav

RUN = Run(
    {
        "sources": {"tiny": {"title": "Tiny", "stand_in": False}},
        "figures": {"source": "tiny"},
        "gradients": {"samples": 3, "deleted": [0.25], "vectors": 2, "level": 0.05},
    }
)
DELETIONS = """sample,concept,named,order,deleted,before,after,changed
0,noise,noise,gradient,0.25,0.9,0.5,1
0,noise,noise,random,0.25,0.9,0.8,0.25
3,pose,pose,gradient,0.25,0.8,0.6,0
3,pose,pose,random,0.25,0.8,0.8,0
"""
TESTED = """tested,concept,score,chance,p,significant,probe
noise,noise,1.0,0.5,0.001,1,0.9
noise,pose,0.25,0.5,0.3,0,0.9
"""


@pytest.fixture
def metrics(tmp_path):
    files = []
    for kind, text in (("saliency", DELETIONS), ("tcav", TESTED)):
        for seed in (0, 1):
            path = tmp_path / kind / "tiny" / f"seed{seed}.csv"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            files.append(path)
    return collect(RUN, files[:2], files[2:])


def value(metrics, **wanted):
    for name, entry in wanted.items():
        metrics = metrics[metrics[name] == entry]
    return metrics["value"].tolist()


def test_the_fall_is_that_of_the_score_and_its_excess_against_random(metrics):
    assert value(metrics, method="gradient", metric="drop_25") == pytest.approx([0.3, 0.3])
    assert value(metrics, method="gradient", metric="excess_25") == pytest.approx([0.25, 0.25])
    assert value(metrics, method="gradient", metric="changed_25") == [0.5, 0.5]
    assert value(metrics, method="random", metric="excess_25") == []
    assert value(metrics, method="random", metric="test_samples") == [2, 2]
    assert value(metrics, table="tcav", method="noise", concept="pose", metric="score") == [0.25, 0.25]
    text = saliency_deletion(RUN, metrics).markdown()
    assert "| Tiny | Most salient first | 30.0 (+25.0) | 50.0 |" in text
    text = tcav(RUN, metrics).markdown()
    assert "| Tiny | noise | 100.0 | 2 | 25.0 | 0 | 90.0 |" in text
