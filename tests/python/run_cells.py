#!/usr/bin/env python3
"""Runs the samples of pages (```python blocks) and the cells of notebooks, each file in one go, as their readers would: in a
folder with data/ and the models of `make examples`. With --write the pictures that cells end with go into the notebooks.

Usage: run_cells.py [--write] EXAMPLES FILE...
"""
import ast
import base64
import json
import os
import re
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def run(code, name, names):
    """Runs a cell; what its last expression is."""
    tree = ast.parse(code, name)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, name, "exec"), names)
    return eval(compile(ast.Expression(last.value), name, "eval"), names) if last else None


def outputs_of(value, number):
    if value is None:
        return []
    data = {"text/plain": [repr(value)]}
    if hasattr(value, "_repr_png_"):
        data["image/png"] = base64.b64encode(value._repr_png_()).decode()
    return [{"output_type": "execute_result", "execution_count": number, "metadata": {}, "data": data}]


def run_file(path, writes):
    text = open(path, encoding="utf-8").read()
    names = {"__name__": "__main__"}
    if path.endswith(".md"):
        for number, code in enumerate(re.findall(r"^```python\n(.*?)^```$", text, re.S | re.M), 1):
            run(code, f"{path}, sample {number}", names)
        return
    notebook = json.loads(text)
    number = 0
    for cell in notebook["cells"]:
        if cell["cell_type"] != "code":
            continue
        number += 1
        value = run("".join(cell["source"]), f"{path}, cell {number}", names)
        if writes:
            cell["execution_count"], cell["outputs"] = number, outputs_of(value, number)
    if writes:
        with open(path, "w", encoding="utf-8") as file:
            file.write(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n")


def main(arguments):
    writes = arguments[0] == "--write"
    examples, *files = arguments[writes:]
    examples, files = os.path.abspath(examples), [os.path.abspath(file) for file in files]
    for file in files:
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            os.symlink(examples, "examples")
            os.symlink(os.path.join(ROOT, "data"), "data")
            start = time.time()
            run_file(file, writes)
            print(f"{os.path.relpath(file, ROOT)}: good, {time.time() - start:.1f} s")
            os.chdir(ROOT)


if __name__ == "__main__":
    main(sys.argv[1:])
