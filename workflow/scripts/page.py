"""What was found, every table and figure, the comparison and some registrations -> index.html, and the RO-Crate."""

from pathlib import Path

from gpca.jobs.job import workflow_script
from gpca.page.crate import write_crate
from gpca.page.findings import Titles
from gpca.page.page import FinishedRun, Shown, write_page

with workflow_script(snakemake):
    given, files = snakemake.params, snakemake.input
    samples = {
        source: {"registrations": registrations, "predictions": predictions}
        for source, registrations, predictions in zip(
            given.samples, files.registrations, files.predictions, strict=True
        )
    }
    for source, uncertainty in zip(given.uncertain, files.uncertainty, strict=True):
        samples[source]["uncertainty"] = uncertainty
    causes = {
        source: {"objects": objects, "causes": causes}
        for source, objects, causes in zip(given.measured, files.objects, files.causes, strict=True)
    }
    run = FinishedRun(
        name=given.run,
        seeds=given.config["seeds"],
        sources=given.sources,
        results=[Shown(*fields) for fields in given.shown],
        samples=samples,
        causes=causes,
        titles=Titles(**given.titles),
        reference=next(iter(files.reference), None),
        config=given.config,
        command=f"snakemake -j2 {snakemake.output.page}",
    )
    folder = Path(snakemake.output.page).parent
    write_page(folder, run)
    write_crate(folder, run.name, [source["title"] for source in run.sources.values()], run.seeds)
