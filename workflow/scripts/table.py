"""Files of a run -> a table of the registry as CSV, Markdown and LaTeX."""

from gpca.reporting.registry import build
from gpca.reporting.script import data_of, job

with job(snakemake):
    given, out = snakemake.params, snakemake.output
    table = build(given.builder, given.readers, data_of(snakemake.input), given.arguments)
    table.write(out.csv, out.md, out.tex)
