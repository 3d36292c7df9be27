"""Files of all sources, methods and seeds -> one tidy CSV, by the collector that the rule names."""

from gpca.evaluation.measures import write_metrics
from gpca.process.job import files_by_name, workflow_script
from gpca.registry import load

with workflow_script(snakemake):
    arguments = dict(snakemake.params.items())
    collect = load(arguments.pop("collector"))
    write_metrics(collect(**files_by_name(snakemake.input), **arguments), snakemake.output[0])
