"""The words of Felt as functions of Python, and scripts."""

import inspect
import types

from . import _nephele

# What Python has itself, and what only a script needs.
_LEFT_OUT = {
    "cacheread", "cachewrite", "error", "eval", "float", "int", "matrix", "matrixcache", "print", "read",
    "readfield", "readvectorfield", "scalarcache", "size", "string", "vector", "vectorcache", "write",
}


def overloads():
    """The words that Python has, by name: a list of what each of the functions of that name is."""
    found = {}
    for word in _nephele._words():
        name = word["name"]
        # Verbs that have the name of a word take its place; advect is both.
        if name not in _LEFT_OUT and (name == "advect" or name not in _nephele._verbs()):
            found.setdefault(word["name"], []).append(word)
    return found


def _documentation(name, functions):
    lines = []
    for function in functions:
        if function["text"] not in lines:
            lines.append(function["text"])
    signatures = "\n".join("    " + function["signature"] for function in functions)
    return "\n".join(lines) + "\n\n" + signatures


def _function(name, functions):
    def word(*arguments, **named):
        return _nephele._call(name, arguments, named)

    word.__name__ = word.__qualname__ = name
    word.__module__ = "nephele"
    word.__doc__ = _documentation(name, functions)
    if len(functions) == 1:
        kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
        word.__signature__ = inspect.Signature(
            [inspect.Parameter(p, kind, default=... if has_default else inspect.Parameter.empty)
             for p, _, has_default in functions[0]["parameters"]])
    return word


def define(module):
    """Adds all words to the names of a module, but those that it has."""
    for name, functions in overloads().items():
        if name not in module:
            module[name] = _function(name, functions)


def words():
    """The names of all words: nephele.sphere and the others. help(nephele.sphere) says what one does."""
    return sorted(overloads())


def _literal(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        if len(value) == 3 and not isinstance(value[0], str):
            return "(" + ", ".join(_literal(item) for item in value) + ")"
        return "[" + ", ".join(_literal(item) for item in value) + "]"
    if isinstance(value, (int, float)):
        return repr(value)
    raise TypeError(f"a parameter of a script is a number, a text or a vector, not a {type(value).__name__}")


def felt(text, *, name="felt", progress=None, **params):
    """Runs a script of Felt and returns its variables: felt("scalarfield s = sphere((0,0,0), 1);").s

    `params` sets what the script declares with `param`. `name` stands in messages; files that the script imports
    are sought beside it. What it prints goes to sys.stdout. Raises Error with all faults of the script.
    """
    from ._verbs import _callback

    if not isinstance(text, str):
        raise TypeError(f"felt: a script is text, not a {type(text).__name__}")
    settings = {key: _literal(value) for key, value in params.items()}
    with _callback(progress) as callback:
        return types.SimpleNamespace(**_nephele._run_script(text, settings, name, callback))
