#!/usr/bin/env python3
"""check_comments.py [PATH...]: comments of the code are sentences with a subject, or noun phrases.

Looks at every comment of C++, Python, JavaScript, CMake and shell files, and at docstrings:
* a comment or sentence does not open with a word that takes the subject away (OPENINGS);
* a comment has none of the constructions that hide which thing is meant (CONSTRUCTIONS).

PATH: files or folders, default all. Exit code 1 and a line for each finding; --count prints one line per folder instead.
"""
import argparse
import collections
import pathlib
import re
import sys

sys.dont_write_bytecode = True  # tests run this script in the source tree
from check_docs import listed_files  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parent.parent
# A comment must not open with these; a later sentence of it must not open with the capitalized ones of SENTENCES.
OPENINGS = re.compile(r"(?:of|what|by|as|those|so|whose|whom|but|nor)\b(?!-)", re.I)
SENTENCES = re.compile(r"(?<=[.;:] )(?:Of|What|Those|Whose)\b[^?]*?(?:[.;:]|$)")
CONSTRUCTIONS = {
    r"that which|those which": "name the thing",
    r"of what\b": "name the thing",
    r"what (?:is|are|was|it|they|comes?)\b": "name the thing",
    r"(?<!not )so many\b": "the number, or 'n' with its meaning",
    r"of no matter": "unused, irrelevant or undefined",
    r"(?:is|are) called so\b": "has this name",
    r"of (?:it|them) that\b": "name the thing",
}
CONSTRUCTION = {re.compile(rf"\b(?:{words})", re.I): instead for words, instead in CONSTRUCTIONS.items()}
SLASHES, HASH = re.compile(r"(?://[/!]?<?)\s?"), re.compile(r"#\s?")
MARKERS = {".h": SLASHES, ".cc": SLASHES, ".js": SLASHES, ".mjs": SLASHES,
           ".py": HASH, ".sh": HASH, ".cmake": HASH}
# Strings hide comment markers within them.
STRING = re.compile(r'R"(?P<mark>[^(\s]*)\(.*?\)(?P=mark)"|"(?:\\.|[^"\\\n])*"|(?<!\w)\'(?:\\.|[^\'\\\n])*\'|'
                    r"(?P<comment>(?://|#)[^\n]*)", re.S)
DOCSTRING = re.compile(r'^\s*(?:def [^\n]*:|class [^\n]*:|)\n?\s*"""(.*?)"""', re.M | re.S)


def marker_of(path):
    """The comment marker of a file; None for files without code."""
    return HASH if path.name == "CMakeLists.txt" else MARKERS.get(path.suffix)


def without_strings(text, hashes):
    """The text with strings blanked, comments kept."""
    def blank(match):
        found = match.group(0)
        if match.group("comment") and found.startswith("#") == hashes:
            return found
        return re.sub(r"[^\n]", "_", found) if not match.group("comment") else found
    return STRING.sub(blank, text)


def comments(path, text):
    """(line, text) of each block of comment lines, of each trailing comment, and of each docstring."""
    marker = marker_of(path)
    hashes = marker is HASH
    if path.suffix == ".py":
        for found in DOCSTRING.finditer(text):
            yield text.count("\n", 0, found.start(1)) + 1, found.group(1)
        text = re.sub(r'"""(.*?)"""', lambda m: re.sub(r"[^\n]", "_", m.group(0)), text, flags=re.S)
    start, block = 0, []
    lines = without_strings(text, hashes).split("\n")
    for number, line in enumerate([*lines, ""], 1):
        found = re.search(r"(?<!:)//.*" if not hashes else r"(?:^|(?<=\s))#(?!!).*", line)
        alone = found and not line[:found.start()].strip()
        content = marker.sub("", found.group(0), count=1).strip() if found else ""
        if block and (not alone or not content):
            yield start, " ".join(block)
            block = []
        if found and not alone:
            yield number, content
        elif alone and content:
            if not block:
                start = number
            block.append(content)


def findings(path, text):
    for line, comment in comments(path, text):
        if re.match(r"(?:NOLINT|cppcheck|clang-format|eslint|shellcheck)", comment):
            continue
        if opening := OPENINGS.match(comment):
            yield line, f"opens with '{opening.group(0)}': give it a subject"
        for sentence in SENTENCES.findall(comment):
            yield line, f"a sentence opens with '{sentence.split()[0]}': give it a subject"
        plain = re.sub(r"`[^`]*`|'[^']*'", "", comment)
        for words, instead in CONSTRUCTION.items():
            for hit in words.findall(plain):
                yield line, f"says '{hit}': {instead}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="*", help="files or folders, default all")
    parser.add_argument("--count", action="store_true", help="the number of findings in each folder")
    options = parser.parse_args()
    wanted = [pathlib.Path(path).resolve() for path in options.paths] or [ROOT]
    folders = collections.Counter()
    read = 0
    for name in listed_files(ROOT):
        path = ROOT / name
        if "corpus" in name or not any(path == w or w in path.parents for w in wanted):
            continue
        if marker_of(path) is None:
            continue
        read += 1
        for line, complaint in findings(path, path.read_text(encoding="utf-8", errors="replace")):
            folders["/".join(name.split("/")[:2])] += 1
            if not options.count:
                print(f"{name}:{line}: {complaint}")
    for folder, number in sorted(folders.items()) if options.count else ():
        print(f"{number:5} {folder}")
    print(f"{read} files: {sum(folders.values())} comments without a subject")
    return 1 if folders or not read else 0


if __name__ == "__main__":
    sys.exit(main())
