#!/usr/bin/env python3
"""Benchmark figures over time: records medians of counterpoint_bench and compares two commits.

    scripts/benchmarks.py record --repeat 9          # an idle machine, a release build
    scripts/benchmarks.py compare 276535c0 a25e3120  # exit code 1 if something got slower

`record` appends one row per benchmark to docs/measurements/benchmarks/PROCESSOR.csv, with the
median and the interquartile range of its repetitions [ns], the commit and the date. `compare`
prints the benchmarks whose medians differ by more than the noise: by more than 3 times the larger
interquartile range, and by more than 2 %. Figures of different processors are never compared.
"""
import argparse
import csv
import datetime
import json
import pathlib
import re
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
FOLDER = ROOT / "docs/measurements/benchmarks"
COLUMNS = ("name", "median_ns", "iqr_ns", "commit", "date")
NOISE_RANGES = 3.0  # a smaller difference of medians is noise [interquartile ranges]
NOISE_SHARE = 0.02  # and so is one below this share of the old median
NANOSECONDS = {"ns": 1.0, "us": 1e3, "ms": 1e6, "s": 1e9}


def processor_file():
    """The table of this machine's processor."""
    found = re.search(r"^model name\s*:\s*(.*)$", pathlib.Path("/proc/cpuinfo").read_text(), re.M)
    name = found.group(1) if found else "unknown"
    return FOLDER / (re.sub(r"[^A-Za-z0-9.-]+", "_", name).strip("_") + ".csv")


def measured_commit():
    """The commit of the work tree, with `-dirty` where tracked files differ from it."""
    words = ["git", "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def summarize(report):
    """(name, median, interquartile range) [ns] of each benchmark of a report of Google Benchmark.

    Times are those of the processor, or of the clock where the benchmark asks for real time.
    """
    times = {}
    for run in report["benchmarks"]:
        if run.get("run_type") == "iteration" and not run.get("error_occurred"):
            name = run["run_name"]
            kind = "real_time" if name.endswith("/real_time") else "cpu_time"
            times.setdefault(name, []).append(run[kind] * NANOSECONDS[run["time_unit"]])
    for name, values in times.items():
        quarters = statistics.quantiles(values, n=4, method="inclusive")
        yield name, quarters[1], quarters[2] - quarters[0]


def record(build, repeat):
    """Runs the benchmarks and appends their medians to the table of this processor."""
    if repeat < 2:
        sys.exit("error: --repeat: expected 2 or more, the noise is measured between repetitions")
    program = build / "bin/counterpoint_bench"
    if not program.is_file():
        sys.exit(f"error: {program} is missing: build it with ninja -C {build} counterpoint_bench")
    commit, date = measured_commit(), datetime.date.today().isoformat()
    words = [program, f"--benchmark_repetitions={repeat}", "--benchmark_format=json"]
    done = subprocess.run(words, stdout=subprocess.PIPE, text=True, check=True)
    rows = list(summarize(json.loads(done.stdout)))
    file = processor_file()
    file.parent.mkdir(parents=True, exist_ok=True)
    is_new = not file.exists()
    with file.open("a", encoding="utf-8", newline="") as stream:
        table = csv.writer(stream, lineterminator="\n")
        if is_new:
            table.writerow(COLUMNS)
        for name, median, spread in rows:
            table.writerow([name, f"{median:.6g}", f"{spread:.3g}", commit, date])
    print(f"{file}: {len(rows)} benchmarks of {commit}")


def read_commit(file, commit):
    """Name -> (median, interquartile range) [ns] of a commit; its last record where it has more."""
    with file.open(encoding="utf-8", newline="") as stream:
        rows = [row for row in csv.DictReader(stream) if row["commit"].startswith(commit)]
    rows = [row for row in rows if row["commit"] == commit] or rows
    commits = sorted({row["commit"] for row in rows})
    if len(commits) != 1:
        found = ", ".join(commits) or "none"
        sys.exit(f"error: {file}: expected one commit that begins with {commit}, found {found}")
    return {row["name"]: (float(row["median_ns"]), float(row["iqr_ns"])) for row in rows}


def compare(file, old_commit, new_commit):
    """Prints the benchmarks that changed by more than noise. Returns whether one got slower."""
    if not file.is_file():
        sys.exit(f"error: {file} is missing: record figures first, or name a table by --file")
    old, new = read_commit(file, old_commit), read_commit(file, new_commit)
    slower = faster = 0
    common = [name for name in old if name in new]
    for name in common:
        (before, spread_before), (after, spread_after) = old[name], new[name]
        change = after - before
        noise = max(NOISE_RANGES * max(spread_before, spread_after), NOISE_SHARE * before)
        if abs(change) > noise:
            slower += change > 0
            faster += change < 0
            word = "slower" if change > 0 else "faster"
            print(f"{word}  {name:<48} {before:12.4g} -> {after:12.4g} ns  {change / before:+.1%}")
    for name in sorted(old.keys() ^ new.keys()):
        print(f"only in {old_commit if name in old else new_commit}: {name}")
    print(f"{len(common)} benchmarks: {slower} slower, {faster} faster, the others within noise")
    return slower > 0


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("record", help="run the benchmarks and append their medians")
    one.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release",
                     help="build folder, default build/release")
    one.add_argument("--repeat", type=int, default=5, help="repetitions, default 5")
    two = commands.add_parser("compare", help="what changed by more than noise")
    two.add_argument("old", metavar="OLD", help="commit, or its first digits")
    two.add_argument("new", metavar="NEW", help="commit, or its first digits")
    two.add_argument("--file", type=pathlib.Path, help="table, default that of this processor")
    options = parser.parse_args()
    if options.command == "record":
        record(options.build, options.repeat)
        return 0
    return int(compare(options.file or processor_file(), options.old, options.new))


if __name__ == "__main__":
    sys.exit(main())
