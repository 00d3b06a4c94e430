#!/usr/bin/env python3
"""make_stubs.py FOLDER TYPES: writes the type stubs FOLDER/*.pyi of the package FOLDER, whose module is built.

A type comes from pybind11's signature, which the module keeps in its docstrings if COUNTERPOINT_SIGNATURES is set.
Where that says no more than `object`, `str`, `list` ..., the docstring does: `name : array_like, shape (3,), optional`
under Parameters, the section Returns, and of a property "List of Joint.", "convex, lagged or coulomb.", "Scene, or
None.". A type that neither gives is an error, and so is a name that no stub defines. TYPES/NAME.pyi holds the types of
module NAME that exist in stubs only.
"""
import ast
import builtins
import inspect
import os
import pathlib
import re
import sys
import textwrap

MODULES = ("collision", "contact", "optimization", "recordings", "view")
IMPORTS = (("collections.abc", ("Callable", "Iterable", "Mapping", "Sequence")), ("os", ("PathLike",)),
           ("typing", ("Any", "Literal", "TypeAlias", "TypedDict", "final", "overload")),
           ("numpy.typing", ("ArrayLike", "NDArray")))
ALIASES = {"_Path": "str | PathLike[str]", "_Floats": "NDArray[np.float64]"}
# Members with underscores that users call, if only through an operator.
SPECIAL = {"__init__", "__len__", "__getitem__", "__setitem__", "__matmul__", "__bool__", "__copy__", "__deepcopy__"}
# Types of signatures that say too little.
VAGUE = re.compile(r"\b(object|tuple|list|dict|frozenset|Iterable)\b(?!\[)")
WORDS = {"array_like": "ArrayLike", "ndarray": "_Floats", "path": "_Path", "sequence": "Sequence",
         "iterable": "Iterable"}
NUMPY = {"float": "np.float64", "int": "np.int64", "bool": "np.bool_"}
HEAD = "".join(f"from . import {name} as {name}\n" for name in MODULES) + "\n__version__: str\n__all__: list[str]\n"


def optional(text):
    return text if re.search(r"\bNone\b", text) else f"{text} | None"


def array(kind):
    kind = NUMPY.get(kind, "np." + kind.replace("numpy.", ""))
    return "_Floats" if kind == "np.float64" else f"NDArray[{kind}]"


def type_of_signature(node, argument):
    """A type of a signature as stubs spell it: of an argument, or of a result."""
    text = ast.unparse(node)
    if text.startswith("numpy.ndarray"):  # without a type: a view or copy of doubles (objects/arrays.h)
        return "ArrayLike" if argument else array(text[len("numpy.ndarray["):-1] or "float")
    if not isinstance(node, ast.Subscript):
        return {"os.PathLike": "_Path"}.get(text, text)
    inner = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
    parts = [type_of_signature(part, argument) for part in inner]
    name = ast.unparse(node.value)
    if name in ("Optional", "Union"):
        return " | ".join(parts + ["None"] * (name == "Optional"))
    name = name if name == "Iterable" else name.lower()
    name = {"list": "Sequence", "dict": "Mapping"}.get(name, name) if argument else name
    return f"{name}[{', '.join(parts)}]"


def type_of_words(text, argument):
    """A type from a line `name : text` of a docstring."""
    if text.endswith(", optional"):
        return optional(type_of_words(text[:-len(", optional")], argument))
    many = re.fullmatch(r"(?:(.+?),? or )?(?:(sequence|list|iterable) of|dict of (\w+) to) (.+)", text)
    if many:
        first = f"{type_of_words(many[1], argument)} | " if many[1] else ""
        of = type_of_words(many[4], argument)
        if many[3]:
            return f"{first}{'Mapping' if argument else 'dict'}[{many[3]}, {of}]"
        return f"{first}{WORDS.get(many[2], many[2])}[{of}]"
    text = re.sub(r",? shape .*", "", text)
    if text.startswith("{"):
        return f"Literal[{text[1:-1]}]"
    if text.startswith("ndarray of "):
        return array(text.split()[-1])
    if "[" not in text and re.search(", | or ", text):
        return " | ".join(type_of_words(part, argument) for part in re.split(", | or ", text))
    return WORDS.get(text, text)


def section(doc, title):
    """The lines `name : type` of a section of a docstring, and those without a name, which get ''."""
    found = re.search(rf"^{title}\n-+\n(.*?)(?=\n\n|\Z)", doc, re.M | re.S)
    # Words in braces may fill several lines.
    text = re.sub(r"\n *(?=[^{}]*\})", " ", found[1]) if found else ""
    lines = {}
    for line in re.findall(r"^\S.*", text, re.M):
        names, kind = line.split(" : ") if " : " in line else ("", line)
        lines.update((name, kind) for name in names.split(", "))
    return lines


def parsed(signature):
    """A signature as a node. A default that is an object becomes `...`, since its repr need not be Python."""
    text = re.sub(r"= (<[^<>]*>|[A-Z]\w*\(([^()]|\([^()]*\))*\))", "= ...", signature)
    return ast.parse(f"def {text}: ...").body[0]


def type_of_argument(node, default, words):
    """The type of an argument of a signature; `words` are those of the docstring."""
    text = type_of_signature(node.annotation, True)
    if words and (VAGUE.search(text) or (text.startswith("str") and words.startswith("{"))):
        text = type_of_words(words, True)
    return optional(text) if default is not None and ast.unparse(default) == "None" else text


def default_of(node):
    """The default, a node or its text, as stubs write it: `...` where it is no literal."""
    try:
        value = ast.literal_eval(node)
    except (SyntaxError, ValueError):
        return "..."
    return {"[]": "()", "{}": "...", "Ellipsis": "..."}.get(repr(value), repr(value))


def attributes(thing, required, taken):
    """The attributes of a class as keywords of its constructor, with their values in an object made of words."""
    sample = thing(*(ast.literal_eval(f"[{words[1:-1]}]")[0] if words.startswith("{") else "" for words in required))
    for key, member in vars(thing).items():
        if getattr(member, "fset", None) and key not in taken:
            yield f"{key}: {written(member)} = {default_of(repr(getattr(sample, key)))}"


def declared(signature, doc, thing):
    """The stub of one signature of a function, or of a method of the class `thing`."""
    node = parsed(signature)
    words, arguments = section(doc, "Parameters"), node.args.args + node.args.kwonlyargs
    defaults = [None] * (len(node.args.args) - len(node.args.defaults)) + node.args.defaults + node.args.kw_defaults
    parts = []
    for argument, default in zip(arguments, defaults):
        text = type_of_argument(argument, default, words.get(argument.arg))
        name = argument.arg if argument.arg == "self" else f"{argument.arg}: {text}"
        parts.append(name + (f" = {default_of(default)}" if default else ""))
    if node.args.kwonlyargs:
        parts.insert(len(node.args.args), "*")
    if node.args.kwarg:
        required = [words.get(x.arg, "") for x, default in zip(arguments[1:], defaults[1:]) if default is None]
        parts += ["*", *attributes(thing, required, words)]
    result = type_of_signature(node.returns, False)
    if VAGUE.search(result):
        lines = [type_of_words(text, False) for text in section(doc, "Returns").values()] or [result]
        result = lines[0] if len(lines) == 1 else f"tuple[{', '.join(lines)}]"
    return f"def {node.name}({', '.join(parts)}) -> {result}: ..."


def function(name, thing, owner=None):
    """The stub of a function, or of a method of the class `owner`."""
    doc = inspect.cleandoc(thing.__doc__)
    signatures = re.findall(rf"^(?:\d+\. )?({name}\((?!\*args).*?\) -> [^\n]*)$", doc, re.M | re.S)
    if not signatures:
        raise ValueError(f"{name} has no signature in its docstring")
    if name == "__init__":  # the docstring of a class has the parameters of its constructor
        doc = inspect.cleandoc(owner.__doc__)
    lines = [declared(text, doc, owner) for text in signatures]
    if owner and not any("(self" in line for line in lines):
        lines = ["@staticmethod\n" + line for line in lines]
    return "\n".join(["@overload\n" + line for line in lines] if len(lines) > 1 else lines)


def read(member, words=None):
    """The type of a property; `words` are those of the constructor's parameter of this name."""
    doc = inspect.cleandoc(member.__doc__)
    text = type_of_signature(parsed("f" + member.fget.__doc__.strip()).returns, False)
    many = re.match(r"List of ([\w.]+)", doc)
    one_of = re.search(r"(?:^|: )((?:[\w-]+, )+[\w-]+ or [\w-]+)\.(?:\n|\Z)", doc)
    if many and VAGUE.search(text):
        text = f"list[{many[1]}]"
    elif text == "str" and one_of:
        text = f"Literal[{', '.join(map(repr, re.split(', | or ', one_of[1])))}]"
    elif text == "str" and (words or "").startswith("{"):
        text = type_of_words(words, False)
    return optional(text) if re.search(r"\bNone\b", doc) else text


def written(member):
    """The type that may be assigned to a property."""
    text = type_of_signature(parsed("f" + member.fset.__doc__.strip()).args.args[1].annotation, True)
    same = read(member)
    return same if text == "str" else type_of_words(same, True) if text == "object" else text


def property_(key, member, words):
    """The stub of a property: an attribute if it may be assigned the type that it has."""
    type_read, type_written = read(member, words), written(member) if member.fset else None
    if type_read == type_written:
        return f"{key}: {type_read}"
    text = f"@property\ndef {key}(self) -> {type_read}: ..."
    return text + (f"\n@{key}.setter\ndef {key}(self, value: {type_written}) -> None: ..." if type_written else "")


def class_(name, thing):
    """The stub of a class: its head and its members."""
    if issubclass(thing, BaseException):
        lines = section(inspect.cleandoc(thing.__doc__), "Attributes").items()
        members = [f"{key}: {type_of_words(text, False)}" for key, text in lines]
        return f"class {name}({thing.__base__.__name__}):", members or ["..."]
    members, words = [], section(inspect.cleandoc(thing.__doc__), "Parameters")
    for key, member in vars(thing).items():
        if isinstance(member, property):
            members.append(property_(key, member, words.get(key)))
        elif not key.startswith("_") or (key in SPECIAL and "->" in (member.__doc__ or "")):
            members.append(function(key, getattr(thing, key), thing))
    return f"@final\nclass {name}:", members or ["..."]


def declarations(module):
    for name, thing in vars(module).items():
        if name.startswith("_") or inspect.ismodule(thing):
            continue
        try:
            if inspect.isclass(thing):
                head, members = class_(name, thing)
                yield head + "\n" + textwrap.indent("\n".join(members), "    ") + "\n"
            else:
                yield function(name, thing)
        except SyntaxError as error:
            sys.exit(f"make_stubs.py: {name}: {error.text.strip()}: is a class bound after its use?")


def stub(module, name, prelude, shared):
    """The text of a stub. `shared`: classes of the package, which the stubs of other modules import."""
    package = "counterpoint._core."
    text = "\n".join(declarations(module)).replace(f"{package}{name}." if name else package, "").replace(package, "")
    text = prelude + text if name else HEAD + text
    aliases = "".join(f"{key}: TypeAlias = {value}\n" for key, value in ALIASES.items() if key in text)
    used = set(re.findall(r"[A-Za-z_]\w*", aliases + text))
    own = set(re.findall(r"^class (\w+)", text, re.M))
    imports = [(source, sorted(used & set(names))) for source, names in IMPORTS + ((".", shared - own),)]
    lines = [f"from {source} import {', '.join(names)}\n" for source, names in imports if names]
    lines += ["import numpy as np\n"] * ("np" in used)
    return "".join(lines) + "\n" + aliases + text


def unresolved(text, submodules):
    """Errors of a stub: names that it neither defines nor imports, and vague types but of callables' results."""
    tree = ast.parse(text)
    known = {"np", "property", *vars(builtins), *submodules}
    for node in tree.body:
        known |= {alias.asname or alias.name for alias in getattr(node, "names", ())}
        known |= {getattr(node, "name", ""), getattr(getattr(node, "target", None), "id", "")}
    for node in ast.walk(tree):
        for part in (getattr(node, "annotation", None), getattr(node, "returns", None)):
            names = {x.id for x in ast.walk(part) if isinstance(x, ast.Name)} if part else set()
            if names - known or (part and VAGUE.search(ast.unparse(part).replace("], object]", "]]"))):
                yield f"line {node.lineno}: {text.splitlines()[node.lineno - 1].strip()}: {ast.unparse(part)}"


def main():
    folder, types = map(pathlib.Path, sys.argv[1:])
    os.environ["COUNTERPOINT_SIGNATURES"] = "1"
    sys.path.insert(0, str(folder.parent))
    sys.dont_write_bytecode = True
    import counterpoint._core as core

    shared = {name for name, thing in vars(core).items() if inspect.isclass(thing)}
    bad = []
    for name in ("", *MODULES):
        prelude = "".join(path.read_text() for path in types.glob(f"{name}.pyi"))
        text = stub(getattr(core, name) if name else core, name, prelude, shared)
        bad += [f"{name or 'counterpoint'}, {line}" for line in unresolved(text, () if name else MODULES)]
        path = folder / f"{name or '__init__'}.pyi"
        path.unlink(missing_ok=True)  # it may be a link
        path.write_text(text)
    print("\n".join(f"make_stubs.py: no exact type: {line}" for line in bad), end="\n" if bad else "")
    return bool(bad)


if __name__ == "__main__":
    sys.exit(main())
