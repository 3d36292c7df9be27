"""Pages to look things up in: the command line, messages, and the public names are those of the code."""

import inspect
import re
import runpy
from argparse import ArgumentParser
from pkgutil import resolve_name

import pytest
from packaging.requirements import Requirement

from docs import cli

from .documents import ROOT

LETTERS = 7  # from which on a part of a message can be recognized


def test_the_page_of_the_command_line_is_that_of_the_commands():
    assert cli.PAGE.read_text() == cli.page(), "run 'python docs/cli.py'"


def test_a_page_that_is_out_of_date_is_told_and_written_anew(tmp_path, monkeypatch, capsys):
    for name, value in (("ROOT", tmp_path), ("PAGE", tmp_path / "cli.md"), ("page", lambda: "new\n")):
        monkeypatch.setattr(cli, name, value)
    cli.PAGE.write_text("old\n")
    assert (cli.main(["--check"]), cli.PAGE.read_text()) == (1, "old\n")
    assert (cli.main([]), cli.PAGE.read_text()) == (0, "new\n")
    assert capsys.readouterr().out.splitlines() == ["cli.md: is out of date", "cli.md: written anew"]
    assert cli.main(["--check"]) == 0


def test_arguments_stand_as_they_are_typed():
    command = ArgumentParser(add_help=False)
    command.add_argument("files", nargs="+", help="what is read")
    command.add_argument("--unit", choices=["m", "mm"], help="a | b")
    command.add_argument("-f", "--fast", action="store_true", help="soon")
    command.add_argument("--out", required=True, metavar="FILE", help="<folder>")
    assert cli.usage("try", command) == "gpca try files … --out FILE [options]"
    assert cli.table(command).splitlines()[2:] == [
        "| `files …` | what is read |",
        "| `--unit UNIT` | a \\| b; one of `m`, `mm` |",
        "| `--fast` | soon |",
        "| `--out FILE` | &lt;folder>; required |",
    ]


def code():
    """What the code may say, in which a text that goes on in the next line is one."""
    files = [*sorted((ROOT / "gpca").rglob("*.py")), ROOT / "Makefile"]
    return re.sub(r'"\s*\n\s*f?"', "", "\n".join(path.read_text() for path in files))


def test_every_message_that_a_page_explains_is_one_of_the_code():
    said = code()
    page = (ROOT / "docs/troubleshooting.md").read_text()
    messages = re.findall(r"^\| (`.+?) \| ", page, re.MULTILINE)
    assert len(messages) >= 15
    for message in messages:
        parts = [part for part in re.split(r"…|`|'|: |, |; ", message) if len(part.strip()) >= LETTERS]
        assert parts, f"nothing in {message} can be recognized"
        assert [part for part in parts if part.strip() not in said] == [], message


NAMES = re.findall(
    r"^\.\. auto(?:class|function):: ([\w.]+)\n(?:   :members: (.+))?",
    (ROOT / "docs/api.rst").read_text(),
    re.MULTILINE,
)


def test_the_reference_of_the_api_has_names_and_every_export():
    import gpca

    assert len(NAMES) >= 30
    documented = {resolve_name(name) for name, _ in NAMES}
    assert {getattr(gpca, name) for name in gpca.__all__ if name != "__version__"} <= documented


@pytest.mark.parametrize(("name", "members"), NAMES, ids=lambda part: part.rpartition(".")[2])
def test_every_name_of_the_api_is_there_and_says_what_it_is(name, members):
    documented = resolve_name(name)
    assert inspect.getdoc(documented)
    for member in filter(None, members.split(", ")):
        assert inspect.getdoc(getattr(documented, member)), member


def test_packages_of_the_site_are_pinned_with_hashes_beside_those_of_the_lock():
    text = (ROOT / "docs/requirements.txt").read_text().replace(" \\\n", "")
    entries = [line.split() for line in text.splitlines() if line and line[0] != "#"]
    lock = {line.partition("==")[0].lower() for line in (ROOT / "environment.lock").read_text().splitlines()}
    for pin, *hashes in entries:
        requirement = Requirement(pin)
        assert str(requirement.specifier).startswith("==")
        assert hashes and all(re.fullmatch(r"--hash=sha256:[0-9a-f]{64}", found) for found in hashes)
        assert requirement.name.lower() not in lock
    assert {"sphinx", "myst-parser", "sphinx-gallery"} <= {Requirement(pin).name.lower() for pin, *_ in entries}


def test_the_site_shows_the_tutorial_as_it_ran():
    conf = runpy.run_path(str(ROOT / "docs/conf.py"))
    gallery = conf["sphinx_gallery_conf"]
    scripts = sorted((ROOT / gallery["examples_dirs"]).glob("*.py"))
    shown = [path for path in scripts if not re.search(gallery["ignore_pattern"], path.name)]
    assert shown == [ROOT / "docs/tutorial.py"] and re.search(gallery["filename_pattern"], str(shown[0]))
    page = f"{gallery['gallery_dirs']}/tutorial.rst"
    assert page in conf["include_patterns"]
    for name in ("README", "docs/explain"):
        text = with_menu(conf, name)
        assert f"[tutorial](/{page})" in text and "tutorial.py)" not in text
    menu = re.findall(r"^docs/(\w+)$", with_menu(conf, "README"), re.MULTILINE)
    assert set(menu) >= {path.stem for path in (ROOT / "docs").glob("*.md")}


def with_menu(conf, name):
    """The text that the site is made of for a page."""
    source = [(ROOT / f"{name}.md").read_text()]
    conf["with_menu"](None, name, source)
    return source[0]
