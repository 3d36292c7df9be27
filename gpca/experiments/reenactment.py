"""The figure of a re-enactment (docs/causes.md)."""

from gpca.causes.settings import CauseSettings
from gpca.declarations import Experiment, Run, figure
from gpca.experiments.cause_figures import draw_reenactment
from gpca.experiments.cause_tables import SECTION
from gpca.objects.entry import dataset_of
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import read_settings

EXPERIMENT = Experiment(name="reenactment")


@figure(
    SECTION,
    "One failed registration, re-enacted by an observer",
    """Above, what ICP made of the observed cloud, where the likeliest hypothesis of the true pose puts it in the model,
    with its probability, and the clouds that are rebuilt there. Below, the mean error of registrations with each
    subset of the causes: measured, with the truth (bars), and re-enacted under each hypothesis (marks, the larger the
    more probable). The title says which cause these errors name. Shown is the failed test sample of median margin
    with several causes and several hypotheses.""",
    after="causes_example",
    objects_npz="objects/{shown_source}.npz",
    causes_npz="causes/{shown_source}/seed{first_seed}.npz",
    reenactments_npz="reenactments/{shown_source}/seed{first_seed}.npz",
)
def reenactment(run: Run, objects_npz, causes_npz, reenactments_npz):
    source = run.config["figures"]["source"]
    truth = CauseSettings.from_dict(dict(run.config["causes"]), dict(run.config["registrations"]["icp"]))
    settings = read_settings(ReenactmentSettings, dict(run.config["diagnosis"]["reenactment"]))
    shown = run.source_titles[source], dataset_of(run.config["sources"][source])
    return draw_reenactment(objects_npz, causes_npz, reenactments_npz, truth, settings, *shown)
