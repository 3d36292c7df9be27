"""Every table and figure, the comparison and some registrations -> index.html."""

from pathlib import Path

from gpca.reporting.page.page import Run, write_page
from gpca.reporting.script import job

with job(snakemake):
    given = snakemake.params
    folder = Path(snakemake.output.page).parent
    run = Run(
        name=snakemake.wildcards.run,
        seeds=given.config["seeds"],
        sources=given.sources,
        tables=given.shown["tables"],
        figures=given.shown["figures"],
        samples=given.samples,
        config=given.config,
        command=f"snakemake -j2 {snakemake.output.page}",
    )
    write_page(folder, Path(snakemake.input.captions[0]).parent, run)
