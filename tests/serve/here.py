#!/usr/bin/env python3
"""here.py PAGE OUT CHROMIUM: the page of `make wasm` from its folder, without any server, in a real browser
without a window: scenes run, the mouse pulls a body, sliders move, another model and another law are chosen.
Pictures go to the folder OUT."""
import json
import os
import pathlib
import sys

from browser import BOX, Browser

RUNS = "typeof world !== 'undefined' && world.bodies.size > 0 && world.frame > 3 && state.time > 0.02"


def choose(browser, name, value):
    browser.value(f"(s => {{ s.value = {json.dumps(value)}; s.onchange(); }})"
                  f"(document.getElementById({json.dumps(name)}))")
    browser.wait(RUNS, f"{name} {value} runs", 60)
    assert browser.value("state.message") == "", browser.value("state.message")


def walk(browser, out):
    picture = lambda name: browser.picture(os.path.join(out, name))
    browser.wait(RUNS, "the first scene runs", 120)
    assert browser.value("Object.keys(deform.scenes).length") > 30
    choose(browser, "scene", "slope_block")
    box = browser.value(BOX)
    middle = ((box[0] + box[2]) / 2, (box[1] + box[3]) / 2)
    browser.drag(middle, (middle[0] + 120, middle[1] - 60), 0.5)
    browser.wait("state.pull && state.pull.force > 0", "the body is pulled")
    picture("here_pulled.png")
    browser.mouse("mouseReleased", middle[0] + 120, middle[1] - 60)
    browser.wait("!state.pull", "the body is let go")
    for name in ("mu:*:*", "young:block"):
        value = browser.value(f"state.sliders.find(s => s.name === '{name}').value")
        browser.value("(r => { const i = r.children[1]; i.value = +i.max; i.oninput(); })"
                      "(document.getElementById('slider %s'))" % name)
        browser.wait(f"state.sliders.find(s => s.name === '{name}').value > {value}", f"{name} moves")
    choose(browser, "model", "corotational_fem")
    choose(browser, "law", "lugre")
    assert browser.value("location.hash") == "#scene=slope_block&model=corotational_fem&law=lugre"
    # recorded from the whole scene on, as by a server
    browser.click("record")
    browser.wait("tape && tape.length > 5", "it records")
    assert browser.value("new DataView(tape[0]).getUint8(5) === 0"), "the tape begins with the scene"
    choose(browser, "model", "")
    choose(browser, "scene", "cheese")
    picture("here_cheese.png")


def main():
    page, out, chromium = sys.argv[1:4]
    os.makedirs(out, exist_ok=True)
    browser = Browser(chromium, pathlib.Path(page).resolve().as_uri(), (1000, 700))
    try:
        walk(browser, out)
    finally:
        browser.close()
    print("the page runs scenes by itself")


if __name__ == "__main__":
    main()
