#!/usr/bin/env python3
"""here.py PAGE OUT CHROMIUM: the page of `make wasm` from its folder, without any server, in a real browser
without a window: scenes run, the mouse pulls a body, sliders move, another model and another law are chosen.
Pictures go to the folder OUT."""
import json
import os
import pathlib
import shutil
import sys

from browser import BOX, Browser

RUNS = "typeof world !== 'undefined' && bodies().length > 0 && world.frame > 3 && state.time > 0.02"


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
    tape = browser.value("btoa(tape.map(b => Array.from(new Uint8Array(b), c => String.fromCharCode(c))"
                         ".join('')).join(''))")
    choose(browser, "model", "")
    choose(browser, "scene", "cheese")
    picture("here_cheese.png")
    rig(browser, out)
    return tape


def move(browser, name, share):
    """A slider to that share of its way."""
    browser.value("(i => { i.value = +i.min + %g * (i.max - i.min); i.oninput(); })"
                  "(document.getElementById('slider %s').children[1])" % (share, name))


def rig(browser, out):
    """A law alone: what the page plots is what `deform friction` says."""
    browser.value("(s => { s.value = 'friction_rig'; s.onchange(); })(document.getElementById('scene'))")
    browser.wait("state.rows && state.rows.length === 1001", "the rig runs", 60)
    force = "Math.max(...state.rows.map(row => row[state.columns.indexOf('F')]))"
    assert browser.value("state.law") == "org.deform.lugre" and browser.value("state.message") == ""
    level, before = browser.value("state.sliders.find(s => s.name === 'mu_C').value"), browser.value(force)
    assert abs(level * 9.8 - 1.47) < 1e-9 and 1.47 < before < 1.97, (level, before)
    browser.picture(os.path.join(out, "here_rig.png"))
    browser.value("send({do: 'slider', name: 'mu_C', value: 1e9})")
    browser.wait("$('message').textContent.includes('outside of its range')", "a value of no slider", 60)
    for name in ("mu_S", "mu_C"):
        move(browser, name, 1)
    browser.wait(f"{force} > 8", "more friction, more force", 60)
    for motion, rows in (("spring_pull", 1001), ("bias_sine_force", 1001)):
        browser.value("(s => { s.value = '%s'; s.onchange(); })(document.getElementById('motion'))" % motion)
        browser.wait(f"state.rows && state.rows.length === {rows} && {force} > 1", f"{motion} runs", 60)
        browser.picture(os.path.join(out, f"here_{motion}.png"))
    browser.value("(s => { s.value = 'gms'; s.onchange(); })(document.getElementById('law'))")
    browser.wait("state.law === 'org.deform.gms'", "another law runs", 60)


def recorded(browser, tape):
    """A recording in a page whose module has not come."""
    browser.value(f"""(() => {{ const bytes = Uint8Array.from(atob({json.dumps(tape)}), c => c.charCodeAt(0));
      const given = new DataTransfer(); given.items.add(new File([bytes], "run.dfms"));
      $("file").files = given.files; $("file").onchange(); }})()""")
    browser.wait("player && bodies().length > 0 && !state.time", "it plays without a module")


def main():
    page, out, chromium = sys.argv[1:4]
    os.makedirs(out, exist_ok=True)
    browser = Browser(chromium, pathlib.Path(page).resolve().as_uri(), (1000, 700))
    try:
        tape = walk(browser, out)
    finally:
        browser.close()
    alone = shutil.copy(page, os.path.join(out, "alone.html"))
    browser = Browser(chromium, pathlib.Path(alone).resolve().as_uri(), (1000, 700))
    try:
        recorded(browser, tape)
    finally:
        browser.close()
    print("the page runs scenes by itself")


if __name__ == "__main__":
    main()
