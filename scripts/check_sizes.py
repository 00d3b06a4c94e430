#!/usr/bin/env python3
"""Sizes of files, folders, functions and parameter lists, tested by `ctest -R house.sizes`.

    scripts/check_sizes.py            prints everything above the limits below; exit status 1 if there is any
    scripts/check_sizes.py --list 20  also prints the 20 longest functions

A function with a reason to be larger states it in the comment above it, in a sentence that starts with "Long:" (a
table, a list of options) or "Parameters:" (for example a signature that another library prescribes).
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
PARAMETERS = 6

ROOT = pathlib.Path(__file__).resolve().parent.parent
CODE = {".cc", ".h", ".py", ".js", ".mjs", ".ts", ".cmake", ".sh", ".css", ".html"}
# Inputs of fuzz targets, pictures, robots and recordings: large numbers of these files are
# acceptable.
DATA_FOLDERS = ("data/", "tests/fuzz/corpus/", "docs/images/")

Function = collections.namedtuple("Function", "file line name lines parameters reasons")

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


def parts_of(text):
    """Number of parameters in a list, counted by top-level commas."""
    text = text.strip()
    if text in ("", "void"):
        return 0
    depth, commas = 0, 0
    for char in text.replace("->", "  "):
        depth += (char in "(<[{") - (char in ")>]}")
        commas += char == "," and depth == 0
    return commas + 1


def closing(text, start):
    """Index of the bracket that closes the one at `start`."""
    depth = 0
    for i in range(start, len(text)):
        depth += (text[i] in "([{") - (text[i] in ")]}")
        if depth == 0:
            return i
    return len(text)


def name_and_parameters(head):
    """Returns (name, number of parameters) of the head of a function or declaration; None for anything else."""
    head = re.sub(r"^(?:(?:public|private|protected)\s*:|\s)+", "", head)
    head = re.sub(r"^template\s*<", "<", head)
    if head.startswith("<"):
        depth = 0
        for i, char in enumerate(head):
            depth += (char == "<") - (char == ">")
            if depth == 0:
                return name_and_parameters(head[i + 1:])
    found = re.search(r"(operator\s*(?:\(\)|[^\s(]+)|[~\w:]+)\s*\(", head)
    if not found or NO_FUNCTION.match(head) or "=" in head[:found.start()]:
        return None
    end = closing(head, found.end() - 1)
    return found.group(1), parts_of(head[found.end():end])


def comment_before(lines, line):
    """The comment that ends above line number `line` (counted from 1)."""
    first = line - 1
    while first > 0 and re.match(r"\s*(//|///|#)", lines[first - 1]):
        first -= 1
    return "\n".join(lines[first:line])


def reasons_in(comment):
    return {word for word in ("Long", "Parameters") if re.search(rf"\b{word}: \S", comment)}


def cpp_functions(file, text):
    """Functions defined or declared in C++ text. Searches scopes of namespaces and types; in bodies of functions only
    lambdas, whose lines belong to the enclosing function."""
    lines = text.split("\n")
    code = DIRECTIVE.sub(blank, NOT_CODE.sub(blank, text))
    found = []

    def add(head_start, end, name, parameters):
        start = head_start + re.match(r"(?:(?:public|private|protected)\s*:|\s)*", code[head_start:]).end()
        first = code.count("\n", 0, start) + 1
        last = code.count("\n", 0, end) + 1
        head_lines = code[start:head_of(start, end)].count("\n")
        beside = "\n".join(lines[first - 1:first + head_lines])
        found.append(Function(file, first, name, last - first + 1, parameters,
                              reasons_in(comment_before(lines, first) + beside)))

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
            declared = char == ";" and name_and_parameters(code[head:i].strip())
            if declared:
                add(head, i, *declared)
            head = i + 1
        elif char == "{":
            text_before = code[head:i].strip()
            function = None if TYPE.match(text_before) else name_and_parameters(text_before)
            if function:
                end = closing(code, i)
                # In `: a{1}, b(2) {` the first brace belongs to the initializer list, not to the
                # body.
                rest = code[end + 1:end + 20].lstrip()
                if re.search(r"\)\s*(?:noexcept\s*)?:[^:]", text_before) and rest[:1] in (",", "{"):
                    i = end + 1
                    continue
                add(head, end, *function)
                for bracket in re.finditer(r"\]\s*\(", code[i:end]):
                    start = i + bracket.end() - 1
                    stop = closing(code, start)
                    add(start, code.find("{", stop), "lambda", parts_of(code[start + 1:stop]))
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
            arguments = node.args
            # Parameters with a default are passed by keyword, so they do not count; neither does
            # `self`.
            number = (len(arguments.posonlyargs + arguments.args) - len(arguments.defaults)
                      + sum(default is None for default in arguments.kw_defaults))
            number -= bool(arguments.args) and arguments.args[0].arg in ("self", "cls")
            reasons = reasons_in(comment_before(lines, node.lineno) + (ast.get_docstring(node) or ""))
            yield Function(file, node.lineno, node.name, node.end_lineno - node.lineno + 1, number, reasons)


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
    reasons = collections.defaultdict(set)
    for f in functions:
        reasons[f.file.parent, f.name.split("::")[-1]] |= f.reasons
    for f in functions:
        given = f.reasons | reasons[f.file.parent, f.name.split("::")[-1]]
        where = f"{f.file}:{f.line}: {f.name}"
        if f.lines > FUNCTION_LINES and "Long" not in given:
            complaints.append(f'{where}: {f.lines} lines, {FUNCTION_LINES} at most, or a comment "Long: reason" above')
        if f.parameters > PARAMETERS and "Parameters" not in given:
            complaints.append(f'{where}: {f.parameters} parameters, {PARAMETERS} at most, or a comment "Parameters: '
                              'reason" above')
    for complaint in complaints:
        print(complaint)
    for f in sorted(functions, key=lambda f: -f.lines)[:options.list]:
        print(f"{f.lines:4} lines {f.parameters:2} parameters  {f.file}:{f.line}  {f.name}")
    print(f"{len(files)} files, {len(functions)} functions and declarations: {len(complaints)} too large")
    if len(functions) < 1000:
        print("that is fewer functions than this project has: the scanner has gone blind")
        return 1
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
