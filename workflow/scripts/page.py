"""What was found, every table and figure, the comparison and some failures -> index.html, and the RO-Crate."""

from pathlib import Path

from gpca.jobs.job import workflow_script
from gpca.page.crate import write_crate
from gpca.page.findings import Titles
from gpca.page.page import FinishedRun, Shown, write_page

with workflow_script(snakemake):
    given, files = snakemake.params, snakemake.input
    causes = {
        source: {"objects": objects, "causes": causes}
        for source, objects, causes in zip(given.measured, files.objects, files.causes, strict=True)
    }
    run = FinishedRun(
        name=given.run,
        seeds=given.config["seeds"],
        sources=given.sources,
        results=[Shown(*fields) for fields in given.shown],
        causes=causes,
        titles=Titles(**given.titles),
        config=given.config,
    )
    folder = Path(snakemake.output.page).parent
    write_page(folder, run)
    write_crate(folder, run.name, [source["title"] for source in run.sources.values()], run.seeds)
