#!/usr/bin/env python3
"""scripts/bench without timing: what it reads, and all of it in a repository whose programs only print."""
import csv
import importlib.machinery
import importlib.util
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import xml.dom.minidom

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "bench"
MACHINE = "Some Processor at 2 GHz, 2 cores, load 0.42 before the start; compiler 12.2.0"

EVALUATION = """| seeds | source | threads | total | neighbours | owners | clip | CGAL | ratio | pairs |
|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|
| 10000 | nearest | 1 | 42.50 | 8.13 | 2.89 | 31.20 | 33.10 | 1.28 | 71630 |
| 10000 | nearest | 2 | 24.10 | 4.53 | 1.51 | 17.90 | 33.10 | 0.73 | 71630 |
| 100000 | nearest | 1 | 281 | 96.20 | 8.39 | 176 | 400 | 0.70 | 309302 |
| 100000 | nearest | 2 | 160 | 52.20 | 4.11 | 99.10 | 400 | 0.40 | 309302 |
"""
REMESH = """| random seed | total | in diagrams | CGAL 100 k | ratio | evaluations | q_ave | q_min | topology |
|--:|--:|--:|--:|--:|--:|--:|--:|--:|
| 1 | 4.00 | 3.18 | 0.400 | 10.00 | 231 | 0.9628 | 0.723 | as input |
"""
TET = """| mesher | vertices | boundary | tets | bad | dihedral_min | rms / remesh | volume % | Euler | s |
|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|
| Bisector | 5000 | 2841 | 22117 | 0 | 12.31 | 1.02 | -0.012 | -4 | 8.0 |
| CGAL odt | 5102 | 2790 | 23344 | 0 | 13.05 |  | -0.051 | -4 | 6.0 |
| TetGen -pq | 5033 | 2901 | 22950 | 0 | 5.11 |  | -0.012 | -4 | 0.1 |
"""
SEGMENT = """| model | triangles | surfaces | start | regions | total | starting |
|--:|--:|--:|--:|--:|--:|--:|
| smooth | 19844 | quadrics | merging | 22 | 0.80 | 0.51 |
| smooth | 19844 | planes | CGAL L2 | 22 | 1.30 |  |
| smooth | 19844 | planes | CGAL L2,1 | 22 | 1.60 |  |
"""
TREE = """| scan | points | clusters | branches | segmentation s | branching s | modelling s |
|---|---|---|---|---|---|---|
| hetre (thesis) | 34542 | 80 | 26 | 5.94 | 0.015 | 1.1 |
| /somewhere/generated.xyz | 36000 | 120 | 13 | 1.5 | 0.25 | 0.25 |
"""
TABLES = {"evaluation": EVALUATION, "remesh": REMESH, "tet": TET, "segment": SEGMENT, "tree": TREE}


def load():
    sys.dont_write_bytecode = True  # beside the script, in the sources
    loader = importlib.machinery.SourceFileLoader("bench_script", str(SCRIPT))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("bench_script", loader))
    loader.exec_module(module)
    return module


class Reading(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.bench = load()

    def seconds(self, samples):
        return {sample.key: sample.seconds for sample in samples}

    def test_evaluation(self):
        samples = self.bench.read_evaluation(EVALUATION, "smooth")
        self.assertEqual(self.seconds(samples), {("evaluation smooth 10000", 1): 0.0425,
                                                 ("evaluation smooth 10000", 2): 0.0241,
                                                 ("evaluation smooth 100000", 1): 0.281,
                                                 ("evaluation smooth 100000", 2): 0.16})
        # All of them by the triangulation of 100,000 points.
        self.assertEqual({sample.y for sample in samples}, {0.4})
        self.assertAlmostEqual(samples[3].ratio, 0.4)

    def test_remesh(self):
        (sample,) = self.bench.read_remesh(REMESH, "smooth")
        self.assertEqual((sample.key, sample.seconds, sample.y), (("remesh smooth 10000", 1), 4.0, 0.4))

    def test_tet_with_peers(self):
        self.assertEqual(self.seconds(self.bench.read_tet(TET, "part")),
                         {("tet part 5000", 1): 8.0, ("CGAL odt part 5000", 1): 6.0})

    def test_segment_with_peers(self):
        self.assertEqual(self.seconds(self.bench.read_segment(SEGMENT, "smooth")),
                         {("segment smooth 22", 1): 0.8, ("CGAL L2 regions smooth 22", 1): 1.3,
                          ("CGAL L2,1 regions smooth 22", 1): 1.6})

    def test_tree_without_the_thesis(self):
        self.assertEqual(self.seconds(self.bench.read_tree(TREE, "generated")), {("tree generated", 1): 2.0})

    def test_machine(self):
        self.assertEqual(self.bench.read_machine(MACHINE + "\nmodel smooth: 4 vertices, 4 triangles\n"),
                         {"processor": "Some Processor at 2 GHz", "cores": 2, "compiler": "12.2.0"})
        self.assertIsNone(self.bench.read_machine("| scan | points |\n"))

    def comparison(self, then, now):
        samples = [[self.bench.Sample("remesh smooth 10000", 1, seconds, 1.0) for seconds in run]
                   for run in (then, now)]
        return self.bench.comparison(("remesh smooth 10000", 1), *samples)

    def test_slower_only_beyond_the_spread(self):
        self.assertEqual(self.comparison([1, 1, 1], [1.09, 1.10, 1.11])["mark"], "slower")
        self.assertEqual(self.comparison([1, 1, 1], [1.02, 1.10, 1.20])["mark"], "slower? spread 18 %")
        self.assertEqual(self.comparison([1, 1, 1], [1.03, 1.04, 1.05])["mark"], "")
        self.assertEqual(self.comparison([1, 1, 1], [0.5, 0.5, 0.5])["mark"], "")
        # Each round is compared with its neighbour in time: a machine that slows down is no slower program.
        row = self.comparison([1, 2, 4], [1, 2, 4])
        self.assertEqual((row["change"], row["least"], row["most"]), (1, 1, 1))

    def test_the_scan_is_the_same_each_time(self):
        with tempfile.TemporaryDirectory() as folder:
            paths = [os.path.join(folder, name) for name in ("a", "b")]
            for path in paths:
                self.bench.write_scan(path)
            texts = [pathlib.Path(path).read_text() for path in paths]
        self.assertEqual(*texts)
        self.assertEqual(len(texts[0].splitlines()), 36_000)


FAKE_BUILD = r"""#!/bin/sh
set -e
cd "$(dirname "$0")/.."
if [ -e slow ]; then sleep 60; fi
shift
mkdir -p build/release/bench
for target in "$@"; do
  if [ ! -e "fakes/$target" ]; then echo "ninja: error: unknown target '$target'" >&2; exit 1; fi
  cp "fakes/$target" build/release/bench/
done
"""
FAKE_PROGRAM = r"""#!/bin/sh
cat <<'END'
{machine}

{table}END
"""


@unittest.skipUnless(shutil.which("git"), "needs git")
class Whole(unittest.TestCase):
    """A repository of two commits; the first has no bench_tree, the second remeshes in twice the time."""

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.root, self.temporary = self.folder / "repository", self.folder / "temporary"
        self.temporary.mkdir()
        self.environment = dict(os.environ, TMPDIR=str(self.temporary), GIT_CONFIG_GLOBAL=os.devnull,
                                GIT_CONFIG_NOSYSTEM="1", GIT_AUTHOR_NAME="A", GIT_AUTHOR_EMAIL="a@b",
                                GIT_COMMITTER_NAME="A", GIT_COMMITTER_EMAIL="a@b")
        for name in ("scripts", "fakes", "examples", "include/bisector"):
            (self.root / name).mkdir(parents=True)
        shutil.copy(SCRIPT, self.root / "scripts" / "bench")
        self.write("scripts/build", FAKE_BUILD)
        self.write(".gitignore", "/build/\n")
        self.write("include/bisector/version.h", "".join(
            "#define BISECTOR_VERSION_{} {}\n".format(*part) for part in (("MAJOR", 1), ("MINOR", 2), ("PATCH", 3))))
        for name in ("smooth", "part", "engraved"):
            self.write("examples/{}.off".format(name), "OFF\n")
        for name in TABLES:
            self.write_program(name, TABLES[name])
        (self.root / "fakes" / "bench_tree").unlink()
        self.git("init", "--quiet")
        self.commit()
        self.write_program("tree", TREE)
        self.write_program("remesh", REMESH.replace("4.00", "8.00"))
        self.commit()

    def write(self, name, text):
        (self.root / name).write_text(text)
        (self.root / name).chmod(0o755)

    def write_program(self, name, table):
        self.write("fakes/bench_" + name, FAKE_PROGRAM.replace("{machine}", MACHINE).replace("{table}", table))

    def git(self, *words):
        return subprocess.run(["git", "-C", self.root, *words], env=self.environment, check=True, capture_output=True,
                              text=True).stdout

    def commit(self):
        self.git("add", "--all")
        self.git("commit", "--quiet", "-m", "x")

    def build(self):
        programs = ["bench_" + name for name in TABLES]
        subprocess.run([self.root / "scripts" / "build", "release", *programs], check=True)

    def run_bench(self, *words):
        return subprocess.run([self.root / "scripts" / "bench", *words], env=self.environment, capture_output=True,
                              text=True, check=False, timeout=120)

    def expect_problem(self, words, *parts):
        done = self.run_bench(*words)
        self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (1, "", 1), done)
        for part in ("bench: ",) + parts:
            self.assertIn(part, done.stderr)

    def expect_nothing_left(self):
        self.assertEqual(list(self.temporary.iterdir()), [])
        self.assertEqual(len(self.git("worktree", "list").splitlines()), 1)

    def test_help(self):
        done = self.run_bench("--help")
        self.assertEqual(done.returncode, 0)
        self.assertIn("--against REV", done.stdout)

    def test_quick_writes_all_results(self):
        self.build()
        done = self.run_bench("--quick")
        self.assertEqual(done.returncode, 0, done)
        out = self.root / "build" / "bench"
        result = json.loads((out / "bench.json").read_text())
        self.assertEqual((result["version"], result["compiler"]), ("1.2.3", "12.2.0"))
        ratios = {(row["measurement"], row["threads"]): row["ratio"] for row in result["measurements"]}
        self.assertEqual(len(ratios), 11)  # the fakes print peers, asked or not
        self.assertAlmostEqual(ratios["remesh smooth 10000", 1], 20)
        self.assertAlmostEqual(ratios["tet part 5000", 1], 20)
        self.assertAlmostEqual(ratios["tree generated", 1], 5)
        with open(out / "bench.csv") as file:
            self.assertEqual({(row["measurement"], int(row["threads"])) for row in csv.DictReader(file)}, set(ratios))
        plot = xml.dom.minidom.parse(str(out / "bench.svg"))
        self.assertEqual(len(plot.getElementsByTagName("rect")), 1 + len(ratios))
        self.expect_nothing_left()

    def test_against_an_older_commit(self):
        self.build()
        done = self.run_bench("--quick", "--against", "HEAD~1", "-o", str(self.folder / "out"))
        self.assertEqual(done.returncode, 0, done)
        self.assertIn("not measured in HEAD~1", done.stdout)
        self.assertIn("tree generated: there is no bench_tree", done.stdout)
        result = json.loads((self.folder / "out" / "bench.json").read_text())
        rows = {row["measurement"]: row for row in result["against"]["measurements"]}
        self.assertAlmostEqual(rows["remesh smooth 10000"]["change"], 2)
        self.assertEqual({name for name, row in rows.items() if row["mark"] == "slower"}, {"remesh smooth 10000"})
        self.assertNotIn("tree generated", rows)
        self.assertIn("tree generated", [row["measurement"] for row in result["measurements"]])
        self.assertEqual([len(row["rounds"]) for row in result["measurements"]], [3] * len(result["measurements"]))
        self.expect_nothing_left()

    def test_against_a_build(self):
        self.build()
        other = self.folder / "other"
        shutil.copytree(self.root / "build" / "release", other)
        done = self.run_bench("--quick", "--only", "remesh", "--build-against", str(other))
        self.assertEqual(done.returncode, 0, done)
        self.assertNotIn("slower", done.stdout)

    def test_interrupted_leaves_no_worktree(self):
        self.write("slow", "")
        self.commit()
        self.git("rm", "--quiet", "--cached", "slow")
        (self.root / "slow").unlink()
        self.git("commit", "--quiet", "-m", "x")
        self.build()
        for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            process = subprocess.Popen([self.root / "scripts" / "bench", "--quick", "--against", "HEAD~1"],
                                       env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                       # Programs started in the background may have it ignored.
                                       preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler))
            self.assertTrue(any("building bench_evaluation" in line for line in iter(process.stderr.readline, "")))
            time.sleep(0.2)
            process.send_signal(number)
            process.communicate(timeout=30)
            self.assertEqual(process.returncode, code)
            self.expect_nothing_left()

    def test_problems_are_one_line(self):
        self.expect_problem(["--quick"], "bench_evaluation", "build/release/bench", "scripts/build release bench_eval")
        self.build()
        self.expect_problem(["--against", "nonsense"], "nonsense is no commit", "git log")
        self.expect_problem(["--build-against", "nowhere"], "nowhere/bench", "give the folder of a build")
        self.expect_problem(["--models", "nowhere"], "no folder nowhere")
        self.expect_problem(["--models", str(self.temporary)], "has no model")
        self.expect_problem(["--only", "nonsense"], "no measurement matches")
        (self.root / "examples" / "smooth.off").unlink()
        self.expect_problem(["--quick"], "no model", "smooth.off", "--models")
        self.expect_problem(["--quick", "--record"], "no model")
        self.expect_nothing_left()

    def test_a_program_that_fails_is_named(self):
        self.build()
        self.write("build/release/bench/bench_segment", "#!/bin/sh\necho 'bench_segment: too flat' >&2\nexit 1\n")
        done = self.run_bench("--quick")
        self.assertEqual(done.returncode, 1)
        self.assertIn("not measured: segment smooth: bench_segment failed: bench_segment: too flat", done.stdout)
        self.assertIn("tree generated", done.stdout)

    def test_record(self):
        history = self.root / "bench" / "results" / "history.csv"
        for _ in range(2):  # the history may differ from its commit, for what is measured does not
            done = self.run_bench("--quick", "--only", "remesh", "--record")
            self.assertEqual(done.returncode, 0, done)
        with open(history) as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), 2)
        self.assertEqual(rows[0] | {"date": ""}, {
            "date": "", "commit": self.git("rev-parse", "--short", "HEAD").strip(), "version": "1.2.3",
            "processor": "Some Processor at 2 GHz", "compiler": "12.2.0", "threads": "1",
            "measurement": "remesh smooth 10000", "seconds": "8", "ratio": "20"})
        self.expect_problem(["--record", "--build", "elsewhere"], "--build")
        self.write("examples/part.off", "OFF \n")
        self.expect_problem(["--quick", "--record"], "differ from their commit", "--record")


if __name__ == "__main__":
    unittest.main()
