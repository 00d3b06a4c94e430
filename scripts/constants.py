#!/usr/bin/env python3
"""Measures the effect of each named constant of collision/ and contact/: docs/measurements/constants.md.

    scripts/constants.py measure RESULTS.json    takes an hour: each constant times 0.1 and times 10
    scripts/constants.py table RESULTS.json      writes the table from these results
    scripts/constants.py check                   checks constants and values of the table (house.constants)
    scripts/constants.py count                   lists and counts the constants that steer a contact solve

`measure` builds a copy of the sources in which the environment can set a constant. Constants that determine sizes of
arrays, and those that only name a value such as 'none', are left out.
"""
import argparse
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
TABLE = ROOT / "docs/measurements/constants.md"
FACTORS = (0.1, 10.0)
WHOLE_FACTORS = (0.5, 2.0)
TESTS = ("collision_test", "contact_test")
SCENES = (("piles/pile_64", 1.0), ("piles/bin_64", 1.0), ("piles/pile_16_overlap", 1.0),
          ("piles/pile_64_masses", 0.5), ("humanoid_drop", 2.0), ("terrain", 1.0))
# Sizes of arrays and registers, geometric numbers, and names for 'none'.
NOT_TUNED = {"kCapacity", "kMaxPatch", "kNumTypes", "kLanes", "kColumns", "kPart", "kProducts", "kBase", "kFreeBody",
             "kMostOfSix", "kMaxRows", "kEdges", "kMost", "kDirections", "kSupportsAtOnce", "kRemembered", "kFree", "kFreeBodySize",
             "kConstrained", "kMaxPieces", "kMostPivoted", "kGolden", "kPlastic", "kNone", "kMaxVertices", "kMaxFaces"}
DECLARATION = re.compile(r"^(?P<lead>[ \t]*(?:inline |static )?)constexpr (?P<type>double|int) "
                         r"(?P<list>k[A-Z][^;{}]*?);", re.M | re.S)
TUNED_HEADER = """#pragma once
#include <cstdlib>
#include <cstring>
/// The value, or as many times it as the environment says: CONSTANT="file:name=factor".
inline double tuned_constant(const char* name, double value) {
  const char* set = std::getenv("CONSTANT");
  const char* end = set ? std::strchr(set, '=') : nullptr;
  const bool own = end && std::strlen(name) == std::size_t(end - set) && !std::strncmp(set, name, end - set);
  return own ? value * std::atof(end + 1) : value;
}
"""


def split(text):
    """Splits a list of declarators at its top-level commas."""
    parts, depth = [""], 0
    for char in text:
        depth += (char in "([{") - (char in ")]}")
        if char == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += char
    return parts


def is_tuned(match):
    items = split(match["list"])
    return "static " not in match["lead"] and not any(
        "[" in item.split("=")[0] or item.split("=")[0].strip() in NOT_TUNED for item in items)


def sources(root):
    return sorted(f for library in ("collision", "contact") for f in (root / library).rglob("*.[hc]*")
                  if f.suffix in (".h", ".cc"))


def constants(root=ROOT):
    """Lists all constants as (file:name, type, value as written)."""
    found = []
    for file in sources(root):
        for match in filter(is_tuned, DECLARATION.finditer(file.read_text())):
            for item in split(match["list"]):
                name, value = (part.strip() for part in item.split("=", 1))
                found.append((f"{file.relative_to(root)}:{name}", match["type"], re.sub(r"\s+", " ", value)))
    return found


def number(value):
    value = value.replace("std::numeric_limits<double>::epsilon()", "2.220446049250313e-16").replace("'", "")
    return eval(value, {"__builtins__": {}})  # pylint: disable=eval-used


def settings(kind, value):
    """Values to try instead of a constant. Values near 1, such as cosines or shares, vary by their distance from 1."""
    exact = number(value)
    for factor in FACTORS if kind == "double" else WHOLE_FACTORS:
        tried = 1 - (1 - exact) * factor if 0.9 <= exact <= 1.1 and kind == "double" else exact * factor
        tried = max(round(tried), 0) if kind == "int" else tried
        if tried != exact:
            yield factor, tried, tried / exact


def make_tunable(root):
    header = root / "tuned_constant.h"
    header.write_text(TUNED_HEADER)
    for file in sources(root):
        def declare(match, file=file):
            if not is_tuned(match):
                return match.group(0)
            cast = "int(" if match["type"] == "int" else "("
            parts = []
            for item in split(match["list"]):
                name, value = (part.strip() for part in item.split("=", 1))
                parts.append(f'{name} = {cast}tuned_constant("{file.relative_to(root)}:{name}", {value}))')
            lead = match["lead"].replace("inline ", "")
            return f"{lead}{'inline' if 'inline' in match['lead'] else 'static'} const {match['type']} " + \
                ", ".join(parts) + ";"
        text = file.read_text()
        changed = DECLARATION.sub(declare, text)
        if changed != text:
            include = f'#include "{header}"\n'
            changed = changed.replace("#pragma once\n", "#pragma once\n" + include, 1) \
                if "#pragma once" in changed else include + changed
            file.write_text(changed)


def run_all(bin_folder, constant, time_step=0.002):
    """Returns {test: failed names, scene: [Newton steps per step, their 99 %, softened, overlap, energy, hash]}."""
    environment = dict(os.environ, CONSTANT=constant)
    results = {}
    for test in TESTS:
        try:
            out = subprocess.run([bin_folder / test, "--gtest_brief=1"], env=environment, capture_output=True,
                                 text=True, timeout=120, cwd=ROOT, check=False).stdout
            results[test] = sorted(set(re.findall(r"\[  FAILED  \] (\S+?)[,\s]", out)))
        except subprocess.TimeoutExpired:
            results[test] = ["TIMEOUT"]
    for scene, duration in SCENES:
        with tempfile.NamedTemporaryFile(suffix=".json") as report:
            try:
                subprocess.run([bin_folder / "counterpoint", "simulate", f"data/scenes/{scene}.yaml", "--duration",
                                str(duration), "--timestep", repr(time_step), "--json", report.name],
                               env=environment, capture_output=True, timeout=300, cwd=ROOT, check=False)
                r = json.load(open(report.name))
                results[scene] = [r[key] for key in ("newton_iterations_mean", "newton_iterations_p99",
                                                     "softened_steps", "max_penetration_m", "energy_excess_J",
                                                     "state_hash")]
            except (subprocess.TimeoutExpired, json.JSONDecodeError, KeyError) as error:
                results[scene] = [type(error).__name__]
    return results


def measure(results_file):
    results = {}
    with tempfile.TemporaryDirectory() as scratch:
        root = pathlib.Path(scratch) / "sources"
        for name in subprocess.check_output(["git", "ls-files"], cwd=ROOT, text=True).split("\n"):
            left_out = name.startswith(("data/", "docs/images/", "tests/fuzz/corpus/"))
            if (ROOT / name).is_file() and not left_out:
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, root / name, follow_symlinks=False)
        (root / "data").symlink_to(ROOT / "data")
        make_tunable(root)
        build = pathlib.Path(scratch) / "build"
        subprocess.run(["cmake", "-G", "Ninja", "-S", root, "-B", build, "-DCMAKE_BUILD_TYPE=Release",
                        "-DCOUNTERPOINT_UNITY=ON"], check=True)
        subprocess.run(["ninja", "-C", build, *TESTS, "counterpoint"], check=True)
        results["base"] = run_all(build / "bin", "")
        for k in range(1, 6):  # spread of the same scenes by chance
            results[f"noise|{k}"] = [0.002 * (1 + k * 1e-9), run_all(build / "bin", "", 0.002 * (1 + k * 1e-9))]
        for name, kind, value in constants():
            for factor, tried, ratio in settings(kind, value):
                results[f"{name}|{factor}"] = [tried, run_all(build / "bin", f"{name}={ratio!r}")]
                pathlib.Path(results_file).write_text(json.dumps(results))
                print(f"{name} {tried:.3g}: {effect(results['base'], results[f'{name}|{factor}'][1])}", flush=True)


def steps_ratio(base, run):
    """Ratio of Newton steps to the base, geometric mean over the scenes that both finished."""
    ratios = [run[s][0] / base[s][0] for s, _ in SCENES if len(run[s]) > 2 and base[s][0] > 0 and run[s][0] > 0]
    return math.exp(sum(map(math.log, ratios)) / len(ratios))


def effect(base, run):
    """Effect of a change, in words."""
    words = []
    fails = sum(len(run[test]) for test in TESTS)
    unfinished = [scene for scene, _ in SCENES if len(run[scene]) < 3]
    if fails:
        words.append(f"**{fails} test{'s' if fails > 1 else ''}**")
    if unfinished:
        words.append("no end: " + ", ".join(scene.split("/")[-1] for scene in unfinished))
    if any(run[scene][-1] != base[scene][-1] for scene, _ in SCENES):
        softened = sum(run[s][2] - base[s][2] for s, _ in SCENES if len(run[s]) > 2)
        words.append(f"{steps_ratio(base, run):.2f}" + (f" ({softened:+d})" if softened else ""))
    return ", ".join(words) or "-"


def shown(value):
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def write_table(results_file):
    results = json.load(open(results_file))
    base = results["base"]
    spread = [steps_ratio(base, r[1]) for k, r in results.items() if k.startswith("noise|")]
    softened = [sum(r[1][s][2] - base[s][2] for s, _ in SCENES) for k, r in results.items() if k.startswith("noise|")]
    lines = [TEXT.format(spread=f"{min(spread):.2f} to {max(spread):.2f}",
                         softened=f"{min(softened):+d} to {max(softened):+d}",
                         scenes=", ".join(f"{s.split('/')[-1]} {d:g} s" for s, d in SCENES)).rstrip("\n")]
    file = None
    for name, kind, value in constants():
        where, constant = name.split(":")
        if where != file:
            file = where
            lines += ["", f"## [{where}](../../{where})", "", "| constant | value | less | more |", "|---|---|---|---|"]
        cells = {}
        for factor, tried, _ in settings(kind, value):
            run = results.get(f"{name}|{factor}")
            cell = f"{shown(tried)}: {effect(base, run[1])}" if run else "not measured"
            cells["less" if factor < 1 else "more"] = cell
        written = value.replace("std::numeric_limits<double>::epsilon()", "epsilon")
        lines.append(f"| {constant} | {written} | {cells.get('less', '')} | {cells.get('more', '')} |")
    TABLE.write_text("\n".join(lines) + "\n")


TEXT = """# Constants of collision and contact

This page shows what changes when a named constant is a tenth and ten times as large. Whole numbers are halved and
doubled; for numbers near 1, such as cosines and shares, the distance from 1 varies. The reason for each constant stands
beside it in the source. `scripts/constants.py` measures the table; `ctest -R house.constants` compares names and values
with the sources.

A cell gives the value and its effect:

* **n tests**: n of the 999 tests of `collision_test` and `contact_test` fail, since their statements do not hold with
  this value.
* a number: Newton steps per step over those with the original constant, geometric mean over the scenes below. In
  brackets: the change of the number of softened steps. By chance alone (time steps longer by 1e-9 to 5e-9 of their
  length) the first is {spread} and the second {softened}; only values beyond these ranges are significant.
* "not reached": no scene and no test executes the decision (found by reading the code, not measured).
* "-": all scenes give the same bits and no test fails. Such a constant bounds a loop, guards against a case that these
  scenes lack, or affects time alone (grids, orders of elimination). Constants that set array sizes are not listed.

Scenes, at time steps of 2 ms:
{scenes}.

The measurements are of different versions, whose random variation differs:

| constants | version | by chance: Newton steps, softened steps |
|---|---|---|
| all but those below | 2026-11-26, before the [correction of sleep in piles](../decisions/effects.md#sleep-is-a-memory-of-the-step-not-a-threshold) | 1.00 to 1.04, -7 to +17 |
| kGateSteps | after this correction | 1.02 to 1.04, +7 to +18 |
| kLittleSofter, kRaiseBelow | with Gauss-Seidel sweeps | 0.90 to 0.96, -10 to -26 |
| the others from kPathSigma to kSofterSteps in contact/solve/island_solver.cc; the others from kNear to kRaise in contact/solve/mixed_newton.cc | with paths that begin at the result of sweeps | 1.01 to 1.12, +2 to +33 |
| kMostReused | 2026-11-27, with reused factors; only the tests of `contact_test` | |

`scripts/constants.py count` counts the constants that steer a contact solve: 25. At commit f97f6684 it gave 62, and two
arrays held twelve more numbers.
Rows of contact/solve were measured before that [reduction](../decisions/solver.md#25-constants-steer-a-solve). Cells in
words are later: ratios of Newton steps of random and of recorded engine problems, with the change of unsolved and
softened ones.
"""


def check():
    text = TABLE.read_text()
    wrong = []
    section = {part.split("](")[0]: part for part in text.split("## [")[1:]}
    expected = set()
    for name, _, value in constants():
        where, constant = name.split(":")
        expected.add((where, constant))
        written = value.replace("std::numeric_limits<double>::epsilon()", "epsilon")
        if f"| {constant} | {written} |" not in section.get(where, ""):
            wrong.append(f"{name} = {written} is not in {TABLE.relative_to(ROOT)}: measure it (scripts/constants.py)")
    for where, part in section.items():
        for constant in re.findall(r"^\| (k\w+) ", part, re.M):
            if (where, constant) not in expected:
                wrong.append(f"{TABLE.relative_to(ROOT)} has {where}:{constant}, which is no more")
    for line in wrong:
        print(line)
    print(f"{len(expected)} constants: {len(wrong)} not as in the table")
    return 1 if wrong or len(expected) < 50 else 0


# Constants of contact/solve that limits of arithmetic and other constants determine.
DERIVED = {"kEpsilon", "kNothing", "kSoftest"}


def count():
    names = [name for name, _, _ in constants() if name.startswith("contact/solve/")]
    steering = [name for name in names if name.split(":")[1] not in DERIVED]
    print("\n".join(steering))
    print(f"{len(steering)} constants steer a contact solve")
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=("measure", "table", "check", "count"))
    parser.add_argument("results", nargs="?", help="JSON file")
    options = parser.parse_args()
    if options.action in ("check", "count"):
        return check() if options.action == "check" else count()
    if options.results is None:
        parser.error("give the file of results")
    (measure if options.action == "measure" else write_table)(options.results)
    return 0


if __name__ == "__main__":
    sys.exit(main())
