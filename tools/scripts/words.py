#!/usr/bin/env python3
"""Counts phrases in the comments of Rust files that a reader has to read twice.

usage: words.py [--list] [FOLDER...]      folders of the repository; all of its Rust files if none

Prints the count per 1,000 words of comment for each folder, and the places in the folders above the
limit; --list prints all places. The head of a module that begins with "This file" or "This folder" is
a failure by itself: a head says what the module is for.

Exit code: 0 passed, 1 a folder is above the limit or a head begins so, 2 wrong usage.
"""

import re
import sys
from collections import Counter, defaultdict
from pathlib import Path

from rust_text import comments_of, rust_files

# Per 1,000 words of comment. ripgrep and memchr stay below 1.
LIMIT = 1.5

# The beginning of a sentence: of a comment, of a paragraph, of a list item, or after a full stop.
START = r"(?:(?<![\s\S])|(?<=\n\n)|(?<=[.:;]\s)|(?<=[-*]\s))"
# The words that follow "those" where it stands for a noun; before a noun it is a plain adjective.
NO_NOUN = (
    r"(?=\s+(?:of|that|which|who|whose|in|on|at|with|without|behind|before|after|between|beside|from|for|"
    r"to|by|are|were|is|it|they|there|where|and|or|not|have|do|may|must|can|come|lie|stand)\b|\s*[.,;:)])"
)
# Words before "what" that make the clause stand for a noun. "says what was expected", "know what to do"
# and questions are ordinary English.
CLAUSE = r"(?:of|from|with|without|to|for|by|in|than|as|but|all|only|beside|besides|just)"

PHRASES = {
    # "Finds those that never move" -> "Collects the indices of static bodies".
    "those": rf"\b[Tt]hose\b{NO_NOUN}",
    # "What there is one of in each bank." -> "One `T` per bank."
    # "but for what a file maps" -> "but for mapped files".
    "what": rf"{START}What(?:ever)?\b(?![^.]*\?)|\b{CLAUSE}\s+what\b(?!\s+(?:to|is|was)\s+(?:do|expected|found)\b)",
    # "Issues of which all beats are there." -> "Issues whose beats have all arrived."
    "of which": r"\b(?:[Oo]f|[Aa]mong)\s+(?:which|those|all\s+that)\b|\b[Aa]ll\s+that\b",
    # "Of a collision the normal comes first." -> "The normal of a collision comes first."
    "Of a ...": rf"{START}Of\s+(?:an?|the|all|each|every|both|one|two|three|its?|their|many|several)\b",
    # "as [`soon_alone`], of so many" -> "prefetches `N` elements".
    "so many": r"\b(?:[Ss]o|[Tt]hat|[Aa]s)\s+(?:many|much|few)\b(?!\s+as\b|\s+\w+\s+as\b)",
    # "whoever reads it" -> "the reader"; "nobody's" -> "of no profile".
    "whoever": r"\b(?:[Ww]ho(?:so)?ever|[Ww]homever|[Ww]hichever|[Nn]obody(?:'s)?|[Ss]omebody(?:'s)?)\b",
    # "where it is said", "no one is asked" -> name the part that prints, reads or decides.
    "is said": r"\b(?:is|are|was|were|be|been|being)\s+(?:not\s+|never\s+|only\s+)?"
    r"(?:said|told|asked|looked\s+(?:at|for|into)|spoken\s+of|thought\s+of|gone\s+through|come\s+by|gone\s+by)\b",
    # "none on those that there are not" -> name the things and their number.
    "there are": r"\b(?:that|which|what|as|than|so)\s+there\s+(?:is|are|was|were)\b|\b[Nn]one\s+(?:on|of|in|that)\b",
}
PATTERNS = {name: re.compile(pattern) for name, pattern in PHRASES.items()}
HEAD = re.compile(r"This (?:file|folder)\b")
WORD = re.compile(r"[^\W\d_][\w'’-]*")


class Folder:
    """What the comments of one folder add up to."""

    def __init__(self):
        self.words = 0
        self.hits: list[tuple[str, int, str, str]] = []
        self.heads: list[tuple[str, int]] = []

    def rate(self) -> float:
        return 1000 * len(self.hits) / self.words if self.words else 0.0

    def is_above(self) -> bool:
        """One hit says nothing about a folder of a few hundred words."""
        return len(self.hits) > 1 and self.rate() > LIMIT


def read(path: Path, shown: str, folder: Folder) -> None:
    head_is_open = True
    for comment in comments_of(path.read_text(encoding="utf-8")):
        # Code in a sentence counts as one word, and is none of the phrases.
        text = re.sub(r"`[^`\n]*`", lambda code: "`" + "x" * (len(code.group()) - 2) + "`", comment.text)
        folder.words += len(WORD.findall(text))
        if head_is_open and comment.mark == "//!" and HEAD.match(text):
            folder.heads.append((shown, comment.line))
        head_is_open = head_is_open and comment.mark != "//!"
        for name, pattern in PATTERNS.items():
            for hit in pattern.finditer(text):
                at = hit.start() + len(hit.group()) - len(hit.group().lstrip())
                line = comment.line + text.count("\n", 0, at)
                folder.hits.append((shown, line, name, text.split("\n")[line - comment.line].strip()))


def room(path: Path) -> str:
    """The folder that a file counts for: the crate's source folder, and one level below it."""
    parts = path.parts[:-1]
    if "src" in parts:
        parts = parts[: parts.index("src") + 2]
    elif "tests" in parts:
        parts = parts[: parts.index("tests") + 1]
    return "/".join(parts) or "."


def main(arguments: list[str]) -> int:
    if "--help" in arguments or "-h" in arguments:
        print(__doc__.strip())
        return 0
    list_all = "--list" in arguments
    names = [argument for argument in arguments if argument != "--list"]
    repository = Path(__file__).resolve().parents[2]
    roots = [Path(name) for name in names] or [repository]
    folders: dict[str, Folder] = defaultdict(Folder)
    total = Folder()
    for root in roots:
        files = rust_files(root) if root.is_dir() else []
        if not files:
            print(f"{root}: no folder with Rust files", file=sys.stderr)
            return 2
        for path in files:
            shown = path.relative_to(repository) if not names else path
            read(path, str(shown), folders[room(shown)])
    failed = False
    for name, folder in sorted(folders.items()):
        total.words += folder.words
        total.hits += folder.hits
        above = folder.is_above()
        failed |= above or bool(folder.heads)
        if above or list_all:
            for file, line, phrase, text in folder.hits:
                print(f"{file}:{line}: {phrase}: {text}")
        for file, line in folder.heads:
            print(f"{file}:{line}: the head begins with \"This file\" or \"This folder\"")
    print(f"\n{'phrases per 1,000 words':<44} {'words':>7} {'hits':>5} {'rate':>5} {'heads':>5}")
    for name, folder in sorted(folders.items()):
        verdict = "  above the limit" if folder.is_above() else ""
        print(f"{name:<44} {folder.words:>7} {len(folder.hits):>5} {folder.rate():>5.1f} {len(folder.heads):>5}{verdict}")
    print(f"{'all':<44} {total.words:>7} {len(total.hits):>5} {total.rate():>5.1f}")
    print("by phrase:", ", ".join(f"{name} {n}" for name, n in Counter(hit[2] for hit in total.hits).most_common()))
    if failed:
        print(f"expected at most {LIMIT} per 1,000 words in each folder, and no such head", file=sys.stderr)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
