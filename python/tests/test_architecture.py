"""The written tour of the repository is true: each path that it names exists."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [
    "ARCHITECTURE.md",
    "README.md",
    "CONTRIBUTING.md",
    *sorted(str(p.relative_to(ROOT)) for p in (ROOT / "docs").glob("**/*.md") if "_build" not in p.parts),
]

# What a clean clone does not hold because make makes it.
MADE = re.compile(r"^(runs/|\.venv|target$|target/|docs/_build|viewer/node_modules|python/carom/page/report\.html)")
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
CODE = re.compile(r"`([^`\s]+)`")
LITERAL = re.compile(r"\{literalinclude\} (\S+)")
TOP_FOLDERS = ("crates/", "python/", "viewer/", "scenes/", "examples/", "benches/", "validation/", "docs/", ".ci/")


def named_paths(page: Path) -> set[str]:
    """The paths that a page names: relative links, and words in code type that begin with one of our folders."""
    text = page.read_text(encoding="utf-8")
    linked = {link for pattern in (LINK, LITERAL) for link in pattern.findall(text) if "://" not in link}
    paths = {str((page.parent / link).resolve().relative_to(ROOT)) for link in linked}
    paths |= {word for word in CODE.findall(text) if word.startswith(TOP_FOLDERS) and not set(word) & set("<>*{}…")}
    return {path for path in paths if not MADE.match(path)}


@pytest.mark.parametrize("page", PAGES)
def test_named_paths_exist(page: str):
    missing = sorted(path for path in named_paths(ROOT / page) if not (ROOT / path).exists())
    assert not missing


def test_the_tour_is_not_empty():
    # The tour names the core's modules one by one; a broken pattern above would find none.
    assert len(named_paths(ROOT / "ARCHITECTURE.md")) >= 20


def test_every_module_of_the_core_is_in_the_tour():
    tour = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    modules = sorted(path.name for path in (ROOT / "crates/carom/src").glob("*.rs"))
    assert modules
    assert [name for name in modules if f"/{name}" not in tour] == []
