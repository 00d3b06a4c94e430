#!/bin/sh
# Builds the documents as a site in build/site (mkdocs) and the C++ interface from the public headers
# (cmake/public_headers.txt) in build/site/cpp (Doxygen). Debian: mkdocs doxygen.
set -eu
cd "$(dirname "$0")/.."
for program in mkdocs doxygen python3; do
  command -v $program >/dev/null || { echo "error: $program is missing (Debian: mkdocs doxygen)" >&2; exit 2; }
done
python3 scripts/check_links.py
rm -rf build/site build/site-source
mkdir -p build/site-source
cp -r docs/. build/site-source/
cp docs/README.md build/site-source/index.md
rm build/site-source/README.md
# Adds pages that are stored beside the sources; links out of docs/ to other sources become text.
mkdir -p build/site-source/sources
python3 scripts/site_pages.py build/site-source
cat > build/mkdocs.yml <<END
site_name: Counterpoint
docs_dir: site-source
site_dir: site
use_directory_urls: false
theme: {name: mkdocs, highlightjs: false}
plugins: []
markdown_extensions: [tables, fenced_code, toc]
END
mkdocs build --quiet --strict --config-file build/mkdocs.yml
# Warnings are errors, so that each @param and reference in the public headers names something that exists. A comment
# may describe some of the parameters only.
doxygen - <<END || { cat build/doxygen.log >&2; exit 1; }
PROJECT_NAME = Counterpoint
OUTPUT_DIRECTORY = build/site
HTML_OUTPUT = cpp
INPUT = $(grep "\.h$" cmake/public_headers.txt | tr "\n" " ")
GENERATE_LATEX = NO
QUIET = YES
WARNINGS = YES
WARN_IF_UNDOCUMENTED = NO
WARN_IF_INCOMPLETE_DOC = NO
WARN_AS_ERROR = FAIL_ON_WARNINGS
WARN_LOGFILE = build/doxygen.log
EXTRACT_ALL = YES
SOURCE_BROWSER = NO
HAVE_DOT = NO
FULL_PATH_NAMES = YES
STRIP_FROM_PATH = .
END
echo "Written: build/site/index.html, build/site/cpp/index.html"
