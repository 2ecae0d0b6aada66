"""What the tests of exports to viewers share: arguments CIE MAKE_EXPORT EXAMPLES."""
import json
import os
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from example_truth import Truth, output_of  # noqa: E402
import npm_package  # noqa: E402
from npm_package import Unavailable  # noqa: E402

CIE, MAKE_EXPORT, EXAMPLES = sys.argv[1:4]
NAMES = ("isolated_ok", "multi_threaded_fails")

TIMER = "/plan@Timer(20000000)"
TRACK = "/track@Subscription(/points)"
DRIVE = "/drive@Subscription(/points)"

# Of tests/unit/viewer_export/sample_instances.hpp: name, tid, start, end (None: open), whether it
# overlaps another one without nesting.
INSTANCES = [(TIMER, 11, 1100, 1400, False), (TRACK, 12, 1500, 2600, False), (DRIVE, 13, 1600, 2700, False),
             (TIMER, 11, 2100, 2300, False), (TRACK, 12, 2600, 2900, False), (DRIVE, 14, 3000, 3400, False),
             (TRACK, 12, 3100, 3200, False), (DRIVE, 14, 3200, 3600, True), (TRACK, 12, 3350, 3360, False),
             (TIMER, 11, 6000, None, False)]
# Time of the publication, start and name of the instance that took the message.
FLOWS = [(1400, 1500, TRACK), (1400, 1600, DRIVE), (2100, 2600, TRACK)]
BEGIN = 1000  # the first release
OFFSET = 1_700_000_000_000_000_000  # of the wall clock


class ViewerCase(unittest.TestCase):
    format = ""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)

    def made(self, times=1):
        """The application of INSTANCES, which ran as often at the same moments."""
        path = os.path.join(self.folder.name, "made")
        return path, json.loads(output_of(MAKE_EXPORT, self.format, path, str(times)))

    def exported(self, name, *options):
        path = os.path.join(self.folder.name, name)
        output_of(CIE, "export", os.path.join(EXAMPLES, name, "trace"), "--to", self.format, "-o", path, *options)
        return path


class NodeReaderCase(ViewerCase):
    """Of a format that `reader`, a script for Node.js, reads with `packages`: what npm_package.assets() takes, each."""
    packages = []
    reader = ""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.modules = npm_package.modules(cls.packages, os.path.join(cls.folder.name, "node_modules"))

    @classmethod
    def requirement(cls):
        for package in cls.packages:
            npm_package.assets(*package)

    def read_by_node(self, path):
        """What the reader prints of the file: JSON."""
        script = os.path.join(os.path.dirname(os.path.abspath(__file__)), self.reader)
        result = subprocess.run(["node", script, path], env={**os.environ, "NODE_PATH": self.modules}, timeout=200,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False)
        self.assertEqual(result.returncode, 0, result.stderr.decode())
        return json.loads(result.stdout)


def truth_of(name):
    return Truth(os.path.join(EXAMPLES, name))


def main(case, requirement):
    """`requirement()` fetches what the test needs."""
    try:
        requirement()
    except Unavailable as error:
        print(f"not possible here: {error}")
        sys.exit(77)
    except unittest.SkipTest as error:
        print(error)
        sys.exit(77)
    result = unittest.TextTestRunner().run(unittest.defaultTestLoader.loadTestsFromTestCase(case))
    sys.exit(0 if result.wasSuccessful() and result.testsRun else 1)
