#!/usr/bin/env python3
"""film.py OUT CHROMIUM: what a notebook shows of a film, in a real browser without a window: it plays, goes
to a frame and back over a cut, and has the colors of its values. Pictures go to the folder OUT."""
import os
import pathlib
import sys

from browser import Browser

import deform
from deform import webgl


def main():
    out, chromium = pathlib.Path(sys.argv[1]), sys.argv[2]
    out.mkdir(parents=True, exist_ok=True)
    with deform.World() as world:
        world.add_obstacle("plane")
        world.add_obstacle("box", half_size=(0.05, 0.05, 0.05), position=(0.3, 0, 0.05))
        body = world.add_body(deform.TetMesh.beam((0.3, 0.1, 0.1), 600), name="beam",
                              position=(-0.15, 0, 0.05), material={"young": 2e4})
        film = world.film(color="speed")
        for i in range(30):
            if i == 15:
                body.cut("plane", point=(0, 0, 0), normal=(1, 0, 0))
                world.add_obstacle("sphere", radius=0.05, position=(-0.3, 0, 0.05))
            world.run(0.01, dt=1e-3)
            film.add()
    page = out / "film.html"
    page.write_text(webgl.document(film), encoding="utf-8")
    browser = Browser(chromium, page.resolve().as_uri(), (700, 500))
    try:
        faces = "world.meshes.get(1).triangles.length"
        browser.wait("typeof world !== 'undefined' && world.frame === 0", "a frame")
        assert browser.value("things().length") == 2
        before = browser.value(faces)
        browser.click("play")
        browser.wait("world.frame === 30", "it plays to its end")
        assert browser.value(faces) > before, "the cut"
        browser.value("run(false)")
        for frame, more in ((30, True), (3, False), (20, True)):
            browser.value(f"(s => {{ s.value = {frame}; s.oninput(); }})($('at'))")
            browser.wait(f"world.frame === {frame}", "the slider moves")
            assert (browser.value(faces) > before) == more
            assert browser.value("things().length") == 2 + more
            assert browser.value("world.meshes.get(1).x.every(Number.isFinite)")
            browser.picture(str(out / f"film_{frame}.png"))
        assert "speed, m/s" in browser.value("$('legend').textContent")
    finally:
        browser.close()
    print("a film plays by itself")


if __name__ == "__main__":
    main()
