#!/usr/bin/env python3
"""The manual pages and the completion that the build writes. Tools and shells that are missing are skipped.

Usage: manual_test.py PROGRAM FOLDER_OF_THE_MANUAL [unittest's arguments]
"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

PROGRAM = pathlib.Path(sys.argv[1])
MANUAL = pathlib.Path(sys.argv[2])
HERE = pathlib.Path(__file__).resolve().parent
FILES = ["a.off", "b.OBJ", "c d.ply", "e.json", "f.txt"]


def output(arguments, **more):
    return subprocess.run(arguments, check=True, capture_output=True, text=True, timeout=60, **more).stdout


def help_of(*command):
    return output([PROGRAM, *command, "--help"])


def commands():
    section = help_of().partition("Commands:\n")[2].partition("\n\n")[0]
    return re.findall(r"^  (\S+)", section, re.M)


def options_of(*command):
    lines = re.findall(r"^  (-[-\w]+(?:,-[-\w]+)*)", help_of(*command), re.M)
    return [name for line in lines for name in line.split(",")]


class Pages(unittest.TestCase):
    def test_sound(self):
        for page in sorted(MANUAL.glob("*.1")):
            for lint in (["mandoc", "-T", "lint", "-W", "warning"], ["groff", "-man", "-ww", "-z"]):
                if shutil.which(lint[0]):
                    run = subprocess.run([*lint, page], capture_output=True, text=True)
                    self.assertEqual((run.returncode, run.stdout + run.stderr), (0, ""), page.name)

    def test_have_every_option(self):
        self.assertIn("remesh", commands())
        for command in commands():
            text = (MANUAL / f"bisector-{command}.1").read_text().replace(r"\-", "-")
            options = options_of(command)
            self.assertIn("--help", options)
            for option in options:
                self.assertRegex(text, rf"(?m)^\.TP\n(.*, )?\\fB{re.escape(option)}\\fR", command)
            for section in ("NAME", "SYNOPSIS", "DESCRIPTION", "OPTIONS", "EXAMPLES", "EXIT STATUS", "SEE ALSO"):
                self.assertIn(f"\n.SH {section}\n", text, command)

    def test_name_the_environment(self):
        for command, name in (("tet", "BISECTOR_TETGEN"), ("remesh", "BISECTOR_CACHE")):
            self.assertIn(rf"\fB{name}\fR", (MANUAL / f"bisector-{command}.1").read_text())
        self.assertNotIn("ENVIRONMENT", (MANUAL / "bisector-quality.1").read_text())


class Completion:
    """What each shell has to offer; `offer` gives it for a command line."""

    def setUp(self):
        if not shutil.which(self.shell):
            self.skipTest(f"there is no {self.shell}")
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        for name in FILES:
            (self.folder / name).touch()
        (self.folder / "sub").mkdir()

    def offered(self, line):
        return sorted({word.rstrip("/").replace("\\", "") for word in self.offer(line)})

    def test_commands(self):
        self.assertLessEqual(set(commands()), set(self.offered("bisector ")))
        self.assertEqual(self.offered("bisector rem"), ["remesh", "remesh-parts"])

    def test_options(self):
        for command in commands():
            wanted = {name for name in options_of(command) if name.startswith("--")}
            found = {word.rstrip("=") for word in self.offered(f"bisector {command} --")}
            self.assertEqual(found, wanted, command)
        self.assertEqual([word.rstrip("=") for word in self.offered("bisector remesh --ene")], ["--energy"])

    def test_words(self):
        self.assertEqual(self.offered("bisector remesh --energy "), ["auto", "ccvt", "rcvt"])
        self.assertEqual(self.offered("bisector remesh in.off --detail a"), ["all", "auto"])
        self.assertEqual(self.offered("bisector tet --density c"), ["curvature", "curvature:"])
        self.assertEqual(self.offered("bisector remesh -n "), [])

    def test_files(self):
        self.assertEqual(self.offered("bisector remesh "), ["a.off", "b.OBJ", "c d.ply", "sub"])
        self.assertEqual(self.offered("bisector remesh a.off --report "), ["e.json", "sub"])
        self.assertLessEqual({*FILES, "sub"}, set(self.offered("bisector tree ")))

    def test_step(self):
        self.program = "bisector-step"
        self.assertEqual(self.offered("bisector-step --unit i"), ["in"])
        self.assertEqual(self.offered("bisector-step "), ["e.json", "sub"])

    program = "bisector"


class Bash(Completion, unittest.TestCase):
    shell = "bash"

    def offer(self, line):
        words = line.split(" ")
        script = ('source "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); '
                  'function=$(complete -p "$1"); function=${function#*-F }; ${function%% *}; '
                  'printf "%s\\n" "${COMPREPLY[@]}"')
        source = MANUAL / f"{self.program}.bash"
        return [word for word in output(["bash", "--norc", "-c", script, "bash", source, *words],
                                        cwd=self.folder).split("\n") if word]

    def test_parts_of_words(self):
        self.assertEqual(self.offered("bisector remesh --energy = r"), ["rcvt"])
        self.assertEqual(self.offered("bisector remesh --device vulkan : 0 --de"), ["--density", "--detail", "--device"])


class Fish(Completion, unittest.TestCase):
    shell = "fish"

    def offer(self, line):
        script = f"source {MANUAL / self.program}.fish; complete -C '{line}'"
        return [entry.partition("\t")[0] for entry in output(["fish", "--no-config", "-c", script],
                                                             cwd=self.folder).splitlines()]


class Zsh(Completion, unittest.TestCase):
    shell = "zsh"

    def offer(self, line):
        functions = self.folder / ".functions"
        functions.mkdir(exist_ok=True)
        shutil.copy(MANUAL / f"{self.program}.zsh", functions / f"_{self.program}")
        return output(["zsh", "-f", HERE / "complete.zsh", functions, line], cwd=self.folder).splitlines()


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
