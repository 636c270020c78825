#!/usr/bin/python3
"""Runs docs/tutorial.md: its sh and python blocks in order, in one folder; the last must print the block that follows.

    tutorial_test.py PROGRAM ROOT

Leaves with status 77 (ctest: skipped) where NumPy or meshio is absent.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

try:
    import meshio  # noqa: F401
    import numpy  # noqa: F401
except ImportError as missing:
    print(f"skipped: {missing}; install python3-meshio")
    sys.exit(77)

program, root = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
blocks = re.findall(r"^```(\w*)\n(.*?)^```$", (root / "docs" / "tutorial.md").read_text(), re.M | re.S)
environment = dict(os.environ, HALFGRAD=str(root), PATH=f"{program.parent}:{os.environ['PATH']}")
printed = ""
with tempfile.TemporaryDirectory() as folder:
    for language, text in blocks:
        if language:
            command = ["bash", "-euc", text] if language == "sh" else [sys.executable, "-c", text]
            outcome = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
            printed = outcome.stdout
            if outcome.returncode != 0:
                sys.exit(f"{text}\nfails:\n{outcome.stdout}{outcome.stderr}")
        elif printed.split() != text.split():
            sys.exit(f"The tutorial says\n{text}\nbut this is printed:\n{printed}")
assert [language for language, _ in blocks].count("sh") >= 2 and blocks[-1][0] == ""
