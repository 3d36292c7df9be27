"""Objects of one source -> one picture of each."""

from gpca.reporting.figures.contact_sheet import draw_contact_sheet
from gpca.reporting.script import job

with job(snakemake):
    draw_contact_sheet(snakemake.input.objects, snakemake.params.title, snakemake.output.pdf, snakemake.output.png)
