"""Files of all sources, methods and seeds -> one tidy CSV, by the collector that the rule names."""

from gpca.attribution.metrics import write_metrics
from gpca.registry import load
from gpca.reporting.script import data_of, job

with job(snakemake):
    arguments = dict(snakemake.params.items())
    collect = load(arguments.pop("collector"))
    write_metrics(collect(**data_of(snakemake.input), **arguments), snakemake.output[0])
