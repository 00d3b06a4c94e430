#!/usr/bin/env python3
"""hard_cases_doc.py DIR...: copies reports of `counterpoint hard-cases --report DIR --json DIR/hard-cases.json` to
docs/measurements/hard-cases.md; those of several runs follow one another.

The text before the table stays, except the list of runs; the tables and the text after them are replaced, and the
pictures are copied."""
import datetime
import json
import pathlib
import re
import shutil
import sys
import textwrap

import marked

SETTINGS, REASONS = "## Settings of MuJoCo best", "## What makes them hard"
FEW = 20  # cases of a run whose names the page lists
docs = pathlib.Path(__file__).resolve().parents[2] / "docs"
page = docs / "measurements/hard-cases.md"


def parts(report):
    """Returns the table of a report, that of chosen settings and the remarks on its cases, as lines."""
    text, reasons = (report / "hard-cases.md").read_text(encoding="utf-8").split(REASONS)
    table, _, settings = text.partition(SETTINGS)
    return [[line for line in part.split("\n") if line] for part in (table, settings, reasons)]


def joined(tables):
    """Returns tables of the same columns as one, with the header of the first that has rows."""
    tables = [t for t in tables if t]
    return tables[0][:2] + [row for t in tables for row in t[2:]] if tables else []


def run_of(report):
    """Returns a line about the run: its cases, how MuJoCo was set, its version, the day."""
    file = report / "hard-cases.json"
    cases = json.loads(file.read_text(encoding="utf-8"))["cases"]
    day = datetime.date.fromtimestamp(file.stat().st_mtime).isoformat()
    best = [p for c in cases for p in c.get("peers", []) if p["name"] == "MuJoCo best"]
    names = f"{len(cases)} cases" if len(cases) > FEW else ", ".join(f"`{c['name']}`" for c in cases)
    if not best:
        return f"* {names}: without MuJoCo, {day}"
    how = "search" if any("settings_tried" in p for p in best) else "fixed"
    passed = [sum(p["status"] == "passed" for c in cases for p in c.get("peers", []) if p["name"] == name)
              for name in ("MuJoCo default", "MuJoCo best")]
    line = (f"* {names}: `--peers {how}`, MuJoCo {best[0]['version']}, {day}; passed: Counterpoint "
            f"{sum(c['status'] == 'passed' for c in cases)}, MuJoCo default {passed[0]}, best {passed[1]}")
    return textwrap.fill(line, 119, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)


reports = [pathlib.Path(name) for name in sys.argv[1:]]
table, settings, reasons = ([p[i] for p in map(parts, reports)] for i in range(3))
settings = joined(settings)
lines = [*joined(table), "", *([SETTINGS, "", *settings, ""] if settings else []), REASONS, "", *sum(reasons, [])]
lines = [line if line.startswith("|") or len(line) <= 120
         else textwrap.fill(line, 119, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
         for line in lines]
intro = page.read_text(encoding="utf-8").split("\n| case | what is measured |")[0]
text = re.sub(r"\]\((\w+\.svg)\)", r"](../images/hard/\1)", "\n".join(lines))
page.write_text(f"{intro}\n{text}\n", encoding="utf-8")
marked.write(page, "runs", "".join(run_of(report) + "\n" for report in reports))
for picture in sorted(p for report in reports for p in report.glob("*.svg")):
    shutil.copy(picture, docs / "images/hard" / picture.name)
