#!/usr/bin/env python3
"""Prints README.md and all files of the repository that it leads to by relative links, from page to page.

usage: pages.py
Exit code: 0 done, 1 a link leads to no file of the repository, 2 wrong usage.
"""

import os
import re
import sys

# A link or picture in Markdown, or an attribute of HTML; without the place in the page behind "#".
LINK = re.compile(r'\]\(([^)#\s]+)[^)]*\)|(?:src|href|srcset)="([^"#]+)"')


def links(page):
    """The relative links of a page, as paths from the repository's root."""
    with open(page, encoding="utf-8") as file:
        text = re.sub(r"```.*?```", "", file.read(), flags=re.DOTALL)
    for match in LINK.finditer(text):
        link = match[1] or match[2]
        if "://" not in link:
            yield os.path.normpath(os.path.join(os.path.dirname(page), link))


def main():
    if len(sys.argv) > 1:
        print(__doc__, file=sys.stderr)
        return 2
    os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
    found, waiting, lost = set(), ["README.md"], []
    while waiting:
        path = waiting.pop()
        if path in found:
            continue
        found.add(path)
        if not path.endswith(".md"):
            continue
        for link in links(path):
            if os.path.isfile(link):
                waiting.append(link)
            else:
                lost.append(f"{path}: {link} is no file of the repository")
    print("\n".join(lost), file=sys.stderr, end="\n" if lost else "")
    print("\n".join(sorted(found)))
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main())
