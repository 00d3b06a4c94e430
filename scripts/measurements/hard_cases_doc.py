#!/usr/bin/env python3
"""hard_cases_doc.py DIR: copies a report of `counterpoint hard-cases --report DIR` to docs/measurements/hard-cases.md.

The text before the table stays; the table and the text after it are replaced, and the pictures are copied."""
import pathlib
import re
import shutil
import sys
import textwrap

report = pathlib.Path(sys.argv[1])
docs = pathlib.Path(__file__).resolve().parents[2] / "docs"
page = docs / "measurements/hard-cases.md"
intro = page.read_text(encoding="utf-8").split("\n| case | what is measured |")[0]
table = (report / "hard-cases.md").read_text(encoding="utf-8")
lines = [line if line.startswith("|") or len(line) <= 120
         else textwrap.fill(line, 119, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
         for line in table.split("\n")]
table = "\n".join(lines)
page.write_text(intro + "\n" + re.sub(r"\]\((\w+\.svg)\)", r"](../images/hard/\1)", table), encoding="utf-8")
for picture in sorted(report.glob("*.svg")):
    shutil.copy(picture, docs / "images/hard" / picture.name)
