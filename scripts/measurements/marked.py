"""Generated parts of documents, between the marks `<!-- NAME: begin -->` and `<!-- NAME: end -->`."""


def replaced(document, name, text):
    """Returns the document with this text between the marks, and the previous text there."""
    begin, end = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->"
    before, rest = document.split(begin)
    old, after = rest.split(end)
    return before + begin + text + end + after, old


def write(page, name, text):
    """Replaces the text between the marks in the file `page`."""
    page.write_text(replaced(page.read_text(), name, text)[0])
