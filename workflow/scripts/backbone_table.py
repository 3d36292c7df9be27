"""Metrics of every backbone and reduction -> table6_backbones as CSV, Markdown, LaTeX."""

from gpca.attribution.metrics import read_metrics
from gpca.encoders.registry import make_encoder, parameter_count
from gpca.reporting.script import job
from gpca.reporting.tables.backbones import table6_backbones

with job(snakemake):
    given = snakemake.params
    backbones = {
        name: parameter_count(make_encoder(encoder["backbone"], encoder.get("options", {})))
        for name, encoder in given.backbones.items()
    }
    metrics = read_metrics(snakemake.input.metrics)
    table = table6_backbones(metrics, given.title, backbones, given.reductions)
    table.write(snakemake.output.csv, snakemake.output.md, snakemake.output.tex)
