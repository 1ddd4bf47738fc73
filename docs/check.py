#!/usr/bin/env python3
"""Checks the documentation: book, figures, links, commands, words, map of the code.

check.py [PROGRAM]     PROGRAM is the built epirig, by default target/release/epirig

- The book is built, if mdbook is installed. The figures are what docs/figures.py draws.
- Every relative link leads to a file, and every anchor to a heading. Files and folders that are named exist.
- Shell blocks of the book (```sh) are run, those of a chapter in their order in one temporary folder. What needs hardware or minutes is
  marked ```sh,no_run. Of every command in the docs, run or not, verb and options exist.
- Error messages that the chapter on troubleshooting quotes stand in the code.
- Lines of prose have at most 100 characters, sentences at most 25 words, and no word is one that the project has given up.
- ARCHITECTURE.md names every module of every crate.

Exits with code 1 if there is a finding. Only Python's standard library is needed.
"""
import concurrent.futures
import functools
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
BOOK = ROOT / "docs/src"
PAGES = [
    *(ROOT / name for name in ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "TESTING.md", "SECURITY.md", "CHANGELOG.md"]),
    *sorted((ROOT / "docs").glob("**/*.md")),
    *sorted(ROOT.glob("crates/**/README.md")),
    *(ROOT / name for name in ["firmware-protocol/PROTOCOL.md", "firmware-protocol/uno/README.md"]),
    *(ROOT / name for name in ["fuzz/README.md", "benches/peers/README.md", "web/README.md"]),
]
LONGEST_LINE = 100
LONGEST_SENTENCE = 25
# Commands that hang are ended. The slowest chapter takes 20 s on two idle cores.
CHAPTER_SECONDS = 600

# What the project used to say, and the word of the field.
WORDS = {
    r"hidden(?!,? (locked )?(folder|file|name|place))": "occluded",
    r"darken(s|ed|ing)?": "vignetting",
    r"twins?": "simulated rig, simulator",
    r"rasters?": "disparity step",
    r"hypothes[ie]s": "candidate",
    r"votes?|voted": "observation",
    r"hot pixels?": "defective pixels",
    r"audits?": "positioning error",
    r"preflight": "doctor",
    r"hangs? together": "largest connected region",
    r"stands? out (from|of) chance": "significant",
    r"direction of travel": "stage axis",
    r"so many": "number of ...",
    r"every so|manieth": "every n-th",
    r"gone on with": "resumed",
    r"could not be had|cannot be had|can be had": "failed after n attempts; possible",
    r"nobody has put": "not confirmed",
    r"things? in front": "occluding objects",
    r"of those who": "(rewrite the sentence)",
    r"what is no": "(rewrite the sentence)",
}

findings = []


def found(page, line, what):
    findings.append(f"{page.relative_to(ROOT)}:{line}: {what}")


class Page:
    """A page of Markdown: its lines, and of each line whether it is prose, code, a table, a heading or a comment."""

    def __init__(self, path):
        self.path = path
        self.lines = path.read_text(encoding="utf-8").split("\n")
        self.kinds = []
        self.fences = []
        fence, comment, made = None, False, False
        for number, line in enumerate(self.lines, 1):
            mark = re.match(r"\s*(```+)(.*)$", line)
            if fence is not None:
                self.kinds.append("code")
                if mark and not mark[2].strip():
                    self.fences.append((fence[0], fence[1], number - 1))
                    fence = None
            elif mark:
                self.kinds.append("code")
                fence = (mark[2].strip(), number + 1)
            elif line.startswith("<!--") or comment:
                self.kinds.append("comment")
                comment = "-->" not in line
                # Tests write the tables between `<!-- name -->` and `<!-- end ... -->`, and hold them to the truth.
                made = not comment and not line.startswith("<!-- end")
            elif line.startswith("|"):
                self.kinds.append("made" if made else "table")
            elif line.startswith("#"):
                self.kinds.append("heading")
            elif line.startswith("    ") and (number == 1 or self.kinds[-1] == "code" or not self.lines[number - 2].strip()):
                self.kinds.append("code")
            elif not line.strip():
                # A blank line between lines of an indented block belongs to neither.
                self.kinds.append("blank")
            else:
                self.kinds.append("prose")
        if fence is not None:
            found(path, fence[1] - 1, "a code block that does not end")

    def of_kind(self, *kinds):
        return ((number, line) for number, (line, kind) in enumerate(zip(self.lines, self.kinds), 1) if kind in kinds)

    def blocks(self, language):
        """First line and text of each fenced block of this language and these marks."""
        for marks, first, end in self.fences:
            if marks == language:
                yield first, self.lines[first - 1 : end]

    @functools.cached_property
    def anchors(self):
        anchors, counts = set(), {}
        for _, line in self.of_kind("heading"):
            title = plain(line.lstrip("#").strip())
            slug = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
            count = counts.get(slug, 0)
            counts[slug] = count + 1
            anchors.add(slug if count == 0 else f"{slug}-{count}")
        for _, line in self.of_kind("prose"):
            include = re.match(r"\{\{#include (.*)\}\}", line)
            if include:
                anchors |= page_of((self.path.parent / include[1]).resolve()).anchors
        return anchors


@functools.cache
def page_of(path):
    return Page(path)


def plain(text):
    """Text of a line of Markdown, without code, link targets and emphasis."""
    text = re.sub(r"`[^`]*`", lambda code: code[0].strip("`"), text)
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    return text.replace("**", "").replace("*", "")


def without_code(text):
    return re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", re.sub(r"`[^`]*`", "CODE", text))


def check_links(page):
    for number, line in page.of_kind("prose", "table", "heading"):
        include = re.match(r"\{\{#include (.*)\}\}", line)
        if include and not (page.path.parent / include[1]).exists():
            found(page.path, number, f"includes {include[1]}, which does not exist")
        for target in re.findall(r"\]\(([^)]+)\)", re.sub(r"`[^`]*`", "", line)):
            if re.match(r"(https?:|mailto:)", target):
                continue
            file, _, anchor = target.partition("#")
            there = (page.path.parent / file).resolve() if file else page.path
            if not there.exists():
                found(page.path, number, f"links to {target}, which does not exist")
            elif BOOK in page.path.parents and BOOK not in there.parents:
                found(page.path, number, f"links to {target}, which is outside the book")
            elif anchor and there.suffix == ".md" and anchor not in page_of(there).anchors:
                found(page.path, number, f"links to {target}, but there is no such heading")


def check_book():
    if subprocess.run([sys.executable, ROOT / "docs/figures.py", "--check"]).returncode:
        findings.append("docs/figures.py: the figures in docs/src/images are not what it draws")
    chapters = set(re.findall(r"\]\(([^)]+\.md)\)", (BOOK / "SUMMARY.md").read_text()))
    for path in BOOK.glob("*.md"):
        if path.name != "SUMMARY.md" and path.name not in chapters:
            found(BOOK / "SUMMARY.md", 1, f"does not name {path.name}")
    included = (BOOK / "decisions.md").read_text()
    for path in (ROOT / "docs/decisions").glob("*.md"):
        if path.name not in included:
            found(BOOK / "decisions.md", 1, f"does not include {path.name}")
    if shutil.which("mdbook") is None:
        print("SKIPPED: mdbook is not installed; the book was not built (cargo install --locked mdbook)")
        return
    with tempfile.TemporaryDirectory() as folder:
        built = subprocess.run(
            ["mdbook", "build", ROOT / "docs", "--dest-dir", folder], capture_output=True, text=True
        )
        said = built.stdout + built.stderr
        if built.returncode or re.search(r"\b(ERROR|WARN)\b", said):
            findings.append(f"mdbook build docs: {said.strip()}")


def run_chapter(page, program):
    """Runs the shell blocks of a chapter. Commands keep their line numbers, so that bash tells where one fails."""
    script = [""] * len(page.lines)
    for first, lines in page.blocks("sh"):
        script[first - 1 : first - 1 + len(lines)] = lines
    if not any(script):
        return
    begun = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        home = pathlib.Path(folder)
        work = home / "work"
        (home / "bin").mkdir()
        work.mkdir()
        (home / "bin/epirig").symlink_to(program)
        # Line 1 of a chapter is its title.
        script[0] = f"set -E; trap 'echo \"$LINENO $BASH_COMMAND\" >> {home}/failed' ERR"
        (home / "script").write_text("\n".join(script))
        environment = {key: value for key, value in os.environ.items() if not key.startswith("EPIRIG_")}
        environment |= {"PATH": f"{home}/bin:{environment['PATH']}", "HOME": folder}
        running = subprocess.Popen(
            ["bash", home / "script"],
            cwd=work,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        try:
            said, _ = running.communicate(timeout=CHAPTER_SECONDS)
        except subprocess.TimeoutExpired:
            os.killpg(running.pid, signal.SIGKILL)
            said, _ = running.communicate()
            found(page.path, 1, f"its commands take more than {CHAPTER_SECONDS} s")
        finally:
            # What a chapter leaves running ends with it.
            try:
                os.killpg(running.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
        failed = home / "failed"
        if failed.exists():
            for line in failed.read_text().splitlines():
                number, _, command = line.partition(" ")
                found(page.path, number, f"the command failed: {command}")
            print(said)
    print(f"{page.path.relative_to(ROOT)}: commands ran in {time.monotonic() - begun:.1f} s")


@functools.cache
def options_of(program, verb):
    """The long options of a verb, or None if there is no such verb."""
    help_text = subprocess.run([program, *verb, "--help"], capture_output=True, text=True)
    if help_text.returncode:
        return None
    return frozenset(re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", help_text.stdout))


def check_commands(page, program):
    """Verb and options of each command that the page names."""
    texts = []
    for marks, first, end in page.fences:
        if re.match(r"sh\b", marks):
            texts += [(number, self_line) for number, self_line in enumerate(page.lines[first - 1 : end], first)]
    for number, line in page.of_kind("prose", "table"):
        texts += [(number, code) for code in re.findall(r"`(epirig [^`]*)`", line)]
    for number, text in texts:
        for command in re.findall(r"(?:^|[;&|] *|\$ )(epirig [^;&|#]*)", text):
            words = command.replace("\\", "").split()[1:]
            if words and re.match(r"(-|[A-Z.])", words[0]):
                words = ["--help"] if words[0].startswith("-") else []
            if not words or words[0].startswith("-"):
                continue
            verb = (words[0],)
            if verb[0] in ("stage", "camera", "target") and len(words) > 1:
                verb = (words[0], words[1].strip(","))
            options = options_of(program, verb)
            if options is None:
                found(page.path, number, f"there is no verb: epirig {' '.join(verb)}")
                continue
            for option in re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", command):
                if option not in options:
                    found(page.path, number, f"epirig {' '.join(verb)} has no option {option}")


def check_paths(page):
    """Files and folders of the project that a page names in code exist."""
    tops = {path.name for path in ROOT.iterdir() if path.is_dir()} - {"target"}
    for number, line in page.of_kind("prose", "table", "heading"):
        for name in re.findall(r"`([\w.-]+(?:/[\w.{},-]+)+/?)`", line):
            braces = re.search(r"\{([^}]*)\}", name)
            names = [name.replace(braces[0], part) for part in braces[1].split(",")] if braces else [name]
            bases = [ROOT, page.path.parent]
            if page.path.parent == BOOK and name.endswith(".rs"):
                bases += ROOT.glob("crates/*/src")
            elif name.split("/")[0] not in tops:
                continue
            if not all(any((base / one).exists() for base in bases) for one in names):
                found(page.path, number, f"names {name}, which does not exist")


def check_words(page):
    for number, line in page.of_kind("prose", "table", "heading"):
        text = without_code(line)
        if page.kinds[number - 1] == "prose":
            shown = re.sub(r"\]\([^)]*\)", "]", line)
            if len(shown) > LONGEST_LINE and not re.fullmatch(r"!\[.*\]", shown):
                found(page.path, number, f"{len(shown)} characters; wrap at {LONGEST_LINE}")
        # A phrase may go on in the next line.
        follows = page.lines[number] if number < len(page.lines) and page.kinds[number] == "prose" else ""
        both = f"{text} {without_code(follows.strip())}"
        for pattern, word in WORDS.items():
            given_up = re.search(rf"\b({pattern})\b", both, re.IGNORECASE)
            if given_up and given_up.start() < len(text):
                found(page.path, number, f"{given_up[0]!r}: the field says {word}")
    check_sentences(page)


def check_sentences(page):
    paragraph, first = [], 0

    def done():
        text = without_code(" ".join(paragraph))
        for sentence in re.split(r"(?<=[.:;?!])[*\s)]+", text):
            count = len(re.findall(r"[\w'’-]*[A-Za-z][\w'’-]*", sentence))
            if count > LONGEST_SENTENCE:
                found(page.path, first, f"a sentence of {count} words: {sentence[:60]} ...")
        paragraph.clear()

    for number, (line, kind) in enumerate(zip(page.lines, page.kinds), 1):
        item = re.match(r"\s*([-*]|\d+\.) ", line)
        if kind != "prose" or item:
            done()
        if kind == "prose":
            if not paragraph:
                first = number
            paragraph.append(line.strip()[len(item[0].strip()) if item else 0 :])
    done()


def check_messages():
    """What the chapter on troubleshooting quotes from error messages stands in the code."""
    sources = [*ROOT.glob("src/**/*.rs"), *ROOT.glob("crates/*/src/**/*.rs")]
    code = re.sub(r"\\\n\s*", "", "\n".join(path.read_text() for path in sources))
    page = page_of(BOOK / "troubleshooting.md")
    for number, line in page.of_kind("table"):
        for quoted in re.findall(r'"([^"]*)"', line.split("|")[1]):
            for part in filter(None, map(str.strip, quoted.split("..."))):
                if part not in code:
                    found(page.path, number, f"quotes {part!r}, which no message says")


def check_modules():
    """ARCHITECTURE.md names every module: a folder or a file in the src folder of a crate."""
    text = (ROOT / "ARCHITECTURE.md").read_text()
    named = set(re.findall(r"`([a-z0-9_]+)`", text))
    for source in [ROOT / "src", *sorted(ROOT.glob("crates/*/src"))]:
        for path in source.iterdir():
            module = path.stem
            if module in ("lib", "main") or (path.is_file() and path.suffix != ".rs") or path.name == "tests":
                continue
            if module not in named:
                findings.append(f"ARCHITECTURE.md: does not name the module {path.relative_to(ROOT)}")


def main():
    if len(sys.argv) > 2 or sys.argv[1:] in (["-h"], ["--help"]):
        sys.exit(__doc__)
    program = (pathlib.Path(sys.argv[1]) if sys.argv[1:] else ROOT / "target/release/epirig").resolve()
    if not program.exists():
        sys.exit(f"{program}: no such program; build it (cargo build --release), or name another one")
    pages = [page_of(path) for path in PAGES]
    check_book()
    check_modules()
    check_messages()
    for page in pages:
        check_links(page)
        check_commands(page, program)
        check_paths(page)
        check_words(page)
    # Simulated stages move in real time: while one chapter waits, another computes.
    with concurrent.futures.ThreadPoolExecutor(max_workers=2) as pool:
        chapters = [page for page in pages if page.path.parent == BOOK]
        list(pool.map(lambda page: run_chapter(page, program), chapters))
    for finding in findings:
        print(finding)
    print(f"{len(pages)} pages, {len(findings)} findings")
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
