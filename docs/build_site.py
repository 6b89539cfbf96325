"""Build the site of all pages: `python docs/build_site.py [FOLDER]`, by default build/site. Needs `marconet[docs]`.

    docs/, README.md, CHANGELOG.md, docstrings --this file--> FOLDER.source/ --Zensical, mkdocstrings--> FOLDER/

- The pages of docs/ stay as they are; README.md and CHANGELOG.md stand beside them, as `about.md` and `changelog.md`.
- Each package gets a page of the reference, `reference/PACKAGE.md`, made from the docstrings of its modules.
- A source file that a page links is copied to its path in the site.
- The navigation has a section for each table of docs/README.md, with the pages that it links, then the reference.

The exit code is 1 after any warning, such as a link that leads nowhere.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Final

from markdown_lists import spaced

ROOT: Final = Path(__file__).parents[1]
PACKAGES: Final = ("marconet", "experiments", "agents", "firmware_sim", "fmus", "netem")
BESIDE: Final = {"README.md": "about.md", "CHANGELOG.md": "changelog.md", "docs/README.md": "index.md"}
FENCE: Final = re.compile(r"(^```.*?^```)", re.DOTALL | re.MULTILINE)
CODE: Final = re.compile(r"(^```.*?^```|`[^`\n]*`)", re.DOTALL | re.MULTILINE)
OF_THE_PAGE: Final = "    options: { show_root_heading: false, show_root_toc_entry: false }"
LINK: Final = re.compile(r"(\]\()(?!https?:|#)([^)#\s]+)")


def write_source(source: Path) -> Path:
    """Write every page and the settings of the site into `source`; return the file of settings."""
    pages = source / "pages"
    shutil.copytree(ROOT / "docs", pages, ignore=shutil.ignore_patterns("*.py", "*.toml", "*.md", "__pycache__"))
    for file in [*(ROOT / "docs").rglob("*.md"), ROOT / "README.md", ROOT / "CHANGELOG.md"]:
        name = file.relative_to(ROOT).as_posix()
        page = pages / _page(name)
        page.parent.mkdir(parents=True, exist_ok=True)
        text = file.read_text(encoding="utf-8")
        page.write_text(_relinked(text, name), encoding="utf-8")
        for linked in _sources_linked(text, name):
            (pages / linked).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / linked, pages / linked)
    for package, modules in _packages().items():
        page = pages / "reference" / f"{package}.md"
        page.parent.mkdir(exist_ok=True)
        page.write_text("\n\n".join([f"# {package}", f"::: {package}\n{OF_THE_PAGE}",
                                     *(f"::: {module}" for module in modules)]), encoding="utf-8")
    settings = (ROOT / "docs" / "zensical.toml").read_text(encoding="utf-8")
    own = f'docs_dir = "pages"\nsite_dir = "site"\nnav = [\n{_navigation()}]\n'
    extension = f"extensions = [{json.dumps(str(ROOT / 'docs' / 'markdown_lists.py'))}]\n"
    handler = f"[project.plugins.mkdocstrings.handlers.python]\npaths = [{json.dumps(str(ROOT))}]\n"
    file = source / "zensical.toml"
    file.write_text(settings.replace("[project]\n", f"[project]\n{own}") + extension + handler, encoding="utf-8")
    return file


def build(folder: Path) -> int:
    """Build the site into `folder`; returns the exit code."""
    source = folder.with_name(f"{folder.name}.source")
    for old in (source, folder):
        shutil.rmtree(old, ignore_errors=True)
    settings = write_source(source)
    done = subprocess.run([sys.executable, "-m", "zensical", "build", "--strict", "-f", settings.name], cwd=source,
                          check=False)
    if (source / "site").is_dir():
        (source / "site").rename(folder)
    return done.returncode


def _navigation() -> str:
    """Lines of TOML: a section for each table of docs/README.md, then the reference."""
    index = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    sections = {"": ["index.md"]}
    for heading, rows in re.findall(r"^\| ([^|]+?) \|.*\n\|[-|]+\n((?:\|.*\n)+)", index, re.MULTILINE):
        links = re.findall(r"^\| \[.*?\]\((.*?)\)", rows, re.MULTILINE)
        sections[heading.capitalize()] = [_page(os.path.normpath(f"docs/{link}")) for link in links]
    sections["Packages"] = [f"reference/{package}.md" for package in _packages()]
    sections["Changes"] = ["changelog.md"]
    toml = {json.dumps(heading or "All pages"): json.dumps(links if len(links) > 1 else links[0])
            for heading, links in sections.items() if links}
    return "".join(f"  {{ {heading} = {links} }},\n" for heading, links in toml.items())


def _relinked(text: str, name: str) -> str:
    """The `text` of the file `name` with links to pages as they lie in the site."""
    def relinked(link: re.Match[str]) -> str:
        target = _page(os.path.normpath(PurePosixPath(name).parent / link[2]))
        return link[1] + os.path.relpath(target, PurePosixPath(_page(name)).parent)
    return _outside(CODE, partial(LINK.sub, relinked), _outside(FENCE, spaced, text))


def _sources_linked(text: str, name: str) -> list[str]:
    """The files outside of docs/ that the file `name` links and that are no pages, by their paths from the root."""
    targets = {os.path.normpath(PurePosixPath(name).parent / link[2]) for link in LINK.finditer(CODE.sub("", text))}
    return sorted(target for target in targets
                  if not target.startswith("docs/") and not target.endswith(".md") and (ROOT / target).is_file())


def _outside(code: re.Pattern[str], change: Callable[[str], str], text: str) -> str:
    """`text`, changed but for what `code` matches."""
    return "".join(part if place % 2 else change(part) for place, part in enumerate(code.split(text)))


def _page(name: str) -> str:
    """The path in the site of a file, by its path from the root."""
    return BESIDE.get(name) or name.removeprefix("docs/")


def _packages() -> dict[str, list[str]]:
    """The modules of every package, by its name."""
    found: dict[str, list[str]] = {}
    for package in PACKAGES:
        for init in sorted((ROOT / package).rglob("__init__.py")):
            name = ".".join(init.parent.relative_to(ROOT).parts)
            found[name] = [f"{name}.{module.stem}" for module in sorted(init.parent.glob("*.py"))
                           if module.stem != "__init__"]
    return found


if __name__ == "__main__":
    sys.exit(build(Path(sys.argv[1] if len(sys.argv) > 1 else "build/site").absolute()))
