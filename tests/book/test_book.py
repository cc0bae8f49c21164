"""The book in target/book: its links lead somewhere, it fetches nothing, and its search finds every name."""

import json
import os
import re
import shutil
import subprocess
from html import unescape
from pathlib import Path
from urllib.parse import unquote

import asperity
import pytest

ROOT = Path(__file__).parent.parent.parent
HTML = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "book" / "html"
PAGES = [page for page in sorted(HTML.rglob("*.html")) if page.name not in ("404.html", "toc.html")]

# Loads what the page loads, and searches as `searcher.js` does: words of the first thirty places that a name leads to.
SEARCH = """
const fs = require("fs");
const [html, names] = process.argv.slice(1);
const load = (start) => {
    const file = fs.readdirSync(html).find((name) => name.startsWith(start) && name.endsWith(".js"));
    return fs.readFileSync(`${html}/${file}`, "utf8");
};
const window = { search: {} };
new Function("window", load("searchindex"))(window);
const elasticlunr = new Function("module", "exports", `${load("elasticlunr")}; return module.exports;`)({ exports: {} }, {});
const { index, search_options, results_options } = window.search;
const searched = elasticlunr.Index.load(index);
const isIndexed = (name) => elasticlunr.stopWordFilter(name) !== undefined;
const found = JSON.parse(names).map((name) => !isIndexed(name) ? null :
    searched.search(name, search_options).slice(0, results_options.limit_results).map(({ doc }) => [doc.title, doc.body]));
console.log(JSON.stringify(found));
"""


def command(*words: str) -> str:
    return subprocess.run(["asperity", *words], check=True, capture_output=True, text=True).stdout


def parts(of: str) -> list[str]:
    """The keys, columns or numbers that a command lists."""
    return re.findall(r"^- `(.*?)`", command(of, "--markdown"), re.MULTILINE)


def python_names() -> list[str]:
    """What the package exports, and the public members of its classes, with and without their class."""
    exported = [name for name in asperity.__all__ if name != "__version__"]
    classes = [of for name in exported if isinstance(of := getattr(asperity, name), type)]
    members = [(of.__name__, name) for of in classes for name in vars(of) if not name.startswith("_")]
    names = [name for _, name in members] + [".".join(member) for member in members]
    return [f"asperity.{name}" for name in exported] + exported + names


def search(names: list[str]) -> list[list[tuple[str, str]] | None]:
    """Title and text of the places that a search for each name shows, the best first; none of words like `at`, which
    stand everywhere and are not searched for."""
    if not shutil.which("node"):
        if os.environ.get("ASPERITY_NO_SKIPS") == "1":
            pytest.fail("node is not installed")
        pytest.skip("node is not installed")
    call = ["node", "--eval", SEARCH, str(HTML), json.dumps(names)]
    return json.loads(subprocess.run(call, check=True, capture_output=True, text=True).stdout)


@pytest.mark.parametrize(
    "kind, names, fewest",
    [
        ("keys", parts("keys"), 90),
        ("columns", parts("columns"), 180),
        ("numbers", parts("numbers"), 220),
        ("figures", re.findall(r"^### (.*)", command("figures", "--markdown"), re.MULTILINE), 45),
        ("keys of figures", parts("figures"), 100),
        ("Python", python_names(), 200),
        ("commands", re.findall(r"^  (\w+)", command("--help").split("Options:")[0], re.MULTILINE), 25),
    ],
)
def test_a_search_finds_every_name(kind: str, names: list[str], fewest: int) -> None:
    names = sorted(set(names))
    assert len(names) >= fewest
    lost, below = [], []
    for name, found in zip(names, search(names), strict=True):
        if found is None:
            assert kind not in ("keys", "numbers"), name
            continue
        if not any(re.search(rf"(?<!\w){re.escape(name)}(?!\w)", f"{title} {body}") for title, body in found):
            lost.append(name)
        if name not in [title for title, _ in found[:10]]:
            below.append(name)
    assert not lost, f"{kind}: {lost}"
    # Its own entry is among the first ten.
    assert kind not in ("keys", "numbers") or not below, f"{kind}: {below}"


def test_what_is_not_there_is_not_found() -> None:
    assert search(["slider.blokcs", "zeppelin"]) == [[], []]


def test_links_lead_somewhere_and_nothing_is_fetched() -> None:
    text = {page: page.read_text() for page in PAGES}
    anchors = {page: {unescape(name) for name in re.findall(r'\bid="([^"]*)"', of)} for page, of in text.items()}
    assert all((HTML / "docs" / f"{page.stem}.html").is_file() for page in ROOT.glob("docs/*.md"))
    dead, checked = [], 0
    for page, of in text.items():
        assert not re.search(r'<(?:script|link|img|iframe)[^>]*(?:src|href)="(?:https?:)?//', of), page
        for target in re.findall(r'\b(?:href|src)="([^"]*)"', of):
            path, _, anchor = unquote(unescape(target)).partition("#")
            if re.match(r"[a-z]+:", target):
                continue
            to = (page.parent / path).resolve() if path else page
            checked += 1
            if not to.is_file() or (anchor and anchor not in anchors.get(to, ())):
                dead.append(f"{page.relative_to(HTML)}: {target}")
    assert checked > 1000
    assert not dead, "\n".join(dead)


def test_equations_are_shown_by_the_browser_itself() -> None:
    blocks = sum(page.read_text().count("\n```math\n") for page in ROOT.glob("docs/*.md"))
    shown = "".join(page.read_text() for page in PAGES)
    assert shown.count("<math") == blocks > 10
    assert "language-math" not in shown
