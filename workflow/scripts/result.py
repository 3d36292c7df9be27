"""Files of a run -> a table of the registry as CSV, Markdown and JSON, or a figure as PDF and PNG."""

from pathlib import Path

from gpca.declarations.plan import READ, Recorded, Run
from gpca.experiments.run import names_of
from gpca.jobs.job import files_by_name, workflow_script
from gpca.reporting.figures.style import save_figure
from gpca.reporting.registry import build

with workflow_script(snakemake) as added:
    entry, out = snakemake.params, snakemake.output
    config = Recorded(snakemake.config)
    run = Run(config, entry.only, names_of)
    made = build(entry.builder, entry.readers, files_by_name(snakemake.input), entry.arguments, run)
    added[READ] = config.record(entry.config)
    if entry.kind == "tables":
        made.write(Path(out.csv).with_suffix(""))
    else:
        save_figure(made, out.pdf, out.png)
