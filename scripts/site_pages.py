#!/usr/bin/env python3
"""site_pages.py SITE: adapts the copied pages to the site. Copies pages beside sources (contact/README.md, ...) to
SITE/sources, adjusts links to them, and replaces links to other sources by text."""

import os
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
BESIDE = {"contact/README.md": "sources/contact.md", "data/README.md": "sources/data.md",
          "README.md": "sources/readme.md", "CONTRIBUTING.md": "sources/contributing.md"}


def main():
    site = pathlib.Path(sys.argv[1]).resolve()
    for source, target in BESIDE.items():
        if (ROOT / source).exists():
            (site / target).write_text((ROOT / source).read_text(encoding="utf-8"), encoding="utf-8")
    origin = {site / target: ROOT / source for source, target in BESIDE.items()}
    for page in site.rglob("*.md"):
        place = origin.get(page, ROOT / "docs" / page.relative_to(site))

        def link(match):
            text, target = match.group(1), match.group(2)
            path, mark, fragment = target.partition("#")
            if re.match(r"[a-z]+:", target) or not path:
                return match.group(0)
            real = os.path.relpath((place.parent / path).resolve(), ROOT)
            if real in BESIDE and (site / BESIDE[real]).exists():
                new = site / BESIDE[real]
            elif real == "docs/README.md":
                new = site / "index.md"
            elif real.startswith("docs/") and (ROOT / real).is_file():
                new = site / real[len("docs/"):]
            else:
                return f"{text} (`{real}`)"
            return f"[{text}]({os.path.relpath(new, page.parent)}{mark}{fragment})"

        text = page.read_text(encoding="utf-8")
        page.write_text(re.sub(r"\[([^\]]*)\]\(([^)\s]+)\)", link, text), encoding="utf-8")


if __name__ == "__main__":
    main()
