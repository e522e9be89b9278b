#!/usr/bin/env python3
"""Colours scripts by the rules of a TextMate grammar, as editors do, and fails where a character is left over.

Usage: felt_grammar.py GRAMMAR SCRIPT...
"""
import json
import re
import sys


def main(grammar, *scripts):
    rules = json.load(open(grammar))["patterns"]
    failed = 0
    for script in scripts:
        end, inner = None, []
        for number, line in enumerate(open(script, encoding="utf-8"), 1):
            line = line.rstrip("\n")
            at = 0
            while at < len(line):
                if end:
                    nested = next((found for rule in inner if (found := re.compile(rule["match"]).match(line, at))), None)
                    found = None if nested else end.match(line, at)
                    at = nested.end() if nested else found.end() if found else at + 1
                    end = None if found else end
                    continue
                if line[at].isspace():
                    at += 1
                    continue
                for rule in rules:
                    found = re.compile(rule.get("match") or rule["begin"]).match(line, at)
                    if found and found.end() > at:
                        at = found.end()
                        end = re.compile(rule["end"]) if "end" in rule else None
                        inner = rule.get("patterns", [])
                        break
                else:
                    print(f"{script}:{number}:{at + 1}: no rule for {line[at]!r}")
                    failed = 1
                    at += 1
    return failed


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
