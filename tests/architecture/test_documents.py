"""README and guide show what works: the blocks of a page run from top to bottom, as a reader runs them."""

import ast
import re
import shlex
import sys
import tomllib
from pathlib import Path

import click
import pytest
import yaml
from support.small_worlds import cube

from replay.cli.commands import COMMANDS
from replay.cli.main import cli, main
from replay.cli.project_settings import read_settings
from replay.guide.pages import INDEX_PAGE, PAGES_FOLDER, page, topics
from replay.show.rerun_log.viewer import target_ns as target_of
from replay.show.results.run_folder import read_run_folder
from sessions import mesh_to_glb

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text("utf-8")
CONTRIBUTING = (ROOT / ".github" / "CONTRIBUTING.md").read_text("utf-8")
DOCUMENTS = {"README": README, "CONTRIBUTING": CONTRIBUTING}
DOCUMENTS |= {f"guide/{topic}": page(topic) for topic in [INDEX_PAGE, *topics()]}
OTHERS = [ROOT / ".github" / name for name in ("CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md")]
PLAQUES = [path for package in ("cdcore", "sessions", "replay") for path in (ROOT / package).rglob("README.md")]

ACTION = ROOT / ".github" / "actions" / "audit" / "action.yml"
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
OPENS_A_WINDOW = {"view"}
"""Verbs that a test does not run."""
SEARCH_SECONDS = "8"
"""A search for colliders without a limit of its own would cut bodies for a minute or two."""


def blocks(text, language):
    """The contents of all code blocks of a language in a text."""
    return [body for name, body in BLOCK.findall(text) if name == language]


def displayed_files(text):
    """File name -> text, of the blocks that are files: named in their first line or by the sentence before them."""
    files = {}
    for result in BLOCK.finditer(text):
        before = text[: result.start()].rstrip().rpartition("\n\n")[2]
        named = re.match(r"# ([\w.-]+\.\w+)\n", result[2]) or re.search(r"`([\w.-]+\.\w+)`:$", before)
        if named and result[1] not in ("bash", "csharp"):
            files[named[1]] = result[2]
    return files


def lines_of(block):
    """The commands of a shell block, one a line, comments included."""
    joined = block.replace("\\\n", " ")
    return [piece.strip() for line in joined.splitlines() for piece in line.split("&&")]


def commands(block):
    """The ``replay`` commands of a shell block: their words, and the exit code they promise."""
    for line in lines_of(block):
        arguments = shlex.split(line, comments=True)
        if arguments[:1] == ["replay"]:
            promised = re.search(r"# exits with (\d)$", line)
            yield arguments[1:], int(promised[1]) if promised else 0


def lay_out(name, folder):
    """The files that a page shows, and those that the program brings which the page is about."""
    for file, text in displayed_files(DOCUMENTS[name]).items():
        (folder / file).write_text(text, "utf-8")
    if name == "guide/your-recording":
        rows = [
            f"pose,{0.011 * frame:.6f},{body},{0.5 * number + 0.01 * frame * number},1,0,0,0,0,1,1,,"
            for frame in range(30)
            for number, body in enumerate(("Beaker", "LeftHand"))
        ]
        head = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value"
        (folder / "session.csv").write_text("\n".join([head, *rows, ""]), "utf-8")
        (folder / "colliders.glb").write_bytes(mesh_to_glb(cube(edge=0.1), "UCX_Beaker_00"))
        for mesh in ("beaker", "hand"):
            (folder / f"{mesh}.glb").write_bytes(mesh_to_glb(cube(edge=0.1), mesh))


@pytest.fixture(scope="module")
def sessions_made():
    """Arguments of ``replay demo --session-only`` -> the file: pages begin with the same session."""
    return {}


def run_command(words, promised, made, capsys):
    """Run a command of a document; one that opens a window only looks for its moment."""
    if words[0] in OPENS_A_WINDOW:
        output = dict(zip(words[2::2], words[3::2], strict=True))
        miss, false = (int(output[word]) if word in output else None for word in ("--miss", "--false"))
        assert target_of(read_run_folder(Path(words[1])).picture, miss, false, output.get("--by", "")) >= 0
        return
    if "--session-only" in words:
        arguments, file = tuple(words[: words.index("-o")]), Path(words[words.index("-o") + 1])
        if arguments in made:
            file.write_bytes(made[arguments])
            return
    searches = words[0] == "fix" or (words[0] == "tradeoff" and "--engine" not in words)
    if searches and "--time-limit" not in words:
        words = [*words, "--time-limit", SEARCH_SECONDS]
    assert main(words) == promised, (" ".join(words), capsys.readouterr().err)
    if "--session-only" in words:
        made[arguments] = file.read_bytes()


def run_cell(body, name, names):
    """Run a block; what its last line is worth is printed, as a notebook does."""
    tree = ast.parse(body)
    printed = isinstance(tree.body[-1], ast.Expr)
    last = ast.Expression(tree.body.pop().value) if printed else None
    exec(compile(tree, name, "exec"), names)
    if last is not None and (value := eval(compile(last, name, "eval"), names)) is not None:
        print(value)


def pages():
    """Each document that a reader can follow from top to bottom: its name and text."""
    for name, text in DOCUMENTS.items():
        runs_a_session = "replay.run(" in "".join(blocks(text, "python")) or any(
            list(commands(block)) for block in blocks(text, "bash")
        )
        if runs_a_session or blocks(text, "python"):
            yield pytest.param(name, marks=[pytest.mark.slow] * runs_a_session)


@pytest.mark.usefixtures("shared_pieces")
@pytest.mark.parametrize("name", [*pages()])
def test_the_blocks_of_a_page_run_from_top_to_bottom(name, tmp_path, monkeypatch, capsys, sessions_made):
    """Commands and Python blocks of a page share a folder, with the files that the page shows, and a namespace.

    A command ends with the exit code that the page promises, 0 if none; a Python block prints something. Convex pieces
    that a page cuts are there for the pages behind it, as on the machine of a reader.
    """
    monkeypatch.chdir(tmp_path)
    lay_out(name, tmp_path)
    files, names = displayed_files(DOCUMENTS[name]).values(), {"__name__": "guide"}
    for language, body in BLOCK.findall(DOCUMENTS[name]):
        if language == "bash":
            for arguments, promised in commands(body):
                run_command(arguments, promised, sessions_made, capsys)
        elif language == "python" and body not in files:
            capsys.readouterr()
            run_cell(body, name, names)
            assert capsys.readouterr().out, "a block that prints nothing shows nothing"


def settings_of(path):
    """The settings that ``run`` reads from a file beside its sessions."""
    command = cli.get_command(click.Context(cli), "run")
    return read_settings(path, click.Context(command))


def read_by_the_product(path):
    """Reads a TOML or YAML file of a page as the product does: a scene, a mapping, settings or a codebook."""
    from replay.studies.class_study.codebook import read_codebook
    from sessions import parse_scene
    from sessions.importers.csv_columns_and_units import read_mapping

    text = path.read_text("utf-8")
    if path.suffix == ".yaml":
        return read_codebook(path)
    if "[[body]]" in text:
        return parse_scene(text).bodies
    return read_mapping(path) if "[time]" in text else settings_of(path)


def files_of_documents(*endings):
    """Document, file name and text of every block that is a file with one of these endings."""
    return [
        pytest.param(name, file, text, id=f"{name} {file}")
        for name, document in DOCUMENTS.items()
        for file, text in displayed_files(document).items()
        if file.endswith(endings)
    ]


@pytest.mark.parametrize(("name", "file", "text"), files_of_documents(".toml", ".yaml"))
def test_every_toml_and_yaml_block_is_readable(tmp_path, name, file, text):
    """The product reads a file that a page shows, and something is in it."""
    path = tmp_path / file
    path.write_text(text, "utf-8")
    assert read_by_the_product(path)


@pytest.mark.parametrize(("name", "file", "text"), files_of_documents(".yml"))
def test_workflow_of_a_page_gives_inputs_that_the_action_has(name, file, text):
    """A workflow of GitHub uses our action "audit": each input that it gives is declared in action.yml."""
    steps = [step for job in yaml.safe_load(text)["jobs"].values() for step in job["steps"]]
    inputs_given = {name for step in steps if "/actions/audit@" in step["uses"] for name in step["with"]}
    assert inputs_given
    assert inputs_given <= set(yaml.safe_load(ACTION.read_text("utf-8"))["inputs"])


def test_every_toml_and_yaml_block_has_a_file_name():
    """The product reads a block in other tests only if it has a name, so there are as many named files as such blocks.

    Files of other kinds that pages show are CSV and Python.
    """
    endings = set()
    for name, text in DOCUMENTS.items():
        files = [file for file in displayed_files(text) if file.endswith((".toml", ".yaml", ".yml"))]
        assert len(files) == len(blocks(text, "toml") + blocks(text, "yaml")), name
        endings |= {Path(file).suffix for file in displayed_files(text)}
    assert endings == {".toml", ".yaml", ".yml", ".csv", ".py"}


def test_python_blocks_import_names_of_the_facades_only():
    """Blocks import from cdcore, sessions and replay themselves, never from a module within."""
    imported = [
        (name, module)
        for name, text in DOCUMENTS.items()
        for body in blocks(text, "python")
        for module in re.findall(r"^\s*(?:from|import) ((?:cdcore|sessions|replay)[\w.]*)", body, re.MULTILINE)
    ]
    assert imported
    assert [(name, module) for name, module in imported if "." in module] == []


def used_commands():
    """Every command of blocks and of code in the text, by page and in order, as words."""
    for name, text in DOCUMENTS.items():
        for block, inline in re.findall(r"^```(?:bash|text)\n(.*?)^```$|`(replay [a-z][^`]*)`", text, re.M | re.S):
            for line in lines_of(block) if block else [" ".join(inline.split())]:
                arguments = shlex.split(line, comments=True)
                if arguments[:1] == ["replay"]:
                    yield name, arguments[1:]


def test_every_written_command_has_an_existing_verb_and_options():
    """Commands of all documents; a verb in capitals stands for any. Each verb of the program is in some document."""
    mentioned_verbs = set()
    for name, (verb, *arguments) in used_commands():
        context = click.Context(cli)
        assert verb in COMMANDS or verb.isupper(), (name, verb)
        mentioned_verbs.add(verb)
        command = cli.get_command(context, verb) if verb in COMMANDS else None
        if isinstance(command, click.Group) and arguments:
            command = command.get_command(context, arguments[0])
        if command is None:
            continue
        existing = {flag for option in command.params for flag in (*option.opts, *option.secondary_opts)}
        flags = {word.split("=")[0] for word in arguments if word.startswith("-")}
        assert flags <= existing | {"--help"}, (name, verb, flags - existing)
    assert set(COMMANDS) - mentioned_verbs == set(), "verbs that no page mentions"


EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]


def test_pages_install_this_copy_or_an_existing_extra():
    """Every ``pip install`` of a page names this folder, or the package with an extra of pyproject.toml."""
    installations = [
        (name, installed)
        for name, text in DOCUMENTS.items()
        for installed in re.findall(r"pip install (.*?)(?:[`;&)]|$)", text, re.MULTILINE)
    ]
    assert installations
    for name, installed in installations:
        extra = re.fullmatch(r'(?:-e "\.|"vrlab-replay)\[(\w+)\]"\s*', installed)
        is_this_folder = installed.strip() in ("PATH-OF-THIS-REPOSITORY", "-e .")
        assert is_this_folder or extra[1] in EXTRAS, (name, installed)


def test_the_page_of_a_registry_links_no_file():
    """The README of a package registry is ours after the substitutions of pyproject.toml, without its other files.

    Links to pages of the guide have become commands; links to the web stay.
    """
    text = README
    build = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["hatch"]["metadata"]["hooks"]
    for rule in build["fancy-pypi-readme"]["substitutions"]:
        text = re.sub(rule["pattern"], rule["replacement"], text)
    assert "](" not in re.sub(r"\]\(https?:", "", text)
    assert "`replay guide what-is-wrong`" in text and "`replay guide`" in text


def test_the_citation_names_the_version_of_the_package():
    """Title, version, authors and abstract of CITATION.cff are those of pyproject.toml."""
    citation = yaml.safe_load((ROOT / ".github" / "CITATION.cff").read_text("utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert (citation["title"], citation["version"]) == (project["name"], project["version"])
    assert citation["authors"] == project["authors"]
    assert citation["abstract"] == project["description"]


def links():
    """Each link of the documents to a file: the document, and the target."""
    for path in [ROOT / "README.md", *OTHERS, *PLAQUES, *PAGES_FOLDER.glob("*.md")]:
        for target in re.findall(r"\]\(([^)\s]+)\)", BLOCK.sub("", path.read_text("utf-8"))):
            if not target.startswith("http"):
                yield path, target


def test_every_link_leads_to_a_file():
    """The targets of links in documents, guide and READMEs of packages exist; links to the web are left out."""
    file_links = [*links()]
    assert file_links
    assert [(str(path), target) for path, target in file_links if not (path.parent / target).exists()] == []


def words(text):
    """Words that a reader reads: tokens with a letter or digit."""
    return sum(bool(re.search(r"\w", token)) for token in text.split())


def prose(text):
    """The text of a page without code blocks and tables."""
    return "\n".join(line for line in BLOCK.sub("", text).splitlines() if not line.startswith("|"))


def test_readme_and_guide_keep_to_their_length():
    """At most 700 words of README and 11,000 of the guide, with its list of 12 pages.

    A page has at most 900 words, without its blocks and tables.
    """
    pages = {topic: page(topic) for topic in topics()}
    assert len(pages) == 12
    assert words(README) <= 700
    assert sum(map(words, [page(INDEX_PAGE), *pages.values()])) <= 11_000
    assert {topic: words(prose(text)) for topic, text in pages.items() if words(prose(text)) > 900} == {}


@pytest.mark.slow
def test_the_scenes_of_the_table_declare_what_it_says():
    """The table of the page scenes-and-effects: a scene in the first cell, the kinds of its effects in the last."""
    from sessions.synthetic.scenes import SCENES, make_scene_session

    rows = re.findall(
        r"^\| `([a-z-]+)` \| [^|]* \| ([a-z, -]+?)(?::[^|]*)? \|$", page("scenes-and-effects"), re.MULTILINE
    )
    printed_kinds = dict(rows)
    for name in SCENES:
        effects = make_scene_session(name)[0].scene.effects
        assert printed_kinds.get(name) == ", ".join(dict.fromkeys(effect.kind for effect in effects)), name


def test_shell_and_powershell_install_the_same():
    """The first blocks of either shell in README both install this copy and run the demo."""
    shell, power = blocks(README, "bash")[0], blocks(README, "powershell")[0]
    for command in ("pip install -e .", "replay demo -o"):
        assert command in shell and command in power, command


def test_readme_says_how_to_run_the_tests():
    """A block of README installs what tests need, and runs them."""
    assert 'pip install -e ".[test]"\npython -m pytest -n auto\n' in blocks(README, "bash")


IMPORT = re.compile(r"^[ \t]*(?:import|from) (\w+)(?=[\w.]* import |[\w.]*(?: as \w+)?(?:  #.*)?$)", re.MULTILINE)
"""An import statement, and the library that it imports from."""
PACKAGE_OF_MODULE = {"foxglove_schemas_protobuf": "foxglove", "google": "protobuf", "mcap_ros2": "mcap-ros2-support"}


@pytest.mark.parametrize("folder", ["cdcore", "sessions", "replay/running"])
def test_readme_names_every_imported_library(folder):
    """A folder's own README names each library that its modules import, beside Python's own and our packages."""
    readme = (ROOT / folder / "README.md").read_text("utf-8")
    sources = [path.read_text("utf-8") for path in (ROOT / folder).rglob("*.py")]
    imported = {library for source in sources for library in IMPORT.findall(source)}
    libraries = imported - sys.stdlib_module_names - {"cdcore", "sessions", "replay"}
    assert libraries
    assert not [name for name in libraries if PACKAGE_OF_MODULE.get(name, name) not in readme]


def test_paths_in_documents_exist():
    """README, CONTRIBUTING and guide: each path in backticks below a package or "tests" is in the checkout."""
    paths = [
        (name, path)
        for name, text in DOCUMENTS.items()
        for path in re.findall(r"`((?:cdcore|sessions|replay|tests)/[\w/.-]+)`", text)
    ]
    assert paths
    assert [(name, path) for name, path in paths if not (ROOT / path).exists()] == []
