#!/usr/bin/env python3
"""Our JavaScript as Biome (a formatter and linter, from npm) wants it; --update has Biome mend what it can.

Usage: javascript_test.py SOURCE [--update]
"""
import pathlib
import platform
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import npm_package  # noqa: E402

PACKAGES = {"x86_64": ("@biomejs/cli-linux-x64@1.9.4", "3e38f0368640ac9d25cca30199a4070ee6179f330d9f0f432aac6e21020269d7")}
FOLDERS = ("viewer_export/html", "tests/browser", "tests/golden/tables")


def main():
    source = pathlib.Path(sys.argv[1]).resolve()
    machine = platform.machine()
    if machine not in PACKAGES:
        print(f"not possible here: Biome is pinned for {', '.join(PACKAGES)} only, this machine is {machine}")
        return 77
    try:
        biome = npm_package.assets(*PACKAGES[machine]) / "biome"
    except npm_package.Unavailable as error:
        print(f"not possible here: {error}")
        return 77
    biome.chmod(0o755)
    change = ["--write", "--unsafe"] if "--update" in sys.argv else []
    config = source / "tests/browser/javascript"
    done = subprocess.run([biome, "check", f"--config-path={config}", "--colors=off", *change, *FOLDERS],
                          cwd=source, check=False, timeout=200, stdin=subprocess.DEVNULL)
    return done.returncode


sys.exit(main())
