"""Files of all sources, methods and seeds -> CSV files of numbers, by the collector that the rule names."""

from gpca.declarations.plan import READ, Recorded, Run
from gpca.evaluation.measures import write_metrics
from gpca.experiments.run import names_of
from gpca.jobs.job import files_by_name, workflow_script
from gpca.process.registry import load

with workflow_script(snakemake) as added:
    collect, token = load(snakemake.params.collector), snakemake.params.config
    config = Recorded(snakemake.config)
    made = collect(*([Run(config, names_of=names_of)] if token else []), **files_by_name(snakemake.input))
    if token:
        added[READ] = config.record(token)
    frames = made if isinstance(made, (tuple, list)) else [made]
    for frame, path in zip(frames, snakemake.output, strict=True):
        write_metrics(frame, path)
