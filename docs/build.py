"""Build the site into docs/_build/html: ``python docs/build.py``.

Every warning is an error, pictures and notebooks are executed, nothing is fetched.  The page of audited claims is made
from `results/claims/library.json`, or by new audits where that is not of the entries as they stand; that of the command
line from the program (command_reference.py), of published numbers, engines and reports from `results/`.  Then every
link inside the site is followed, the reference of Python is searched for names that are no part of the interface, and
the words of pages, docstrings and messages are looked up among common misspellings.
Exit code 1 where anything was found.  ``--fresh`` executes notebooks again that have not changed.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from time import perf_counter
from urllib.parse import unquote, urlsplit

import command_reference

DOCS = Path(__file__).resolve().parent
OUT = DOCS / "_build" / "html"
CLAIMS = DOCS / "_build" / "claims.md"
COMMANDS = DOCS / "_build" / "commands.md"
ENGINES = DOCS / "_build" / "engines.md"
PUBLIC_NUMBERS = DOCS / "_build" / "public.md"
REPORTS = OUT / "results"
ROOT = DOCS.parent
SPELLED = [
    "README.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "docs",
    "results",
    "examples",
    "src",
    "benchmarks",
    "tools",
    "validation",
]

PUBLIC = ("heavytop.plot.", "heavytop.integrate.peers.double.", "heavytop.api.integrators.check_integrator")
"""What the reference of Python shows beside the names of ``heavytop`` itself."""


class Page(HTMLParser):
    """The anchors of a page and what it links to."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.feed(path.read_text("utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Called by HTMLParser."""
        for key, value in attrs:
            if key in ("id", "name") and value:
                self.anchors.add(value)
            if key in ("href", "src") and value:
                self.links.append(value)


def broken_links(site: Path) -> list[str]:
    """Links of the site to a file or an anchor of it that is not there."""
    pages = {path.resolve(): Page(path) for path in site.rglob("*.html")}
    found = []
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            missing = not target.exists() or (
                parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].anchors
            )
            if missing:
                found.append(f"{path.relative_to(site)}: {link}")
    return found


def internals(site: Path) -> list[str]:
    """Names of the reference of Python that are no part of the interface: of inner rooms, and private ones."""
    page = (site / "api.html").read_text("utf-8")
    text = unescape(re.sub(r"<[^>]+>", "", page[page.index("<article") : page.index("</article>")]))
    names = set(re.findall(r"heavytop\.[a-z_]+\.\w+(?:\.\w+)*|(?<![\w.])_[A-Za-z]\w*", text))
    return [f"api.html: {name} is not part of the interface" for name in sorted(names) if not name.startswith(PUBLIC)]


def misspelt() -> list[str]:
    """Common misspellings, by codespell; ``docs/words.txt`` lists the words that are right here."""
    command = [sys.executable, "-m", "codespell_lib", "--ignore-words", str(DOCS / "words.txt")]
    skip = "--skip=*.svg,*.html,*.json,*.jsonl,*.css,*.sha256,_build,__pycache__"
    done = subprocess.run([*command, skip, *SPELLED], cwd=ROOT, capture_output=True, text=True, check=False)
    return (done.stdout + done.stderr).splitlines()


def write_claims() -> None:
    """The part of the page of audited claims that is made from the library."""
    import msgspec

    sys.path.insert(0, str(ROOT / "tools"))
    from claim_library import Library, document, is_current
    from claims_page import page

    kept = ROOT / "results" / "claims" / "library.json"
    found = msgspec.json.decode(kept.read_bytes(), type=Library) if kept.exists() else None
    if found is None or not is_current(found):
        print("results/claims is not of the entries as they stand: every claim is audited")
        found = document()
    CLAIMS.parent.mkdir(parents=True, exist_ok=True)
    CLAIMS.write_text(page(found), "utf-8")


def write_public() -> None:
    """The tables of published numbers, from `results/public`."""
    from public_verdicts import page

    PUBLIC_NUMBERS.write_text(page(json.loads((ROOT / "results" / "public" / "verdicts.json").read_bytes())), "utf-8")


def write_engines() -> None:
    """The tables and pictures of the page of engines."""
    from engines_page import page

    ENGINES.write_text(page(sorted((ROOT / "results" / "engines").iterdir()), ENGINES.parent), "utf-8")


def write_reports() -> None:
    """The page of each report of `results/`, as `show --html` writes it."""
    import heavytop as ht

    REPORTS.mkdir(parents=True, exist_ok=True)
    for digest in sorted((ROOT / "results").glob("*/report.json.sha256")):
        (REPORTS / f"{digest.parent.name}.html").write_text(ht.read_report(digest.parent).to_html(), "utf-8")


def main() -> int:
    """Build and check; returns the exit code."""
    parser = argparse.ArgumentParser(description="Build the site and check its links and spelling.")
    parser.add_argument("--fresh", action="store_true", help="execute everything again")
    if parser.parse_args().fresh:
        shutil.rmtree(DOCS / "_build", ignore_errors=True)
    began = perf_counter()
    write_claims()
    write_public()
    COMMANDS.write_text(command_reference.markdown(), "utf-8")
    write_engines()
    sphinx = [sys.executable, "-m", "sphinx", "-q", "-E", "-W", "--keep-going", "-n", "-b", "html", str(DOCS), str(OUT)]
    built = subprocess.run(sphinx, stderr=subprocess.PIPE, text=True, check=False)
    # the kernels of notebooks talk over the loopback device, and say so each time
    print(*[line for line in built.stderr.splitlines() if not line.startswith("[IPKernelApp]")], sep="\n")
    if built.returncode:
        return built.returncode
    write_reports()
    found = [*broken_links(OUT.resolve()), *internals(OUT), *misspelt()]
    print("\n".join([*found, f"site: {OUT.relative_to(ROOT)}/index.html, {perf_counter() - began:.0f} s"]))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
