"""Gradients of GP-CA's scores: points deleted by their saliency, and TCAV."""

from gpca.declarations.experiment import Experiment, LeftOut
from gpca.declarations.plan import Run
from gpca.declarations.result import Frame, Paths, numbers, table
from gpca.declarations.step import Step, encoder_of
from gpca.encoders.registry import DIFFERENTIABLE, DGCNNOptions, EncoderSettings
from gpca.errors import InputError
from gpca.evaluation.measures import ALL, source_method_seed, tidy
from gpca.io.csv_file import read_numbers
from gpca.reporting.sheet import Row, Sheet, Show, crossed, mean_over_seeds, where
from gpca.reporting.tables.builder import mean_over
from gpca.reporting.tables.table import Cell, Column
from gpca.reporting.words import plural
from gpca.steps.gradients import DELETION_COLUMNS, RANDOM, GradientSettings


def check(config: dict, _left_out: LeftOut) -> None:
    encoder = EncoderSettings(**encoder_of(config))
    if encoder.backbone != "dgcnn":
        return
    share, neighbors = max(config["gradients"]["deleted"]), encoder.options.get("k", DGCNNOptions.k)
    if round((1 - share) * encoder.draw_points) < neighbors:
        fault = f"deleting {share:g} of {encoder.draw_points} points leaves fewer than the encoder's {neighbors}"
        raise InputError("config key gradients.deleted", fault, "delete fewer")


EXPERIMENT = Experiment(
    name="gradients",
    sections={"gradients": GradientSettings},
    needs=("gradient_source",),
    names=lambda config, sources: {
        "gradient_source": list(sources) if encoder_of(config)["backbone"] in DIFFERENTIABLE else [],
        "gradient_encoder": config["embedding"]["encoder"],
    },
    check=check,
)

FOLLOW = Step(
    name="follow_gradients",
    run="gpca.steps.gradients",
    inputs={
        "registrations": "registrations/{source}/seed{*seed}.npz",
        "encoders": "encoders/{source}/{gradient_encoder}/seed{*seed}.pt",
        "embeddings": "embeddings/{source}/{gradient_encoder}/none/seed{*seed}.npz",
    },
    outputs={"deletions": "saliency/{source}/seed{*seed}.csv", "tcav": "tcav/{source}/seed{*seed}.csv"},
    settings=lambda plan, wildcards: {
        "gradients": plan.config["gradients"],
        "encoder": plan.encoder,
        "gpc": plan.config["explainers"].get("gpca") or {},
    },
    modules=lambda plan: [plan.encoder_module],
    where={"source": "gradient_source"},
    target="gradients",
)

SALIENCY, TCAV = "saliency", "tcav"  # the column `table`
TCAV_VALUES = ("score", "chance", "p", "significant", "probe")


@numbers(
    "gradients.csv",
    rule="gradient_metrics",
    deletions="saliency/{gradient_source}/seed{seed}.csv",
    tests="tcav/{gradient_source}/seed{seed}.csv",
)
def collect(run: Run, deletions: Paths, tests: Paths) -> Frame:
    """Fall of the score by order and share of deleted points, and TCAV's tests, by source and seed."""
    records: list[tuple] = []
    for path in deletions:
        _, source, seed = source_method_seed(path)
        rows = read_numbers(path, DELETION_COLUMNS, ("deleted", "before", "after", "changed"))
        rows["drop"] = rows["before"] - rows["after"]
        means = rows.groupby(["order", "deleted"], sort=False)[["drop", "changed"]].mean()
        for (order, deleted), row in means.iterrows():
            values = dict(row)
            if order != RANDOM and (RANDOM, deleted) in means.index:
                values["excess"] = row["drop"] - means.loc[(RANDOM, deleted), "drop"]
            for name, value in values.items():
                records.append((SALIENCY, source, order, f"{name}_{100 * deleted:g}", ALL, seed, float(value)))
        records += [
            (SALIENCY, source, order, "test_samples", ALL, seed, float(part["sample"].nunique()))
            for order, part in rows.groupby("order", sort=False)
        ]
    for path in tests:
        _, source, seed = source_method_seed(path)
        rows = read_numbers(path, ("tested", "concept", *TCAV_VALUES), TCAV_VALUES)
        records += [
            (TCAV, source, row["tested"], value, row["concept"], seed, float(row[value]))
            for _, row in rows.iterrows()
            for value in TCAV_VALUES
        ]
    return tidy(records, "gradients")


SECTION = "Beyond the paper: what explainers look at, and whether it carries over"


@table(
    SECTION,
    "Deleting the most salient points",
    """How much the score of the concept that GP-CA names falls when points are deleted. A saliency map that shows what
    matters makes it fall more than deleting as many points at random.""",
    needs=("gradient_source",),
    metrics="gradients.csv",
)
def saliency_deletion(run: Run, metrics):
    columns: dict[str, Column] = {}
    for percent in [f"{100 * share:g}" for share in run.config["gradients"]["deleted"]]:
        drop, limits = f"drop_{percent}", (-100, 100)
        excess, changed = f"excess_{percent}", f"changed_{percent}"
        columns[drop] = Show(f"Fall without {percent} % (points)", where={"metric": drop}, limits=limits)
        columns[excess] = Show(f"beyond random, {percent} %", where={"metric": excess}, limits=limits, beside=drop)
        columns[changed] = Show(f"Named otherwise (%), {percent} %", where={"metric": changed}, interval=False)
    rows = crossed(("source", run.source_titles), ("method", ORDERS))
    heads, numbers_of_table = {"source": "Dataset", "order": "Deleted"}, where(metrics, {"table": SALIENCY})
    sheet = Sheet("saliency_deletion", heads, rows, columns, numbers_of_table, cell=mean_over_seeds)
    notes = (
        f"{mean_over(sheet.seeds, run.config['gradients']['samples'])}; one draw of points of each sample.",
        "Fall: of the score of the concept named on the whole draw, in hundredths; in brackets the excess over "
        "random deletion. To the center: in the order of how much moving a point to the center changes the score "
        "(Zheng et al. 2019). At random: mean of four orders.",
    )
    caption = "Fall of GP-CA's score without some of the points" + sheet.stand_in_clause(run.sources, partly=False)
    return sheet.table(caption, "quantity", notes, keep_empty=True)


ORDERS = {
    "gradient": "Most salient first",
    "to_centre": "Most salient first (to the center)",
    "random": "At random",
    "least_gradient": "Least salient first",
}


@table(
    SECTION,
    "TCAV: which concepts the classes of GP-CA rely on",
    """The share of a class's test samples (columns) for which moving the embedding along a concept (rows) raises the
    log odds of that class, with a test against random directions. TCAV describes a whole class, not a sample; the
    concept activation vectors of the extended Table I use the same vectors sample by sample.""",
    needs=("gradient_source",),
    metrics="gradients.csv",
)
def tcav(run: Run, metrics):
    tests = where(metrics, {"table": TCAV})
    columns: dict[str, Column] = {}
    for name in dict.fromkeys(tests["concept"]):
        of_class = {"metric": "score", "concept": name}
        columns[f"score_{name}"] = Show(f"Class {name} (%)", where=of_class, of_samples=False)
        columns[f"significant_{name}"] = Column(f"seeds, {name}", decimals=0, interval=False)
    columns["probe"] = Show("Probes right (%)", where={"metric": "probe"})

    def significant(_row: Row, subset: Frame) -> dict[str, Cell]:
        by_class = where(subset, {"metric": "significant"}).groupby("concept")["value"]
        return {f"significant_{name}": Cell(float(each.sum()), 0.0, len(each), 0) for name, each in by_class}

    rows = crossed(("source", run.source_titles), ("method", {name: name for name in tests["method"]}))
    heads = {"source": "Dataset", "tested": "Concept"}
    sheet = Sheet("tcav", heads, rows, columns, tests, more=significant, cell=mean_over_seeds)
    settings = run.config["gradients"]
    notes = (
        f"Means over {plural(sheet.seeds, 'seed')}; {settings['vectors']} probes for each concept.",
        "Score: share of the test samples of the class whose log odds of it grow along the concept; about half "
        "if there is no relation. Seeds: in how many of them it differs from the scores of random probes, at the "
        f"level {settings['level']:g} over all tests of a seed (Bonferroni). Probes right: accuracy on training "
        "samples that the probe did not learn, the mean of those with and without the concept.",
    )
    caption = "TCAV's scores for GP-CA" + sheet.stand_in_clause(run.sources, partly=False)
    return sheet.table(caption, "quantity", notes, keep_empty=True)
