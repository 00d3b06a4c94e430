#!/usr/bin/env python3
"""Writes docs/reference/python.md from the stubs (signatures) and the docstrings of the Python module.

Usage: PYTHONPATH=build/release/python scripts/python_reference.py [--check]   (--check: compare, write nothing)
"""
import ast
import inspect
import pathlib
import re
import sys
import textwrap

import counterpoint as cp

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs/reference/python.md"
STUBS = pathlib.Path(cp.__file__).parent
MODULES = [("counterpoint", cp, "__init__")] + [
    (f"counterpoint.{name}", getattr(cp, name), name) for name in ("collision", "contact", "optimization", "recordings", "view")]
WIDTH = 116
HEAD = """# Python reference

Written by scripts/python_reference.py from the stubs and docstrings of the module; edit those.
[Python](../guide/python.md) says how to begin.
"""


def wrapped(text, indent):
    """Wraps a signature at WIDTH columns."""
    if len(text) + 4 <= WIDTH:
        return [text]
    head, rest = text.split("(", 1)
    lines, line = [], head + "("
    for part in rest.split(", "):
        if len(line) + len(part) + 6 > WIDTH:
            lines.append(line.rstrip())
            line = " " * indent
        line += part + ", "
    return lines + [line[:-2]]


def signature(node, name):
    arguments = ast.unparse(node.args)
    for own in ("self, ", "self"):
        if arguments.startswith(own):
            arguments = arguments[len(own):]
            break
    arguments = arguments.removeprefix("/, ")
    returns = ast.unparse(node.returns) if node.returns else "None"
    text = f"{name}({arguments})" + ("" if returns == "None" else f" -> {returns}")
    return plain(text)


def plain(text):
    """Removes the underscores of type aliases that only the stubs define."""
    return re.sub(r"\b_([A-Z])", r"\1", text.replace("_Floats", "ndarray").replace("_Path", "path"))


def documentation(thing):
    return inspect.cleandoc(thing.__doc__ or "")


def code(lines):
    return ["```text", *lines, "```", ""]


def sections(text):
    """Converts a docstring in NumPy's style to Markdown."""
    out, lines, i = [], re.sub(r"\n *(?=[^{}]*\})", " ", text).splitlines(), 0
    while i < len(lines):
        if i + 1 < len(lines) and lines[i + 1] and set(lines[i + 1]) == {"-"}:
            out += ["", f"*{lines[i]}*", ""]
            i += 2
            while i < len(lines) and not (i + 1 < len(lines) and lines[i + 1] and set(lines[i + 1]) == {"-"}):
                if lines[i].startswith("    "):
                    out[-1] += (" – " if out[-1].startswith("* ") and " – " not in out[-1] else " ") + lines[i].strip()
                elif lines[i]:
                    out.append("* " + lines[i])
                i += 1
            continue
        out.append(lines[i])
        i += 1
    return "\n".join(out).strip().splitlines()


def members(node, thing):
    out, seen = [], set()
    for item in node.body:
        if isinstance(item, ast.AnnAssign):
            name = item.target.id
            if not hasattr(thing, name):
                continue  # attribute of instances only, described in the docstring of the class
            out.append(f"* `{name}: {ast.unparse(item.annotation)}` – {first(getattr(thing, name, None))}")
        elif isinstance(item, ast.FunctionDef) and item.name not in seen:
            seen.add(item.name)
            if item.name.startswith("__") and item.name != "__init__":
                continue
            decorators = [ast.unparse(d) for d in item.decorator_list]
            if item.name == "__init__":
                continue
            attribute = getattr(thing, item.name)
            if "property" in decorators:
                out.append(f"* `{item.name}: {ast.unparse(item.returns)}` – {first(attribute)}")
            else:
                out.append(f"* `{signature(item, item.name)}` – {first(attribute)}")
                rest = sections(documentation(attribute))[1:]
                out += [("  " + line).rstrip() for line in rest if line]
    return [plain(line) for line in out]


def first(attribute):
    return documentation(attribute).splitlines()[0]


def in_lines(text):
    """Wraps prose and list items at WIDTH columns; leaves code unchanged."""
    out, is_code = [], False
    for line in text.split("\n"):
        is_code ^= line.lstrip().startswith("```")
        if is_code or len(line) <= WIDTH:
            out.append(line)
            continue
        indent = len(line) - len(line.lstrip(" ")) + 2 * line.lstrip(" ").startswith("* ")
        out += textwrap.wrap(line, WIDTH, subsequent_indent=" " * indent, break_long_words=False,
                             break_on_hyphens=False)
    return "\n".join(out)


def page():
    out = [HEAD]
    for title, module, stub in MODULES:
        out += [f"## {title}", ""]
        tree = ast.parse((STUBS / f"{stub}.pyi").read_text())
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                thing = getattr(module, node.name)
                out += [f"### {node.name}", ""]
                for item in node.body:
                    if isinstance(item, ast.FunctionDef) and item.name == "__init__":
                        out += code(wrapped(signature(item, node.name), 4))
                out += sections(documentation(thing)) + [""] + members(node, thing) + [""]
            elif isinstance(node, ast.FunctionDef):
                thing = getattr(module, node.name)
                out += [f"### {node.name}", ""] + code(wrapped(signature(node, node.name), 4))
                out += sections(documentation(thing)) + [""]
    text = in_lines("\n".join(out))
    while "\n\n\n" in text:
        text = text.replace("\n\n\n", "\n\n")
    return text.rstrip() + "\n"


def main():
    text = page()
    if "--check" in sys.argv[1:]:
        if not PAGE.exists() or PAGE.read_text() != text:
            print(f"{PAGE.relative_to(ROOT)} is not what the module says: run scripts/python_reference.py", file=sys.stderr)
            return 1
        return 0
    PAGE.write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
