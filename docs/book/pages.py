"""Fills the folder of the book's sources: `python docs/book/pages.py FOLDER`, in the root folder.

The pages are those of the repository, with what they link to; further chapters are what the command and the package
say of themselves.
"""

import ast
import inspect
import itertools
import re
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import asperity
from latex2mathml.converter import convert

ROOT_PAGES = ["README.md", "ARCHITECTURE.md", "CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "LICENSE*", "SECURITY.md"]
LINKED = ["docs", "fixtures/clients", "fixtures/figures", "fixtures/golden/CHANGES.md", "pipelines", "tests/clients", "tests/rules"]


def said(*words: str) -> str:
    """What a program prints."""
    return subprocess.run(words, check=True, capture_output=True, text=True).stdout


def for_book(page: str) -> str:
    """A page with equations that browsers show by themselves, and with links to the first pages of folders as mdBook
    calls them."""

    def equation(tex: re.Match[str]) -> str:
        return f'<div class="equation">{convert(tex[1], display="block")}</div>'

    page = re.sub(r"(?m)^```math\n([^`]*)```$", equation, page)
    return re.sub(r"(\]\([^)]*)README\.md", r"\1index.md", page)


def linked(text: str) -> str:
    """Words of the program, which name a page by its path."""
    return re.sub(r"docs/([\w-]+)\.md", r"[\1](\1.md)", text)


def explained(command: str, title: str) -> str:
    """What `asperity COMMAND` explains, keys and numbers below a heading each, so that a search leads to them."""
    page = said("asperity", command, "--markdown")
    if command in ("keys", "numbers"):
        page = re.sub(r"(?m)^- (`.*?`) \((.*?)\): ", r"\n#### \1\n\n*\2.* ", page)
    return f"# {title}\n\n{linked(page)}"


def commands() -> str:
    """The help of each command."""
    page = "# The command line\n"
    words = [["asperity"]]
    for command in words:
        text = said(*command, "--help")
        page += f"\n## `{' '.join(command)}`\n\n```text\n{text}```\n"
        listed = re.search(r"(?ms)^Commands:\n(.*?)\n\n", text)
        names = re.findall(r"(?m)^  (\S+)", listed[1]) if listed else []
        words += [[*command, name] for name in names if name != "help"]
    return page


def signature(node: ast.stmt) -> str:
    """How a name is declared; nothing of one that is not public."""
    if isinstance(node, ast.AnnAssign):
        return ast.unparse(node)
    if not isinstance(node, ast.FunctionDef) or node.name.startswith("_"):
        return ""
    if any(ast.unparse(of) == "property" for of in node.decorator_list):
        return f"{node.name}: {ast.unparse(node.returns)}"
    declared = ast.unparse(ast.FunctionDef(**{**vars(node), "body": [ast.Expr(ast.Constant(...))]})).removesuffix(":\n    ...")
    return textwrap.fill(declared, 88, subsequent_indent=8 * " ", break_on_hyphens=False)


def entry(heading: str, declared: str, about: str | None) -> str:
    """What is said of a name."""
    text = f"\n{heading}\n\n```python\n{declared}\n```\n" if declared else f"\n{heading}\n"
    return f"{text}\n{linked(about or '')}\n"


def package() -> str:
    """The public names of the package: types from its sources, meanings from the module."""
    page = f"# The package\n\n{asperity.__doc__.replace('::', ':')}\n"
    for source in sorted(Path(asperity.__file__).parent.glob("*.py*")):
        nodes = ast.parse(source.read_text()).body if source.suffix in (".py", ".pyi") else []
        for node in nodes:
            name = getattr(node, "name", "_")
            if name not in asperity.__all__:
                continue
            of = getattr(asperity, name)
            page += entry(f"### `asperity.{name}`", signature(node), inspect.getdoc(of))
            members = {}
            # A field is explained by the text behind it.
            for member, behind in itertools.pairwise([*getattr(node, "body", []), None]):
                if isinstance(node, ast.ClassDef) and (declared := signature(member)):
                    own = re.search(r"(\w+)[(:]", declared)[1]
                    is_field = isinstance(member, ast.AnnAssign) and isinstance(behind, ast.Expr)
                    about = inspect.cleandoc(behind.value.value) if is_field else inspect.getdoc(getattr(of, own))
                    members[f"`{own}`"] = entry(f"#### `{name}.{own}`", declared, about)
            page += f"\n{', '.join(members)}\n{''.join(members.values())}"
    return page


def main(folder: Path) -> None:
    for name in said("git", "ls-files", "--", *ROOT_PAGES, *LINKED).splitlines():
        to = folder / name
        to.parent.mkdir(parents=True, exist_ok=True)
        if to.suffix == ".md":
            to = to.with_name(to.name.replace("README", "index"))
            to.write_text(for_book(Path(name).read_text()))
        else:
            shutil.copyfile(name, to)
    (folder / "docs/book/SUMMARY.md").replace(folder / "SUMMARY.md")
    titles = {"keys": "Keys of a scenario", "columns": "Columns", "numbers": "Numbers", "figures": "Figures"}
    chapters = {command: explained(command, title) for command, title in titles.items()}
    for name, page in {**chapters, "commands": commands(), "api": package()}.items():
        (folder / f"docs/{name}.md").write_text(page)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
