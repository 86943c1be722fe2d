"""Splits Rust source into code and comments, for the checks that read either."""

import re
from pathlib import Path
from typing import Iterator, NamedTuple


class Comment(NamedTuple):
    """Consecutive lines of one kind of comment, without their marks."""

    line: int
    # "//!", "///" or "//".
    mark: str
    text: str


# Raw strings end at a quote with as many hashes; a lifetime is no character.
_TOKEN = re.compile(
    r"""
    (?P<line>//[^\n]*)
    | (?P<block>/\*)
    | (?P<raw>\b(?:b|c)?r(?P<hashes>\#*)"[\s\S]*?"(?P=hashes))
    | (?P<string>"(?:\\[\s\S]|[^"\\])*")
    | (?P<char>'(?:\\(?:x[0-9a-fA-F]{2}|u\{[^}]*\}|[^xu])|[^'\\\n])')
    """,
    re.VERBOSE,
)
_BLOCK_EDGE = re.compile(r"/\*|\*/")


def _blank(text: str) -> str:
    """The same number of lines and characters, without content."""
    return re.sub(r"[^\n]", " ", text)


def _end_of_block(source: str, at: int) -> int:
    """Where the block comment at `at` ends; block comments nest."""
    depth = 0
    for edge in _BLOCK_EDGE.finditer(source, at):
        depth += 1 if edge.group() == "/*" else -1
        if depth == 0:
            return edge.end()
    return len(source)


def split(source: str) -> tuple[str, list[tuple[int, str]]]:
    """The code with comments and literals blanked, and each line of comment with its number."""
    code: list[str] = []
    comments: list[tuple[int, str]] = []
    at = 0
    while token := _TOKEN.search(source, at):
        code.append(source[at : token.start()])
        end = _end_of_block(source, token.start()) if token["block"] else token.end()
        text = source[token.start() : end]
        if token["line"] or token["block"]:
            first = source.count("\n", 0, token.start()) + 1
            comments.extend(enumerate(text.split("\n"), first))
        code.append(_blank(text))
        at = end
    code.append(source[at:])
    return "".join(code), comments


def comments_of(source: str) -> Iterator[Comment]:
    """The comments of a file; neighbouring lines with one mark are one comment. No examples of code."""
    mark, first, last, lines = "", 0, 0, []
    fenced = False
    for number, text in split(source)[1]:
        found = re.match(r"\s*(//!|///|//|/\*[*!]?|\*)?\s?", text)
        new_mark = found.group(1) or "*"
        if new_mark != mark or number != last + 1:
            if lines:
                yield Comment(first, mark, "\n".join(lines))
            mark, first, lines, fenced = new_mark, number, [], False
        last = number
        words = text[found.end() :]
        if words.startswith("```"):
            fenced = not fenced
            words = ""
        lines.append("" if fenced else words)
    if lines:
        yield Comment(first, mark, "\n".join(lines))


def rust_files(folder: Path) -> list[Path]:
    """The Rust files below a folder, in order, without what cargo builds."""
    return sorted(
        path for path in folder.rglob("*.rs") if "target" not in path.relative_to(folder).parts
    )
