#!/usr/bin/env python3
"""browser.py SERVE SCENE OUT [CHROMIUM]: `deform serve` in a real browser without a window. The mouse pulls a
body, a slider moves, a stroke cuts, buttons pause, step and reset; what the page then has is asked of it, and
pictures go to the folder OUT."""
import base64
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "..", "examples"))
from stream_receiver import Connection, Scene  # noqa: E402


class Browser:
    """Headless Chromium by its DevTools protocol."""

    def __init__(self, program, url, size):
        self.folder = tempfile.mkdtemp()
        self.process = subprocess.Popen(
            [program, "--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader",
             "--enable-unsafe-swiftshader", "--remote-debugging-port=0", "--remote-allow-origins=*",
             f"--user-data-dir={self.folder}", f"--window-size={size[0]},{size[1]}", "about:blank"],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True)
        port = None
        for line in self.process.stderr:
            found = re.search(r"DevTools listening on ws://127\.0\.0\.1:(\d+)/", line)
            if found:
                port = found.group(1)
                break
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json") as pages:
            page = next(p for p in json.load(pages) if p["type"] == "page")
        self.socket, self.number = Connection(page["webSocketDebuggerUrl"], 60, protocol=None), 0
        self.call("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1,
                  mobile=False)
        self.call("Page.navigate", url=url)

    def call(self, method, **params):
        self.number += 1
        self.socket.send({"id": self.number, "method": method, "params": params})
        while True:
            answer = json.loads(self.socket.receive())
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]

    def value(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        if "exceptionDetails" in result:
            raise RuntimeError(f"{expression}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def wait(self, expression, what, seconds=30):
        end = time.time() + seconds
        while time.time() < end:
            if self.value(expression):
                return
            time.sleep(0.05)
        state = self.value("JSON.stringify(state)")
        raise AssertionError(f"{what}: not within {seconds} s ({expression}); {state}")

    def mouse(self, kind, x, y, button="left"):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, clickCount=1,
                  buttons=0 if kind == "mouseReleased" else 1)

    def click(self, name):
        x, y = self.value(f"(r => [r.x + r.width / 2, r.y + r.height / 2])"
                          f"(document.getElementById({json.dumps(name)}).getBoundingClientRect())")
        self.mouse("mousePressed", x, y)
        self.mouse("mouseReleased", x, y)

    def drag(self, begin, end, hold=0.0):
        self.mouse("mousePressed", *begin)
        for i in range(1, 11):
            self.mouse("mouseMoved", *(a + (b - a) * i / 10 for a, b in zip(begin, end)))
            time.sleep(0.02)
        time.sleep(hold)

    def picture(self, path):
        data = self.call("Page.captureScreenshot", format="png")["data"]
        with open(path, "wb") as out:
            out.write(base64.b64decode(data))

    def close(self):
        self.socket.close()
        # Debian's command is a script, whose child is the browser
        os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()
        self.process.stderr.close()
        shutil.rmtree(self.folder, ignore_errors=True)


# Where the first body is in the page: left, top, right, bottom, in pixels.
BOX = """(() => { const b = bodies()[0], a = axes(), h = canvas.clientHeight / 2;
  const q = [1e9, 1e9, -1e9, -1e9];
  for (let i = 0; i < b.x.length / 3; i++) {
    const p = sub(point(b.x, i), a.eye), d = -dot(p, a.back) * camera.tan;
    const x = canvas.clientWidth / 2 + h * dot(p, a.right) / d, y = h - h * dot(p, a.top) / d;
    q[0] = Math.min(q[0], x); q[1] = Math.min(q[1], y); q[2] = Math.max(q[2], x); q[3] = Math.max(q[3], y);
  }
  return q; })()"""


def walk(browser, out):
    picture = lambda name: browser.picture(os.path.join(out, name))
    browser.wait("typeof world !== 'undefined' && bodies().length > 0 && world.frame > 3", "the scene")
    browser.wait("state.control === me", "this page is in control")
    picture("begin.png")
    browser.click("run")
    browser.wait("state.running === true", "Run runs")
    browser.wait("state.time > 0.05", "time goes on")
    # the middle of what is seen of the body: it is pulled aside, and follows
    box = browser.value(BOX)
    middle = ((box[0] + box[2]) / 2, (box[1] + box[3]) / 2)
    before = browser.value("bodies()[0].x.reduce((a, c) => a + c, 0)")
    browser.drag(middle, (middle[0] + 120, middle[1] - 60), 0.5)
    browser.wait("state.pull && state.pull.force > 0", "the body is pulled")
    picture("pulled.png")
    browser.mouse("mouseReleased", middle[0] + 120, middle[1] - 60)
    browser.wait("!state.pull", "the body is let go")
    after = browser.value("bodies()[0].x.reduce((a, c) => a + c, 0)")
    assert before != after
    # a slider, by the keyboard as a user would: one step up
    name = browser.value("state.sliders[0].name")
    value = browser.value("state.sliders[0].value")
    browser.value("(r => { const i = r.children[1]; i.value = +i.max; i.oninput(); })"
                  "(document.getElementById('slider ' + %s))" % json.dumps(name))
    browser.wait(f"state.sliders[0].value > {value}", "the slider has moved")
    browser.click("arrows")
    browser.click("run")
    browser.wait("state.running === false", "Pause pauses")
    time.sleep(0.2)
    at = browser.value("state.time")
    browser.click("step")
    browser.wait(f"state.time > {at}", "Step steps")
    picture("arrows.png")
    # a stroke across the body cuts it
    browser.click("cut")
    triangles = browser.value("bodies()[0].triangles.length")
    box = browser.value(BOX)
    x = (box[0] + box[2]) / 2
    browser.drag((x, box[1] - 30), (x + 4, (box[1] + box[3]) / 2))
    browser.mouse("mouseReleased", x + 4, (box[1] + box[3]) / 2)
    browser.wait(f"bodies()[0].triangles.length > {triangles}", "the stroke has cut")
    browser.click("cut")
    browser.click("run")
    browser.wait(f"state.time > {at} + 0.3", "it runs on")
    browser.drag((x + 60, (box[1] + box[3]) / 2), (x + 120, (box[1] + box[3]) / 2))
    browser.wait("state.pull && state.pull.force > 0", "what is cut is pulled")
    browser.mouse("mouseReleased", x + 120, (box[1] + box[3]) / 2)
    picture("cut.png")
    browser.click("reset")
    browser.wait("state.time < 0.2", "Reset goes back")
    browser.wait(f"bodies()[0].triangles.length === {triangles}", "the cut is undone")
    assert browser.value("state.message") == "", browser.value("state.message")
    # a wrong file leaves the connection as it is, with a sentence
    browser.value("""(data => { data.items.add(new File(["no recording"], "notes.txt"));
      $("file").files = data.files; $("file").onchange(); })(new DataTransfer())""")
    browser.wait("trouble.startsWith('notes.txt is no recording')", "a file that is none")
    frame = browser.value("world.frame")
    browser.wait(f"world.frame > {frame} + 3 && $('message').textContent === trouble", "the connection stays")
    # the run is recorded from the whole scene on, and downloaded
    path = os.path.join(out, "run.dfms")
    if os.path.exists(path):
        os.remove(path)
    browser.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=os.path.abspath(out))
    browser.click("record")
    browser.wait("tape && tape.length > 5", "it records")
    browser.click("record")
    end = time.time() + 20
    while not os.path.exists(path) and time.time() < end:
        time.sleep(0.05)
    scene = Scene()
    with open(path, "rb") as file:
        scene.read(file.read())
    assert [body.missing for body in scene.bodies.values()] == [0] and scene.present
    assert len(scene.bodies.popitem()[1].triangles) == triangles


def main():
    serve, scene, out = sys.argv[1:4]
    chromium = sys.argv[4] if len(sys.argv) > 4 else "chromium-headless-shell"
    os.makedirs(out, exist_ok=True)
    with subprocess.Popen([serve, "serve", scene, "--paused", "--seconds", "120"], stdout=subprocess.PIPE,
                          text=True) as served:
        try:
            browser = Browser(chromium, served.stdout.readline().strip(), (1000, 700))
            try:
                walk(browser, out)
            finally:
                browser.close()
        finally:
            served.terminate()
            served.wait()
    print("the page does what it shows")


if __name__ == "__main__":
    main()
