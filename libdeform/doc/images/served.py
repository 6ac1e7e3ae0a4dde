#!/usr/bin/env python3
"""served.py BIN: served.png, the page of `deform serve` with the shipped liver, by headless Chromium."""
import os
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.join(HERE, "..", "..", "..")
sys.path.insert(0, os.path.join(ROOT, "tests", "serve"))
from browser import Browser  # noqa: E402


def main():
    served = subprocess.Popen([os.path.join(sys.argv[1], "deform-serve"), "serve",
                               os.path.join(ROOT, "examples", "scenes", "liver.json")],
                              stdout=subprocess.PIPE, text=True)
    try:
        browser = Browser("chromium-headless-shell", served.stdout.readline().strip(), (1000, 640))
        try:
            browser.wait("typeof state !== 'undefined' && state.time > 0.9", "the scene runs", 120)
            browser.click("arrows")
            browser.click("run")
            time.sleep(1)
            browser.picture(os.path.join(HERE, "served.png"))
        finally:
            browser.close()
    finally:
        served.terminate()
        served.wait()


if __name__ == "__main__":
    main()
