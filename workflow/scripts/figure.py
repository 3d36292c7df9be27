"""Files of a run -> a figure of the registry as PDF and PNG."""

from gpca.reporting.registry import build
from gpca.reporting.script import data_of, job

with job(snakemake):
    given, out = snakemake.params, snakemake.output
    paths = {"pdf_path": out.pdf, "png_path": out.png}
    build(given.builder, given.readers, data_of(snakemake.input), {**given.arguments, **paths})
