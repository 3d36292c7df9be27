"""Command ``label``: a person names the causes of the registrations that the classifier is least sure of."""

from __future__ import annotations

import io
import sys
import zipfile
from argparse import ArgumentParser, Namespace
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from gpca.active_learning import labeling
from gpca.active_learning.labeling import Question, Queue, Session
from gpca.attribution.predictions import write_predictions
from gpca.classifier.scores import Attribution
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError, refusing
from gpca.io.files import require_apart, require_file
from gpca.jobs.arguments import COUNT
from gpca.jobs.provenance import record_provenance
from gpca.model.location import model_path
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.cloud_views import draw_query
from gpca.reporting.words import plural
from gpca.settings import read_settings

if TYPE_CHECKING:
    from gpca.model.file import Model

COMMANDS = {"/retrain": "learn the answers so far", "/skip": "do not judge this one", "/quit": "stop here"}


def add_label_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` are those of the classifier."""
    add = parser.add_argument
    add("registrations", type=Path, help="registrations of a run, or the queue of 'gpca explain'")
    add("--embeddings", type=Path, help="embeddings of the registrations; a queue has its own")
    add("--labels", required=True, type=Path, help="CSV to which the answers are appended")
    add("--known", nargs="+", choices=CONCEPTS, default=CONCEPTS[:2], help="concepts labeled at the start")
    add("--initial", type=COUNT, default=60, help="samples labeled at the start (default 60)")
    add("--batch", type=COUNT, default=4, help="questions between retrainings (default 4)")
    add("--questions", type=COUNT, default=20, help="largest number of questions (default 20)")
    add("--strategy", default="bald_kmeans", help="strategy that picks the questions (default bald_kmeans)")
    add("--picture", type=Path, default=Path("query.png"), help="image, redrawn for every question")
    add("--answers", type=Path, help="file with one answer per line, instead of the terminal")
    add("--predictions", type=Path, help="CSV of the classifier's final predictions for all samples")
    add("--model", type=Path, help="model that explained a queue (default: that of 'gpca explain')")
    add("--out", type=Path, help="model file to write, which has learned from a queue")


def run_label(options: Namespace) -> None:
    settings = read_settings(GPCSettings, {"learning_rate": 0.2, "iterations": 150} | options.settings)
    require_file(options.registrations, "no such file", "make it with Snakemake, or by 'gpca explain --queue'")
    whole = zipfile.is_zipfile(options.registrations)
    queued = whole and labeling.is_queue(options.registrations)
    require_apart(options, ["labels", "picture", "predictions", "out"], [model_path(options.model)] if queued else [])
    if not whole:
        raise InputError(options.registrations, "is damaged, or not an npz archive", "make it again")
    place = "is not for the queue of an explanation" if queued else "is for the queue of an explanation alone"
    for name in ("embeddings", "predictions") if queued else ("model", "out"):
        if getattr(options, name):
            raise InputError(f"--{name}", place, "leave it out")
    if queued and options.settings:
        raise InputError("--settings", "are those of the model where a queue is labeled", "leave them out")
    if not queued and options.embeddings is None:
        raise InputError("--embeddings", "is missing", "name the embeddings of the registrations")
    registrations: Registrations | Queue
    model: Model | None = None
    start: dict[tuple[str, int], str] = {}
    if queued:
        registrations, model = _queued(options)
        h_S_d, keys = registrations.h, [("train", row) for row in range(len(registrations))]
    else:
        registrations = Registrations.load(options.registrations)
        h_S_d = read_embedding(options.embeddings, registrations)["embedding"]
        keys = list(zip(registrations.split.tolist(), registrations.sample.tolist(), strict=True))
        # The first training samples of the given concepts, equally many of each.
        each, train = max(1, options.initial // len(options.known)), registrations.rows("train")
        for concept in options.known:
            rows = train[registrations.concept[train] == concept][:each]
            start |= {keys[row]: str(registrations.concept[row]) for row in rows}
    labels = labeling.LabelFile(options.labels, dict.fromkeys(keys))
    session = Session(h_S_d, keys, start, labels, settings, options.strategy, gpc=None if model is None else model.gpc)
    answers: TextIO = sys.stdin
    if options.answers is not None:
        remedy = "give a text file in UTF-8 with one answer per line"
        require_file(options.answers, "no such file", remedy, labeling.LARGEST_BYTES)
        with refusing(options.answers, "is not text in UTF-8 ({})", remedy):
            answers = io.StringIO(options.answers.read_text(encoding="utf-8-sig"))
    left = options.questions
    print(f"{len(start)} labeled at the start, {len(session.answered)} answered before, {len(keys)} samples")
    print("answer with a concept or with " + ", ".join(f"{name} ({what})" for name, what in COMMANDS.items()))
    while left and (questions := session.ask(min(options.batch, left))):
        for question in questions:
            left -= 1
            answer = _ask(session, registrations, question, options.picture, answers)
            if answer in (None, "/quit"):
                return _finish(session, registrations, model, options)
            labels.add(keys[question.row], labeling.SKIPPED if answer == "/skip" else answer)
        _retrain(session)
    return _finish(session, registrations, model, options)


def _queued(options: Namespace) -> tuple[Queue, Model]:
    from gpca.model.file import Model

    path = model_path(options.model)
    model, queue = Model.load(path), Queue.load(options.registrations)
    width = model.gpc.learned_N_d.shape[1]
    if queue.h.shape[1] != width:
        fault = f"holds embeddings of {queue.h.shape[1]} numbers, but those of {path} have {width}"
        raise InputError(options.registrations, fault, "name the model that explained them with --model")
    return queue, model


def _ask(
    session: Session, registrations: Registrations | Queue, question: Question, picture: Path, answers
) -> str | None:
    row = question.row
    split, sample = session.keys[row]
    title = f"{split} sample {sample}: {registrations.object_name[row]}"
    draw_query(registrations.cloud(row), registrations.target(row), title, picture)
    columns = zip(session.gpc.classes, question.scores_C, question.variances_C, strict=True)
    scores = ", ".join(f"{name} {score:.2f} (variance {variance:.3f})" for name, score, variance in columns)
    print(f"\n{title}\n  {scores}; BALD {question.bald:.3f}; picture {picture}")
    while True:
        print("  cause? ", end="", flush=True)
        line = answers.readline()
        if not line:
            print()
            return None
        answer = line.strip()
        if not answers.isatty():
            print(answer)
        if answer == "/retrain":
            _retrain(session)
            continue
        try:
            if answer not in COMMANDS:
                labeling.require_name(answer)
            return answer
        except InputError as fault:
            if not answers.isatty():
                raise
            print(f"  {fault}")


def _retrain(session: Session) -> None:
    print(f"  learned {plural(session.retrain(), 'answer')}; concepts: {', '.join(session.gpc.classes)}")


def _finish(session: Session, registrations: Registrations | Queue, model: Model | None, options: Namespace) -> None:
    session.retrain()
    answered = session.answered
    counts = ", ".join(f"{c} {list(answered.values()).count(c)}" for c in dict.fromkeys(answered.values())) or "none"
    print(f"\n{options.labels}: {counts}")
    if model is not None and options.out:
        if new := [concept for concept in session.gpc.classes if concept not in CONCEPTS]:
            fault = f"is not written: a model file cannot hold the new concept {', '.join(new)}"
            raise InputError(options.out, fault, "the labels are kept; name one of " + ", ".join(CONCEPTS) + " instead")
        replace(model, gpc=session.gpc).save(options.out)
        print(f"{options.out}: the model whose GP-CA has learned them; the diagnosis is as before")
    if options.predictions and isinstance(registrations, Registrations):
        scores_N_C, variances_N_C, bald_N = session.gpc.attribute(session.h_S_d)
        attribution = Attribution.of_scores(session.gpc.classes, scores_N_C, seconds=0.0)
        attribution = replace(attribution, variances_N_C=variances_N_C, bald_N=bald_N)
        inputs = [options.registrations, options.embeddings, *([options.labels] if options.labels.is_file() else [])]
        with record_provenance([options.predictions], inputs, options.settings):
            write_predictions(options.predictions, registrations, attribution)
