#!/usr/bin/env python3
"""check_docs.py [ROOT]: everything that documents name exists.

Checked in every Markdown page but the changelog:
* paths of files and folders (`engine/step/step.cc`, `tests/engine/`, a bare `rnea.cc`), with wildcards;
* `counterpoint SUBCOMMAND --option`, and options named alone, against docs/reference/options.md, which a test compares
  with the command itself (docs.options); options of scripts against the script;
* tests: `Suite.Name`, patterns of `ctest -R` and of --gtest_filter; CMake options -DCOUNTERPOINT_...; C++ names A::b;
* words that are not of the field (PRIVATE_WORDS);
* decision records: a date, and the four parts (PARTS) in order.

Exit code 1 and a line for each finding. Needs no build."""

import fnmatch
import pathlib
import re
import subprocess
import sys

SOURCES = r"(?:h|cc|py|pyi|sh|mjs|js|cmake|md|yaml|urdf|csv|txt)"
PATH = re.compile(r"(?<![\w/.$<~{-])((?:[\w.*<>-]+/)+(?:[\w.*<>-]+\." + SOURCES + r")?)(?![\w/])")
BARE = re.compile(r"(?<![\w/.$<>*{-])([\w-]+\.(?:h|cc|py|sh|mjs))(?![\w/])")
TEST_MACRO = re.compile(r"^(?:TYPED_)?TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\)", re.M)
CODE = re.compile(r"^```[^\n]*\n(.*?)^```|^((?:    [^\n]*\n)+)|`([^`\n]+)`", re.M | re.S)
COMMAND = re.compile(r"(?<!import)(?:^|[\s/;(|&])counterpoint ((?:[^\n\\#|;]|\\\n)*)")
# Options of programs that are not ours, and of our test programs and benchmarks.
FOREIGN = {"--preset", "--prefix", "--build", "--install", "--test-dir", "--output-on-failure", "--target", "--dest",
           "--no-build-isolation", "--no-index", "--no-deps", "--symlink-install", "--gtest_filter", "--gtest_output",
           "--exclude-libs", "--nodes", "--ntasks-per-node", "--cpus-per-task", "--cpu-bind", "--array", "--time",
           "--mpi",
           "--benchmark_filter", "--benchmark_min_time", "--gtest_repeat", "--parallel"}
# Not of the field, or history: what to write instead, in documents and in code.
PRIVATE_WORDS = {
    r"forecast(?:s|ed)?": "velocity predictor, predicted velocity",
    r"mended": "corrected",
    r"throws? of (?:the )?dice": "erratic convergence",
    r"culprits?": "failure cause",
    r"closing[_ ]watch": "stalled closure detector",
    r"movers?\b": "engine adapter",
    r"tie[_ ]solver": "equality solver",
    r"fast[_ ]trees": "energy projection",
    r"dearest|dearer": "most expensive",
    r"(?:skips?|said) aloud": "reports",
    r"not run so far|so far,? not": "say what is, not when",
    r"notary|the house\b": "the plain word",
}
# Pages that quote the output of other programs, or name results of a build or a user.
GENERATED = ("docs/reference/python.md", "docs/reference/options.md")
PARTS = ("Context", "Choice", "Evidence", "Consequences")
USER_ROOTS = ("build", "out", "DIR", "PREFIX", "ROBOTS", "~")


def listed_files(root):
    try:
        found = subprocess.run(["git", "-C", root, "ls-files", "-co", "--exclude-standard"], capture_output=True,
                               text=True, check=True)
        names = found.stdout.split("\n")
    except (OSError, subprocess.CalledProcessError):  # no git, or an archive
        names = [str(p.relative_to(root)) for p in root.rglob("*")
                 if p.is_file() and not {"build", ".git", "out"} & set(p.relative_to(root).parts)]
    return [name for name in names if name and (root / name).is_file()]


class Sources:
    """Names that documents may use: files, tests, options, words of the sources."""

    def __init__(self, root):
        self.root = root
        self.files = listed_files(root)
        self.folders = {str(parent) for name in self.files for parent in pathlib.PurePath(name).parents}
        self.base_names = {pathlib.PurePath(name).name for name in self.files}
        self.top = {name.split("/")[0] for name in self.files}
        code = [name for name in self.files if re.search(r"\.(h|cc|py|pyi|sh|txt|cmake|mjs|js)$", name)
                and "corpus" not in name]
        self.text = {name: (root / name).read_text(encoding="utf-8", errors="replace") for name in code}
        self.words = set(re.findall(r"[A-Za-z_]\w+", "\n".join(self.text.values())))
        self.suites, self.tests, self.ctests = set(), set(), []
        for name, text in self.text.items():
            if name.startswith("tests/") and name.endswith(".cc"):
                folder = name.split("/")[1]
                for suite, test in TEST_MACRO.findall(text):
                    self.suites.add(suite)
                    self.tests.add(f"{suite}.{test}")
                    self.ctests.append(f"{folder}.{suite}")
            if name.endswith("CMakeLists.txt"):
                for test in re.findall(r"add_test\(\s*NAME\s+([^\s)]+)", text):
                    self.ctests.append(re.sub(r"\$\{\w+\}", "x", test))
        self.options, command = {}, None
        for line in (root / "docs/reference/options.md").read_text(encoding="utf-8").split("\n"):
            heading = re.match(r"## (?:counterpoint )?`?([\w-]+)`?", line)
            if heading:
                command = heading[1]
                self.options[command] = set()
            elif command and line.startswith("|"):
                self.options[command].update(re.findall(r"--[\w-]+", line.split("|")[1]))
        self.all_options = set().union(*self.options.values()) | {"--help", "--version", "--help-all"}

    def has_path(self, path, page):
        if any(c in path for c in "<") or path.split("/")[0] in USER_ROOTS:
            return True
        if path.startswith("counterpoint/"):
            path = path.removeprefix("counterpoint/")
        for start in (self.root, (self.root / page).parent, self.root / "apps/python"):
            candidate = (start / path).resolve()
            if candidate.exists():
                return True
        if "*" in path:
            return any(fnmatch.fnmatch(name, "*" + path) for name in self.files)
        # Written from a folder within the library: `step/overlap_correction.cc`.
        return any(name.endswith("/" + path) for name in self.files) or any(
            folder.endswith("/" + path.rstrip("/")) for folder in self.folders)


def code_of(text):
    return [next(part for part in match if part) for match in CODE.findall(text) if any(match)]


def check_paths(page, text, sources):
    for path in PATH.findall(text):
        first = path.split("/")[0]
        if (first in sources.top or path.startswith("counterpoint/")) and not sources.has_path(path, page):
            yield f"names {path}, which is not there"
    for name in BARE.findall(text):
        if name not in sources.base_names:
            yield f"names {name}, and no file is called so"


def check_options(code, sources):
    for words in COMMAND.findall(code):
        words = words.replace("\\\n", " ").split()
        if not words or not re.fullmatch(r"[a-z][a-z-]+", words[0]):
            continue
        if words[0] not in sources.options:
            yield f"names the subcommand {words[0]}, which is not there"
            continue
        for option in (w.split("=")[0] for w in words[1:] if re.match(r"--[a-z]", w)):
            option = option.strip("`,.;:()'\"")
            if option not in sources.options[words[0]] | {"--help", "--help-all"}:
                yield f"names {words[0]} {option}, which is not there"
    for line in code.split("\n"):
        script = re.search(r"(scripts/[\w.]+\.(?:py|sh))", line)
        for option in re.findall(r"(?<![\w-])(--[a-z][\w-]+)", line):
            if option in sources.all_options | FOREIGN:
                continue
            if script and option in sources.text.get(script[1], ""):
                continue
            if any(option in text for name, text in sources.text.items()
                   if name.startswith(("apps/", "scripts/", "tests/"))):
                continue
            yield f"names the option {option}, which is not there"


def check_tests(code, sources):
    for name in re.findall(r"(?<![\w/.*])([A-Z]\w+\.[A-Z]\w+)(?![\w.])", code):
        if name.split(".")[0] in sources.suites and name not in sources.tests:
            yield f"names the test {name}, which is not there"
    if re.fullmatch(r"[A-Z]\w*[a-z]\w*\.[A-Z]\w*[a-z]\w*", code) and code not in sources.tests:
        yield f"names the test {code}, which is not there"
    for pattern in re.findall(r"ctest[^\n]*?-R '?([^'\s]+)'?", code):
        if not any(re.search(pattern, test) for test in sources.ctests):
            yield f"ctest -R {pattern} finds no test"
    for line in re.findall(r"(?:--gtest_filter=|figures\.py \S+ )'?([^'\s]+)'?", code):
        for pattern in line.replace("-", ":").split(":"):
            if pattern and not any(fnmatch.fnmatch("x/" + t + "/0", p) for t in sources.tests
                                   for p in (pattern, "x/" + pattern, "x/" + pattern + "/0")):
                yield f"the filter {pattern} finds no test"


def check_names(code, sources):
    for option in re.findall(r"-D(COUNTERPOINT_\w+)", code):
        if option not in sources.words:
            yield f"names the CMake option {option}, which is not there"
    for name in re.findall(r"(?<![\w:])((?:\w+::)+\w+)", code):
        missing = [word for word in name.split("::") if word not in sources.words and word not in ("std", "fcl")]
        if missing and not name.startswith(("std::", "fcl::", "Eigen::")):
            yield f"names {name}, and no source has {missing[0]}"


def check_decisions(text):
    for record in re.split(r"^## ", text, flags=re.M)[1:]:
        title = record.split("\n")[0]
        if not re.search(r"^\*20\d\d-\d\d-\d\d[^*]*\*$", record, re.M):
            yield f"decision '{title}' has no date"
        places = [record.find(f"**{part}.**") for part in PARTS]
        if -1 in places or places != sorted(places):
            yield f"decision '{title}' lacks one of {', '.join(PARTS)}, or has them in another order"


def private_words(text):
    return [f"says '{hit}': write {instead}" for word, instead in PRIVATE_WORDS.items()
            for hit in re.findall(rf"\b({word})", text, re.I)]


def check(root):
    sources = Sources(root)
    bad = []
    for page in sorted(name for name in sources.files if name.endswith(".md")):
        if page == "CHANGELOG.md" or page in GENERATED or "corpus" in page:
            continue
        text = (root / page).read_text(encoding="utf-8")
        code = code_of(text)
        found = list(check_paths(page, text, sources))
        for part in code:
            found += [*check_options(part, sources), *check_tests(part, sources), *check_names(part, sources)]
        if page.startswith("docs/decisions/") and not page.endswith("README.md"):
            found += check_decisions(text)
        if page != "docs/explanation/glossary.md":
            found += private_words(re.sub(r"`[^`\n]*`|\]\([^)]*\)", "", text))
        bad += [f"{page}: {line}" for line in dict.fromkeys(found)]
    for name, text in sources.text.items():
        if not name.endswith("check_docs.py"):
            bad += [f"{name}: {line}" for line in dict.fromkeys(private_words(text))]
    return bad, sources


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parents[1]).resolve()
    bad, sources = check(root)
    pages = sum(name.endswith(".md") for name in sources.files)
    print("\n".join(bad) if bad else f"{pages} pages: paths, options, tests and names are there")
    sys.exit(bool(bad))


if __name__ == "__main__":
    main()
