#!/usr/bin/env python3
"""scripts/gpu_study: all of it with --quick on the device that there is, cut once and gone on with; without a device
what it says; and how steps that fail or hang are recorded.

Usage: gpu_study_test.py BUILD, the folder of a build."""
import csv
import importlib.machinery
import importlib.util
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import xml.dom.minidom

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "gpu_study"
BUILD = os.path.abspath(sys.argv.pop(1)) if len(sys.argv) > 1 else None
PICTURES = ["evaluations.svg", "phases.svg", "batches.svg", "remeshes.svg"]


def load():
    sys.dont_write_bytecode = True  # beside the script, in the sources
    loader = importlib.machinery.SourceFileLoader("gpu_study_script", str(SCRIPT))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("gpu_study_script", loader))
    loader.exec_module(module)
    return module


STUDY = load()


def study(out, *words, **more):
    environment = dict(os.environ, **more)
    return subprocess.run([sys.executable, str(SCRIPT), "--build", BUILD, "-o", out, *words], env=environment,
                          stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300)


def is_alive(pid):
    """Whether it runs; what has ended and waits for its parent does not."""
    try:
        return pathlib.Path("/proc/{}/stat".format(pid)).read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def step(name, script, limit=20.0, read=lambda folder, output: {"said": output.strip()}):
    return STUDY.Step(name, ["/bin/sh", "-c", script], limit, read)


class Steps(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def run_all(self, steps, budget=60):
        records = STUDY.run_steps(steps, self.folder, budget, dict(os.environ))
        return {record["name"]: record for record in records}

    def test_what_fails_is_recorded_and_the_next_follows(self):
        found = self.run_all([step("bad", "echo why; exit 3"), step("signal", "kill -SEGV $$"),
                              STUDY.Step("missing", ["/nonexistent/program"], 5, lambda *_: {}),
                              step("unread", "echo fine", read=lambda folder, _: STUDY.read_json(folder + "/none")),
                              step("good", "echo fine")])
        self.assertEqual([found[name]["status"] for name in ("bad", "signal", "missing", "unread", "good")],
                         ["failed"] * 4 + ["passed"])
        self.assertIn("why", found["bad"]["output"])
        self.assertIn("3", found["bad"]["reason"])
        self.assertIn("signal 11", found["signal"]["reason"])
        self.assertEqual(found["good"]["data"], {"said": "fine"})

    def test_what_hangs_is_ended_with_its_children(self):
        began = time.monotonic()
        found = self.run_all([step("hangs", "echo begun; sleep 100 & echo $! >child; wait", limit=1.0)])
        self.assertLess(time.monotonic() - began, 30)
        self.assertEqual(found["hangs"]["status"], "failed")
        self.assertIn("begun", found["hangs"]["output"])
        with open(os.path.join(self.folder, "child")) as file:
            child = int(file.read())
        for _ in range(100):
            if not is_alive(child):
                break
            time.sleep(0.05)
        self.assertFalse(is_alive(child))

    def test_only_what_has_not_passed_is_done_again(self):
        steps = [step("once", "echo x >>once"), step("until", "echo x >>until; test -e ready")]
        self.assertEqual(self.run_all(steps)["until"]["status"], "failed")
        pathlib.Path(self.folder, "ready").touch()
        self.assertEqual(self.run_all(steps)["until"]["status"], "passed")
        self.run_all(steps)
        for name, times in (("once", 1), ("until", 2)):
            self.assertEqual(pathlib.Path(self.folder, name).read_text().count("x"), times)
        # A step of that name with another command is another step.
        self.run_all([step("once", "echo x >>once; true")])
        self.assertEqual(pathlib.Path(self.folder, "once").read_text().count("x"), 2)

    def test_the_budget_ends_the_study(self):
        found = self.run_all([step("long", "sleep 100"), step("late", "true")], budget=6)
        self.assertEqual(found["long"]["status"], "failed")
        self.assertLess(found["long"]["seconds"], 20)
        self.assertEqual(found["late"]["status"], "not run")


class Floors(unittest.TestCase):
    def test_what_must_move_is_proportional(self):
        for precision in STUDY.PRECISIONS:
            none, one, two = (STUDY.floor_bytes(precision, 1000 * k, 4000 * k, 0) for k in range(3))
            for name in ("ends", "passes"):
                self.assertEqual(none[name], 0)
                self.assertEqual(2 * one[name], two[name])
            self.assertLess(one["ends"], one["passes"])


@unittest.skipUnless(BUILD, "needs a build")
class Whole(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.out = folder.name

    def test_without_a_driver_it_says_what_to_do(self):
        for more in ({"BISECTOR_VULKAN_LOADER": "/nonexistent"},
                     {"VK_DRIVER_FILES": "/nonexistent", "VK_ICD_FILENAMES": "/nonexistent"}):
            done = study(self.out, "--quick", **more)
            self.assertEqual(done.returncode, 1)
            self.assertIn("Vulkan", done.stdout)
            self.assertIn("cli.md", done.stderr)
            self.assertNotIn("Traceback", done.stderr)

    def test_cut_and_gone_on_with(self):
        program = STUDY.Programs(BUILD)
        devices, _ = STUDY.devices_of(program, {})
        if not STUDY.best_device(devices, None):
            self.skipTest("no Vulkan device")
        cut = subprocess.Popen([sys.executable, str(SCRIPT), "--build", BUILD, "-o", self.out, "--quick"],
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        for line in cut.stdout:
            if ": passed" in line:
                break
        cut.send_signal(signal.SIGTERM)
        cut.communicate(timeout=60)
        self.assertEqual(cut.returncode, 143)

        done = study(self.out, "--quick")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("has passed before", done.stdout)
        folder, = (entry for entry in pathlib.Path(self.out).iterdir() if entry.is_dir() and entry.name != "drivers")
        found = json.loads((folder / "study.json").read_text())
        self.assertEqual(found["steps"], {"passed": len(found["records"]), "failed": 0, "not run": 0})
        self.assertGreater(found["copy_bandwidth"], 0)
        with open(folder / "evaluations.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), len(found["evaluations"]))
        for row in rows:
            self.assertGreater(float(row["total_ms"]), 0)
            if row["on"] == "device":
                # What the device does is part of the whole, up to what is rounded and to clocks that differ.
                self.assertLessEqual(float(row["device_ms"]), 1.1 * float(row["total_ms"]) + 0.1)
                self.assertLess(float(row["floor_ends_ms"]), float(row["floor_passes_ms"]))
        # Pairs are a function of the seeds alone.
        self.assertEqual(len({(row["seeds"], row["pairs"]) for row in rows}), len({row["seeds"] for row in rows}))
        self.assertTrue(all(row["seconds.total"] > 0 for row in found["remeshes"]))
        for name in PICTURES:
            xml.dom.minidom.parse(str(folder / name))


if __name__ == "__main__":
    unittest.main()
