#!/usr/bin/env python3
"""Sizes of files, folders and functions, tested by `ctest -R house.sizes`.

    scripts/check_sizes.py            prints everything above the limits below; exit status 1 if there is any
    scripts/check_sizes.py --list 20  also prints the 20 longest functions

A function with a reason to be longer states it in the comment above it, in a sentence that starts with "Long:" (a
table, a list of options).
"""
import argparse
import ast
import collections
import pathlib
import re
import sys

sys.dont_write_bytecode = True  # tests run this script in the source tree
from check_docs import listed_files  # noqa: E402

FILE_LINES = 400
FOLDER_FILES = 25
FUNCTION_LINES = 60

ROOT = pathlib.Path(__file__).resolve().parent.parent
CODE = {".cc", ".h", ".py", ".js", ".mjs", ".ts", ".cmake", ".sh", ".css", ".html"}
# Inputs of fuzz targets, pictures, robots and recordings: large numbers of these files are
# acceptable.
DATA_FOLDERS = ("data/", "tests/fuzz/corpus/", "docs/images/")

Function = collections.namedtuple("Function", "file line name lines has_reason")

# Comments, strings and characters in one pass, so that a quote in a comment does not start a
# string.
NOT_CODE = re.compile(
    r'//[^\n]*|/\*.*?\*/|R"(?P<mark>[^(\s]*)\(.*?\)(?P=mark)"|"(?:\\.|[^"\\\n])*"|(?<![0-9a-fA-F])\'(?:\\.|[^\'\\\n])+\'',
    re.S)
DIRECTIVE = re.compile(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", re.M)
NO_FUNCTION = re.compile(r"^(?:if|for|while|switch|catch|else|do|return|try)\b")
TYPE = re.compile(r"^(?:template\s*<.*>\s*)?(?:inline\s+)?(?:namespace|class|struct|union|enum|extern)\b", re.S)


def blank(match):
    """Replaces a match by the same number of lines, and a string by a word."""
    text = match.group(0)
    return ("0" if text[0] in "\"'R" else "") + "\n" * text.count("\n")


def closing(text, start):
    """Index of the bracket that closes the one at `start`."""
    depth = 0
    for i in range(start, len(text)):
        depth += (text[i] in "([{") - (text[i] in ")]}")
        if depth == 0:
            return i
    return len(text)


def function_name(head):
    """Returns the name in the head of a function or declaration; None for anything else."""
    head = re.sub(r"^(?:(?:public|private|protected)\s*:|\s)+", "", head)
    head = re.sub(r"^template\s*<", "<", head)
    if head.startswith("<"):
        depth = 0
        for i, char in enumerate(head):
            depth += (char == "<") - (char == ">")
            if depth == 0:
                return function_name(head[i + 1:])
    found = re.search(r"(operator\s*(?:\(\)|[^\s(]+)|[~\w:]+)\s*\(", head)
    if not found or NO_FUNCTION.match(head) or "=" in head[:found.start()]:
        return None
    return found.group(1)


def comment_before(lines, line):
    """The comment that ends above line number `line` (counted from 1)."""
    first = line - 1
    while first > 0 and re.match(r"\s*(//|///|#)", lines[first - 1]):
        first -= 1
    return "\n".join(lines[first:line])


def has_reason_in(comment):
    return bool(re.search(r"\bLong: \S", comment))


def cpp_functions(file, text):
    """Functions defined or declared in C++ text, in scopes of namespaces and types."""
    lines = text.split("\n")
    code = DIRECTIVE.sub(blank, NOT_CODE.sub(blank, text))
    found = []

    def add(head_start, end, name):
        start = head_start + re.match(r"(?:(?:public|private|protected)\s*:|\s)*", code[head_start:]).end()
        first = code.count("\n", 0, start) + 1
        last = code.count("\n", 0, end) + 1
        head_lines = code[start:head_of(start, end)].count("\n")
        beside = "\n".join(lines[first - 1:first + head_lines])
        found.append(Function(file, first, name, last - first + 1,
                              has_reason_in(comment_before(lines, first) + beside)))

    def head_of(start, end):
        """Index of the end of a function's head: the brace after its parameters."""
        opened = code.find("{", closing(code, code.find("(", start)))
        return end if opened < 0 else min(opened, end)

    i = head = 0
    while i < len(code):
        char = code[i]
        if char == "(":
            i = closing(code, i)
        elif char in ";}":
            declared = char == ";" and function_name(code[head:i].strip())
            if declared:
                add(head, i, declared)
            head = i + 1
        elif char == "{":
            text_before = code[head:i].strip()
            function = None if TYPE.match(text_before) else function_name(text_before)
            if function:
                end = closing(code, i)
                # In `: a{1}, b(2) {` the first brace belongs to the initializer list, not to the
                # body.
                rest = code[end + 1:end + 20].lstrip()
                if re.search(r"\)\s*(?:noexcept\s*)?:[^:]", text_before) and rest[:1] in (",", "{"):
                    i = end + 1
                    continue
                add(head, end, function)
                i = end
                head = i + 1
            elif TYPE.match(text_before):
                head = i + 1
            else:
                i = closing(code, i)  # an initializer
        i += 1
    return found


def python_functions(file, text):
    lines = text.split("\n")
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            has_reason = has_reason_in(comment_before(lines, node.lineno) + (ast.get_docstring(node) or ""))
            yield Function(file, node.lineno, node.name, node.end_lineno - node.lineno + 1, has_reason)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", type=int, default=0, metavar="N", help="the N longest functions as well")
    options = parser.parse_args()
    files = [ROOT / name for name in listed_files(ROOT)]
    complaints, functions = [], []
    folders = collections.Counter(file.parent for file in files)
    for folder, number in sorted(folders.items()):
        if number > FOLDER_FILES and not f"{folder.relative_to(ROOT)}/".startswith(DATA_FOLDERS):
            complaints.append(f"{folder.relative_to(ROOT)}/: {number} files, {FOLDER_FILES} at most: put what belongs "
                              "together into a folder")
    for file in files:
        if file.suffix not in CODE or f"{file.relative_to(ROOT)}".startswith(DATA_FOLDERS):
            continue
        text = file.read_text()
        length = text.count("\n")
        if length > FILE_LINES:
            complaints.append(f"{file.relative_to(ROOT)}: {length} lines, {FILE_LINES} at most: split it by role")
        if file.suffix in (".cc", ".h"):
            functions += cpp_functions(file.relative_to(ROOT), text)
        elif file.suffix == ".py":
            functions += python_functions(file.relative_to(ROOT), text)
    # The reason given at a declaration also holds for its definition.
    with_reason = {(f.file.parent, f.name.split("::")[-1]) for f in functions if f.has_reason}
    for f in functions:
        given = (f.file.parent, f.name.split("::")[-1]) in with_reason
        where = f"{f.file}:{f.line}: {f.name}"
        if f.lines > FUNCTION_LINES and not given:
            complaints.append(f'{where}: {f.lines} lines, {FUNCTION_LINES} at most, or a comment "Long: reason" above')
    for complaint in complaints:
        print(complaint)
    for f in sorted(functions, key=lambda f: -f.lines)[:options.list]:
        print(f"{f.lines:4} lines  {f.file}:{f.line}  {f.name}")
    print(f"{len(files)} files, {len(functions)} functions and declarations: {len(complaints)} too large")
    if len(functions) < 1000:
        print("that is fewer functions than this project has: the scanner has gone blind")
        return 1
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
