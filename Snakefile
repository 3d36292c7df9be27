# GP-CA Bench. `snakemake -j2 all` makes all that the config names; each table, figure and stage is a target: `table2`.
import gc
import sys

gc.set_threshold(100_000)  # a plan is kept: searching it took a seventh of its time
sys.path.insert(0, str(workflow.current_basedir))
from gpca.config.check import read
from gpca.config.jobs import clear_leftovers, export_to_jobs
from gpca.config.layers import DEFAULTS, require_sound
from gpca.errors import one_line
from gpca.declarations.registry import experiments
from gpca.process.time_left import tell_time_left

given, module = workflow.config_settings, workflow.modifier
with one_line():
    require_sound(given.configfiles if module.is_main_snakefile() else [])


configfile: DEFAULTS[0]
configfile: DEFAULTS[1]
configfile: DEFAULTS[2]


with one_line():
    config, SOURCES = read(config, given.config, module.skip_configfile)
export_to_jobs(config)
clear_leftovers(workflow.is_main_process)


pathvars:
    results=f"results/{config['run']}",
    logs=f"results/{config['run']}/logs",
    benchmarks=f"results/{config['run']}/benchmarks",


STAGES = "objects registrations causes frames virtual_frames encoders uncertainty explainers model"
EXPERIMENTS = [each.name for each in experiments() if each.has_rules]
ENDS_WITH = ["steps", "collected", "results", "comparison", "targets"]
TOPICS = ["common", "functions", *STAGES.split(), *EXPERIMENTS, *ENDS_WITH]
for topic in dict.fromkeys(TOPICS):

    include: f"workflow/rules/{topic}.smk"


onstart:
    # For every job that has ended, this limit makes Snakemake look for work once more per second, for the whole run.
    # What starts on one machine is limited by its cores.
    if workflow.local_exec:
        workflow.scheduler.job_rate_limiter = None
    tell_time_left(workflow, config["run"])


rule all:
    default_target: True
    input:
        [f"<results>/{name}" for name in COLLECTED + ENDS],
        [f"<results>/{result.all_files[0]}" for result in RESULTS],
