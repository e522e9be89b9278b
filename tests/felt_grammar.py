#!/usr/bin/env python3
"""Colours scripts by the rules of a TextMate grammar, as editors do, and fails where that is not what the lexer of Felt says.

Usage: felt_grammar.py TOKENS GRAMMAR FILE...

TOKENS is the program that prints what the lexer finds. Files are scripts, or pages whose ```felt samples are. Every token must be
one match of the grammar, in a scope of its class; what is no token must have no scope; and every rule must have been used.
"""
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

SCOPES = {
    "number": ["constant.numeric"],
    "string": ["string.quoted.double"],
    "comment": ["comment.line", "comment.block"],
    "keyword": ["keyword.control", "storage.modifier", "constant.language"],
    "type": ["storage.type"],
    "identifier": ["entity.name.function", "variable.other"],
    "operator": ["keyword.operator"],
    "punctuation": ["punctuation"],
}


class Grammar:
    """Regular expressions see one line at a time, as those of editors do."""

    def __init__(self, path):
        self.rules = [self.compiled(rule) for rule in json.load(open(path))["patterns"]]
        self.used = set()

    def compiled(self, rule):
        inner = [self.compiled(one) for one in rule.get("patterns", [])]
        return rule["name"], re.compile(rule.get("match") or rule["begin"]), re.compile(rule["end"]) if "end" in rule else None, inner

    def matches(self, text):
        """(begin, end, scope) of all that has one."""
        found, open_rule, start, line_start = [], None, 0, 0
        for line in text.splitlines(keepends=True):
            bare, at = line.rstrip("\r\n"), 0
            while at < len(bare):
                if open_rule:
                    name, _, end, inner = open_rule
                    nested = next(((rule[0], match) for rule in inner if (match := rule[1].match(bare, at))), None)
                    match = None if nested else end.match(bare, at)
                    if nested:
                        self.used.add(nested[0])
                        at = nested[1].end()
                    elif match:
                        at = match.end()
                        found.append((start, line_start + at, name))
                        open_rule = None
                    else:
                        at += 1
                    continue
                for rule in self.rules:
                    match = rule[1].match(bare, at)
                    if match and match.end() > at:
                        self.used.add(rule[0])
                        if rule[2]:
                            open_rule, start = rule, line_start + at
                        else:
                            found.append((line_start + at, line_start + match.end(), rule[0]))
                        at = match.end()
                        break
                else:
                    at += 1
            line_start += len(line)
        return found


def scripts_of(path, folder):
    if not path.endswith(".md"):
        return [(path, path)]
    samples = re.findall(r"^```felt\n(.*?)^```$", Path(path).read_text(encoding="utf-8"), re.S | re.M)
    files = []
    for number, sample in enumerate(samples, 1):
        file = Path(folder) / f"{Path(path).stem}_{number}.felt"
        file.write_text(sample, encoding="utf-8")
        files.append((f"{path}, sample {number}", str(file)))
    return files


def faults_of(name, path, tokens_program, grammar):
    # One character for every byte, as the lexer counts.
    text = Path(path).read_bytes().decode("latin-1")
    printed = subprocess.run([tokens_program, path], capture_output=True, text=True, check=True).stdout
    tokens = {(int(begin), int(end)): kind for begin, end, kind in map(str.split, printed.splitlines())}
    # The lexer leaves out blanks at the end of a comment.
    matches = {(begin, begin + len(text[begin:end].rstrip())): scope for begin, end, scope in grammar.matches(text)}
    faults = []
    for span in sorted(tokens.keys() | matches.keys()):
        kind, scope = tokens.get(span), matches.get(span)
        if kind and scope and any(scope.startswith(wanted + ".") for wanted in SCOPES[kind]):
            continue
        line = text.count("\n", 0, span[0]) + 1
        column = span[0] - text.rfind("\n", 0, span[0])
        said = f"is {kind or 'no token'} and coloured as {scope or 'nothing'}"
        faults.append(f"{name}:{line}:{column}: {text[slice(*span)]!r} {said}")
    for span, scope in matches.items():
        if scope.startswith("entity.name.function.") != (tokens.get(span) == "identifier" and re.match(r"[ \t]*\(", text[span[1]:]) is not None):
            faults.append(f"{name}: {text[slice(*span)]!r} is coloured as {scope}, by what is behind it")
    return faults


def main(tokens_program, grammar_path, *paths):
    grammar = Grammar(grammar_path)
    faults = []
    with tempfile.TemporaryDirectory(prefix="nephele_felt_") as folder:
        for path in paths:
            for name, script in scripts_of(path, folder):
                faults += faults_of(name, script, tokens_program, grammar)
    names = [rule["name"] for top in json.load(open(grammar_path))["patterns"] for rule in [top, *top.get("patterns", [])]]
    faults += [f"no script has anything of the rule {name}" for name in names if name not in grammar.used]
    for fault in faults:
        print(fault)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
