"""Every ```python block of a guide runs, one after the other, in a folder whose name has a space."""
import os
import pathlib
import re
import tempfile
import unittest

HOWTO = pathlib.Path(os.environ["DEFORM_SOURCE"]) / "libdeform" / "doc" / "howto"


def follow(guide):
    """Runs its blocks in the current folder; returns what they have made."""
    blocks = list(re.finditer(r"^```python\n(.*?)^```", guide.read_text(), re.M | re.S))
    names = {"__name__": "guide"}
    for block in blocks:
        line = guide.read_text().count("\n", 0, block.start(1))
        exec(compile("\n" * line + block.group(1), str(guide), "exec"), names)
    return names, [block.group(1) for block in blocks]


class Guides(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(suffix=" with space")
        self.addCleanup(folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(folder.name)

    def test_ten_lines(self):
        names, blocks = follow(HOWTO / "python.md")
        self.assertEqual(len(blocks[0].strip().splitlines()), 10)
        self.assertLess(abs(names["path"][-1] - names["path"][20]).max(), 1e-5)
        self.assertEqual(int((names["touching"]["flags"] & 1).sum()), len(names["touching"]))
        self.assertEqual((len(names["run"].frames), len(names["film"].frames)), (21, 61))
        self.assertIn("implicit_euler", str(names["table"]))
        for picture in ("ball.png", "end.png"):
            self.assertEqual(pathlib.Path(picture).read_bytes()[:4], b"\x89PNG")

    def test_cut(self):
        names, _ = follow(HOWTO / "cut.md")
        self.assertGreater(len(names["cuts"]), 5)
        self.assertGreaterEqual(names["done"].parts, 3)

    def test_law_in_python_then_in_c(self):
        names, _ = follow(HOWTO / "python-law.md")
        self.assertLess(abs(names["ours"]["ft"] - names["compiled"]["ft"]).max(), 1e-12)
        self.assertEqual(len(names["rules"]), 3)
        self.assertEqual(pathlib.Path("bristle.png").read_bytes()[:4], b"\x89PNG")


if __name__ == "__main__":
    unittest.main()
