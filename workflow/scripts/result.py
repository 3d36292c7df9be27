"""Files of a run -> a table of the registry as CSV, Markdown, LaTeX and JSON, or a figure as PDF and PNG."""

from pathlib import Path

from gpca.process.job import files_by_name, workflow_script
from gpca.reporting.figures.style import save_figure
from gpca.reporting.registry import build

with workflow_script(snakemake):
    entry, out = snakemake.params, snakemake.output
    made = build(entry.builder, entry.readers, files_by_name(snakemake.input), entry.arguments)
    if entry.kind == "tables":
        made.write(Path(out.csv).with_suffix(""))
    else:
        save_figure(made, out.pdf, out.png)
