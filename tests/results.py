"""Results of a run of the tests: results.py JUNIT_OR_LOG... [--skipped LIST] [--slowest N]

Reads what cargo-nextest (JUnit) and cargo test (text) leave, and prints the slowest tests, what was skipped and why, and how many
passed, failed and were skipped. A test that skips itself passes for its runner; LIST, with a name and a reason a line, says which did.
"""

import argparse
import re
import sys
import xml.etree.ElementTree
from pathlib import Path


def junit(path):
    """Name, seconds and outcome of each test."""
    for suite in xml.etree.ElementTree.parse(path).getroot().iter("testsuite"):
        for case in suite.iter("testcase"):
            failed = case.find("failure") is not None or case.find("error") is not None
            yield f"{suite.get('name')} {case.get('name')}", float(case.get("time", 0.0)), "failed" if failed else "passed"


def log(path):
    """The same of cargo test, which tells seconds only where it was asked for them."""
    crate = "?"
    for line in Path(path).read_text(errors="replace").splitlines():
        if running := re.match(r"\s*(?:Running .*\(.*/([^/]+)-[0-9a-f]+\)|Doc-tests (\S+))", line):
            crate = running[1] or f"{running[2]} (doc)"
        elif test := re.match(r"test (.+?)(?: - should panic)? \.\.\. (ok|FAILED|ignored[^<]*)(?: <([0-9.]+)s>)?$", line):
            outcome = {"ok": "passed", "FAILED": "failed"}.get(test[2], "ignored")
            yield f"{crate} {test[1]}", float(test[3] or 0.0), outcome


parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("results", nargs="*")
parser.add_argument("--skipped")
parser.add_argument("--failed-steps", type=int, default=0, help="other things that failed; they count as failures")
parser.add_argument("--slowest", type=int, default=10)
options = parser.parse_args()

tests = {}
for path in options.results:
    if Path(path).exists():
        for name, seconds, outcome in (junit if path.endswith(".xml") else log)(path):
            tests[name] = (seconds, outcome)
reasons = {}
if options.skipped and Path(options.skipped).exists():
    for line in Path(options.skipped).read_text().splitlines():
        name, _, reason = line.partition("\t")
        reasons[name] = reason

slowest = sorted(tests.items(), key=lambda test: -test[1][0])[: options.slowest]
if slowest:
    print(f"the {len(slowest)} slowest tests:")
for name, (seconds, _) in slowest:
    print(f"  {seconds:7.1f} s  {name}")
for name, reason in sorted(reasons.items()):
    print(f"skipped: {name}: {reason}")
count = {word: sum(outcome == word for _, outcome in tests.values()) for word in ("passed", "failed", "ignored")}
for name, (_, outcome) in tests.items():
    if outcome == "failed":
        print(f"failed: {name}")
skipped = len(reasons)
failed = count["failed"] + options.failed_steps
print(f"{count['passed'] - skipped} passed, {failed} failed, {skipped} skipped")
sys.exit(failed > 0)
