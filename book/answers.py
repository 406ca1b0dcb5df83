"""Renews the answers that the README and the book show: runs the commands of each block, and puts what the tool prints in the
place of the text below it.

    python book/answers.py GAPSCOPE              # the README, the pages in order, and those of the effects
    python book/answers.py GAPSCOPE PAGE...      # these pages alone

A page of an effect runs in a folder of its own, with the JSON files beside it. All others share one folder, as a reader works
through them: what the tutorial writes is what the page on reading the answer begins with. Real logs are those of `GAPSCOPE_DATA`
(default `../shared/data`); the servo's need PyPI `numpy`. A block whose commands fail, because a file is the reader's own, stays as it is, and that is said.
"""

import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

BLOCK = re.compile(r"```console\n((?:(?!```)[^\n]+\n)+)```\n\n```text\n(.*?)```", re.S)
JSON = re.compile(r"`(\w+\.json)`[^\n]*\n\n```json\n(.*?)```", re.S)
DEMO = re.compile(r"(?<=```\n)A 7-joint arm moves.*?(?=```)", re.S)
HERE = pathlib.Path(__file__).resolve().parent
# In the order in which one needs what another wrote.
PAGES = ["tutorial", "answer", "export", "rollouts", "good-logs", "servo-arms", "generate", "real-robots"]
# Folders of real logs that pages call by a shorter name.
SHORT = {"xl330": "xl330_pendulum"}


def runs(line):
    """Whether a line is run: not what installs something."""
    return line.startswith(("gapscope ", "awk ", "python book/"))


def said(gapscope, folder, line):
    """What a line prints; an error where it fails."""
    words = line.split(" #")[0]
    if words.startswith("gapscope "):
        words = words.replace("gapscope", shlex.quote(gapscope), 1)
        if "/found" in words and " --out " in words or " --out exported" in words:
            words += " --force"
    elif words.startswith("python "):
        words = words.replace("python book", f"{shlex.quote(sys.executable)} {shlex.quote(str(HERE))}", 1)
    done = subprocess.run(["sh", "-c", words], cwd=folder, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{line}: {done.stderr.strip()}")
    return done.stdout.strip("\n") + "\n"


def answer(gapscope, folder, commands, shown):
    """The text below a block: of its last command, or of all where the first one's words are shown too."""
    printed = [said(gapscope, folder, line) for line in commands.strip().split("\n") if runs(line)]
    if not printed:
        return shown
    both = len(printed) > 1 and shown.split()[:3] == printed[0].split()[:3]
    text = "".join(printed) if both else printed[-1]
    if shown.startswith("…\n"):
        # The page shows the end alone, from the line that begins like this.
        first = shown.split("\n")[1].split()[0]
        tail = [i for i, line in enumerate(text.split("\n")) if line.startswith(first)]
        return "…\n" + "\n".join(text.split("\n")[tail[0] :]) if tail else shown
    return text


def renew(gapscope, page, folder):
    text = page.read_text()
    for name, content in JSON.findall(text):
        (folder / name).write_text(content)

    def block(match):
        try:
            new = answer(gapscope, folder, match[1], match[2])
        except RuntimeError as error:
            print(f"{page.name}: left as it is: {error}", flush=True)
            return match[0]
        return f"```console\n{match[1]}```\n\n```text\n{new}```"

    new = BLOCK.sub(block, text)
    if page.name == "README.md":
        with tempfile.TemporaryDirectory() as own:
            new = DEMO.sub(lambda _: said(gapscope, own, "gapscope demo --seed 0"), new)
    page.write_text(new)
    print(page.name, "renewed" if new != text else "as before", flush=True)


def main():
    gapscope = str(pathlib.Path(sys.argv[1]).resolve())
    effects = sorted((HERE / "src" / "effects").glob("*.md"))
    pages = [HERE.parent / "README.md", *(HERE / "src" / f"{name}.md" for name in PAGES), *effects]
    named = [pathlib.Path(page).resolve() for page in sys.argv[2:]] or pages
    data = pathlib.Path(os.environ.get("GAPSCOPE_DATA", HERE.parent.parent / "shared" / "data")).resolve()
    with tempfile.TemporaryDirectory() as shared:
        if data.is_dir():
            for name in [*SHORT, *(path.name for path in data.iterdir() if path.is_dir())]:
                folder = pathlib.Path(shared, name)
                folder.mkdir()
                for file in (data / SHORT.get(name, name)).iterdir():
                    (folder / file.name).symlink_to(file)
        for page in named:
            if page.parent.name != "effects":
                renew(gapscope, page, pathlib.Path(shared))
                continue
            with tempfile.TemporaryDirectory() as own:
                for file in page.parent.glob("*.json"):
                    shutil.copy(file, own)
                renew(gapscope, page, pathlib.Path(own))


main()
