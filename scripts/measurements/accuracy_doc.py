#!/usr/bin/env python3
"""accuracy_doc.py DIR [--run COUNTERPOINT] [--repeats N]: writes the measured part of docs/measurements/accuracy.md.

With --run, COUNTERPOINT first runs the reference set of data/scenes/accuracy into DIR/<scene>, one scene after another;
otherwise existing results are used. The text before "## Measured" stays; the rest is replaced, and the pictures are
copied to docs/images/accuracy. With --presets only the table of presets is run and written."""
import argparse
import json
import pathlib
import shutil
import subprocess
import textwrap

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENES = ROOT / "data/scenes/accuracy"
PAGE = ROOT / "docs/measurements/accuracy.md"
IMAGES = ROOT / "docs/images/accuracy"
WANTS = (1e-2, 1e-3, 1e-4, 1e-6)
NAMES = ("double_pendulum", "planar_chain", "heavy_top", "dzhanibekov", "slide_to_stop", "slide_to_roll",
         "arm_grasp", "humanoid_drop", "capsules_27")
WITH_CONTACTS = NAMES[4:8]  # without capsules_27, whose run takes long
MARK = "## Measured\n"


def run(binary, folder, repeats, only_presets):
    for name in WITH_CONTACTS if only_presets else NAMES:
        out = folder / name
        out.mkdir(parents=True, exist_ok=True)
        with open(out / "out.txt", "w", encoding="utf-8") as text:
            subprocess.run([binary, "accuracy", str(SCENES / f"{name}.yaml"), "--report", str(out),
                            "--json", str(out / "accuracy.json"), "--repeats", str(repeats),
                            "--want", ",".join(f"{w:g}" for w in WANTS),
                            *(("--vary", "preset") if only_presets else ())], stdout=text, check=True)
        print(name)


def figure(value):
    return "-" if value is None else f"{value:.2g}"


def seconds(value):
    for unit, scale in (("us", 1e-6), ("ms", 1e-3)):
        if value < 1000 * scale:
            return f"{value / scale:.3g} {unit}"
    return f"{value:.3g} s"


def point_of(report, family, setting):
    for f in report["families"]:
        if f["name"] == family:
            for p in f["points"]:
                if p["setting"] == setting:
                    return p
    return None


def order_text(report, name):
    for f in report["families"]:
        if f["name"] == name and f["vary"] == "integrator":
            if f["status"] != "ok":
                return "refused"
            return f"{f['order']:.2f}" if "order" in f else "-"
    return "-"


def overview(reports):
    lines = ["| scene | reference, its own error | order: Euler / midpoint / Runge-Kutta |"
             + "".join(f" cheapest for {w:g} |" for w in WANTS), "|---|---|---|" + "---|" * len(WANTS)]
    for name, r in reports.items():
        ref = r["reference"]
        text = ("closed form" if ref["kind"] == "analytic"
                else f"{ref['integrator']}, {seconds(ref['time_step_s'])}, {figure(ref['error'])}")
        orders = " / ".join(order_text(r, i)
                            for i in ("semi_implicit_euler", "implicit_midpoint", "runge_kutta_4"))
        line = f"| [{name}](#{name}) | {text} | {orders} |"
        for rec in r["recommendations"]:
            if rec["met"]:
                p = point_of(r, rec["family"], rec["setting"])
                line += f" {rec['setting']}: {seconds(p['cost_s_per_s'])} |"
            else:
                line += " none |"
        lines.append(line)
    return lines


def work_precision(r):
    """Table with one row per time step and one column per curve of the integrators, friction models and presets."""
    curves = [f for f in r["families"] if f["vary"] in ("integrator", "friction", "preset") and f["points"]
              and not (f["vary"] == "friction" and "same_as" in f)]
    steps = sorted({p["value"] for f in curves for p in f["points"]}, reverse=True)
    lines = ["| time step |" + "".join(f" {f['name']} |" for f in curves), "|---|" + "---|" * len(curves)]
    for step in steps:
        cells = []
        for f in curves:
            p = next((p for p in f["points"] if p["value"] == step), None)
            if p is None:
                cells.append("")
            elif p["status"] != "ok":
                cells.append(f"failed in {p['failed_pieces']} of {r['pieces']}")
            else:
                cells.append(f"{figure(p['error'])}, {seconds(p['cost_s_per_s'])}"
                             + ("" if p["above_reference"] else " *"))
        lines.append(f"| {seconds(step)} | " + " | ".join(cells) + " |")
    return lines


def sweeps(r):
    """Tables of the effect of compliance, smoothing and tolerance at the scene's time step."""
    lines = []
    for f in r["families"]:
        if f["parameter"] == "time_step_s" or not f["points"]:
            continue
        lines += ["", f"| {f['vary']} | error | time | creep [um/s] | rest [m] | inverse |", "|---|---|---|---|---|---|"]
        for p in f["points"]:
            if p["status"] != "ok":
                lines.append(f"| {p['value']:g} | failed in {p['failed_pieces']} of {r['pieces']} | | | | |")
                continue
            x = p.get("physics", {})
            creep = x.get("creep_m_s")
            lines.append(f"| {p['value']:g} | {figure(p['error'])} | {seconds(p['cost_s_per_s'])} | "
                         f"{figure(None if creep is None else 1e6 * creep)} | {figure(x.get('rest_m'))} | "
                         f"{figure(x.get('inverse_error'))} |")
    return lines


def physics(r):
    lines = ["| at the scene's step | primal [N] | dual [m/s] | complementarity [W] | overlap [m] | creep [um/s] | "
             "hover [m] | inverse | energy [J] |", "|---|---|---|---|---|---|---|---|---|"]
    for f in r["families"]:
        if f["vary"] not in ("integrator", "friction", "preset") or (f["vary"] == "friction" and "same_as" in f):
            continue
        for p in f["points"]:
            if abs(p["value"] / r["time_step_s"] - 1) > 1e-9 or "physics" not in p:
                continue
            x = p["physics"]
            creep = x.get("creep_m_s")
            lines.append(f"| {f['name']} | " + " | ".join(
                figure(v) for v in (x.get("primal_N"), x.get("dual_m_s"), x.get("complementarity_W"),
                                    x.get("penetration_m"), None if creep is None else 1e6 * creep,
                                    x.get("hover_m"), x.get("inverse_error"), x.get("energy_error_J"))) + " |")
    return lines if len(lines) > 2 else []


def presets(reports):
    """Table of `contact: fast | default | hard` at the scene's time step, for scenes with contacts."""
    lines = ["## Presets of contact", "",
             "`accuracy SCENE --vary preset`, at the scene's time step: error against the reference, processor time a",
             "simulated second, physics as below. Written by `scripts/measurements/accuracy_doc.py DIR --run COUNTERPOINT --presets`.", "",
             "| scene | preset | error | time | overlap [m] | creep [um/s] | hover [m] | inverse |",
             "|---|---|---|---|---|---|---|---|"]
    for name, r in reports.items():
        for f in r["families"]:
            for p in f["points"] if f["vary"] == "preset" else []:
                if abs(p["value"] / r["time_step_s"] - 1) > 1e-9:
                    continue
                x = p.get("physics", {})
                creep = x.get("creep_m_s")
                cells = [name, f["name"].removeprefix("contact ")]
                cells += ["failed", ""] if p["status"] != "ok" else [figure(p["error"]), seconds(p["cost_s_per_s"])]
                cells += [figure(v) for v in (x.get("penetration_m"), None if creep is None else 1e6 * creep,
                                              x.get("hover_m"), x.get("inverse_error"))]
                lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def put_presets(text, reports):
    """Returns the page with the section of presets replaced, before the measured part."""
    before = text.split("## Presets of contact")[0].split(MARK)[0]
    return before + presets(reports) + "\n" + MARK + text.split(MARK, 1)[1]


def orders(r):
    lines = []
    for f in r["families"]:
        if f["parameter"] != "time_step_s" or f["status"] != "ok" or "same_as" in f:
            continue
        pieces = f.get("order_of_pieces", [])
        if "order" not in f and not pieces:
            continue
        text = f"{f['name']} " + (f"{f['order']:.2f}" if "order" in f else "-")
        if pieces:
            text += (f" ({len(pieces)} single pieces {pieces[0]:.2f} to {pieces[-1]:.2f},"
                     f" median {pieces[len(pieces) // 2]:.2f})")
        lines.append(text)
    return "; ".join(lines)


def omissions(r):
    lines = []
    for f in r["families"]:
        if f["status"] != "ok":
            lines.append(f"* {f['name']} was not run: {f['message']}")
        for p in f["points"] if "same_as" not in f else []:
            if p["status"] != "ok":
                lines.append(f"* {p['setting']} failed in {p['failed_pieces']} of {r['pieces']} pieces: {p['message']}")
    return lines


def section(name, r):
    about = (SCENES / f"{name}.yaml").read_text(encoding="utf-8").split("\n")[0].lstrip("# ")
    ref = r["reference"]
    lines = ["", f"### {name}", "",
             f"{about} {r['pieces']} pieces of {seconds(r['piece_seconds'])}. Reference: {ref['description']}; "
             + (f"the engine's run at {seconds(ref['time_step_s'])} is {figure(ref['fine_deviation'])} off it."
                if ref["kind"] == "analytic" else f"its own error {figure(ref['error'])}.")]
    if "warning" in ref:
        lines += ["", f"Warning: {ref['warning']}."]
    lines += ["", f"![{name}: error against time](../images/accuracy/{name}.svg)", "",
              "Error, processor time a simulated second; *: below ten times the reference's own error.", ""]
    lines += work_precision(r)
    if text := orders(r):
        lines += ["", f"Orders: {text}."]
    if rows := physics(r):
        lines += [""] + rows
    lines += sweeps(r)
    if rows := omissions(r):
        lines += [""] + rows
    return lines


def wrapped(line):
    """Wraps prose at 120 columns; leaves tables, headings and pictures unchanged."""
    if len(line) <= 120 or line[0] in "|#!":
        return line
    return textwrap.fill(line, 119, subsequent_indent="  " if line.startswith("* ") else "",
                         break_long_words=False, break_on_hyphens=False)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--run")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--presets", action="store_true", help="only the table of contact: fast | default | hard")
    arguments = parser.parse_args()
    if arguments.run:
        run(arguments.run, arguments.folder, arguments.repeats, arguments.presets)
    reports = {name: json.loads((arguments.folder / name / "accuracy.json").read_text(encoding="utf-8"))
               for name in NAMES if (arguments.folder / name / "accuracy.json").exists()}
    PAGE.write_text(put_presets(PAGE.read_text(encoding="utf-8"), reports), encoding="utf-8")
    if arguments.presets:
        return
    lines = ["", "Written by scripts/measurements/accuracy_doc.py from runs of the reference set, data/scenes/accuracy. Times are of one "
             "machine, busy with other work; what they are to each other is what counts.", ""]
    lines += overview(reports)
    IMAGES.mkdir(parents=True, exist_ok=True)
    for name, report in reports.items():
        lines += section(name, report)
        shutil.copy(arguments.folder / name / "accuracy.svg", IMAGES / f"{name}.svg")
    head = PAGE.read_text(encoding="utf-8").split(MARK)[0]
    PAGE.write_text(head + MARK + "\n".join(map(wrapped, lines)) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
