#!/usr/bin/env python3
"""check_links.py [ROOT]: checks that every relative link of every Markdown page leads to a file and every #fragment
to a heading in it, that every docs/... path named in sources exists, and that lines have at most 120 columns outside
tables, fences and images."""

import pathlib
import re
import subprocess
import sys

LINK = re.compile(r"\]\(([^)\s]+)\)")
NAMED = re.compile(r"(?<![\w/.-])(docs/[\w/-]+\.(?:md|svg|png))")
LONGEST = 120
# History, and files written by other programs.
FREE = ("CHANGELOG.md", "docs/reference/python.md", "docs/reference/options.md")


def without_code(text):
    return re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)


def anchors(text):
    """Anchors of the headings of a page, in GitHub's form."""
    found = set()
    for heading in re.findall(r"^#+ (.*)$", without_code(text), flags=re.M):
        word = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower()
        found.add(re.sub(r"[^\w\- ]", "", word).replace(" ", "-"))
    return found


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parents[1]).resolve()
    try:
        listed = subprocess.run(["git", "-C", root, "ls-files", "-co", "--exclude-standard"], capture_output=True,
                                text=True, check=True)
        files = listed.stdout.split("\n")
    except (OSError, subprocess.CalledProcessError):  # no git, or an archive
        files = [str(p.relative_to(root)) for p in root.rglob("*")
                 if not {"build", ".git", "out"} & set(p.relative_to(root).parts)]
    bad, links = [], 0
    for name in sorted(filter(None, files)):
        file = root / name
        if not file.is_file() or "corpus" in file.parts:
            continue
        if name.endswith(".md"):
            text = file.read_text(encoding="utf-8")
            for target in LINK.findall(without_code(text)):
                if re.match(r"[a-z]+:", target):
                    continue
                links += 1
                path, _, fragment = target.partition("#")
                other = (file.parent / path) if path else file
                if not other.exists():
                    bad.append(f"{name}: {target} leads nowhere")
                elif fragment and other.suffix == ".md" and fragment not in anchors(other.read_text(encoding="utf-8")):
                    bad.append(f"{name}: {target}: no such heading")
            if name not in FREE:
                for number, line in enumerate(without_code(text).split("\n"), 1):
                    if len(line) > LONGEST and not line.startswith(("|", "    ", "![", "[")):
                        bad.append(f"{name}: a line of {len(line)} columns: {line[:60]}...")
        elif file.suffix in (".h", ".cc", ".py", ".pyi", ".sh", ".txt", ".cmake", ".js", ".mjs", ".yaml", ".toml"):
            for path in NAMED.findall(file.read_text(encoding="utf-8", errors="replace")):
                if "NAME" not in path and not (root / path).exists() and not (root / path.removesuffix(".svg")).exists():
                    bad.append(f"{name}: names {path}, which is not there")
    print("\n".join(bad) if bad else f"{links} links, all lead somewhere")
    sys.exit(bool(bad))


if __name__ == "__main__":
    main()
