"""Files of a run -> a table of the registry as CSV, Markdown, LaTeX and JSON, or a figure as PDF and PNG."""

from pathlib import Path

from gpca.reporting.figures.style import save_figure
from gpca.reporting.registry import build
from gpca.reporting.script import data_of, job

with job(snakemake):
    entry, out = snakemake.params, snakemake.output
    made = build(entry.builder, entry.readers, data_of(snakemake.input), entry.arguments)
    if entry.kind == "tables":
        made.write(Path(out.csv).with_suffix(""))
    else:
        save_figure(made, out.pdf, out.png)
