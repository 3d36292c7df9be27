"""Every table and figure, the comparison and some registrations -> index.html."""

from pathlib import Path

from gpca.reporting.page.page import Run, Shown, write_page
from gpca.reporting.script import job

with job(snakemake):
    given, files = snakemake.params, snakemake.input
    run = Run(
        name=given.run,
        seeds=given.config["seeds"],
        sources=given.sources,
        results=[Shown(*fields) for fields in given.shown],
        samples=dict(zip(given.samples, zip(files.registrations, files.predictions, strict=True), strict=True)),
        config=given.config,
        command=f"snakemake -j2 {snakemake.output.page}",
    )
    write_page(Path(snakemake.output.page).parent, run)
