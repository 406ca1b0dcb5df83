"""Renews the answers that the pages of the book show: runs the commands of each block that diagnoses, and puts what the
tool prints in the place of the text below it.

    python book/answers.py GAPSCOPE [PAGE...]        # pages: book/src/effects/*.md where none are named

A page's JSON files are those beside it. Each page runs in a folder of its own.
"""

import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

BLOCK = re.compile(r"```console\n((?:gapscope [^\n]*\n)+)```\n\n```text\n(.*?)```", re.S)


def answer(gapscope, page, commands, shown):
    """What the last command prints; what was shown where the block does not begin with simulated logs."""
    lines = commands.strip().split("\n")
    if not (lines[0].startswith("gapscope generate") and lines[-1].startswith("gapscope diagnose")):
        return shown
    with tempfile.TemporaryDirectory() as folder:
        for file in page.parent.glob("*.json"):
            shutil.copy(file, folder)
        for line in lines:
            words = line.split(" #")[0].replace("gapscope", shlex.quote(gapscope), 1)
            done = subprocess.run(["sh", "-c", words], cwd=folder, capture_output=True, text=True)
            if done.returncode:
                sys.exit(f"{page}: {line}\n{done.stderr}")
        return done.stdout.strip() + "\n"


def main():
    gapscope = str(pathlib.Path(sys.argv[1]).resolve())
    here = pathlib.Path(__file__).parent
    pages = [pathlib.Path(page) for page in sys.argv[2:]] or sorted((here / "src" / "effects").glob("*.md"))
    for page in pages:
        text = page.read_text()
        new = BLOCK.sub(lambda m: f"```console\n{m[1]}```\n\n```text\n{answer(gapscope, page, m[1], m[2])}```", text)
        page.write_text(new)
        print(page, "renewed" if new != text else "as before", flush=True)


main()
