"""A headless Chromium that draws in software, driven through a pipe by its DevTools protocol."""
import base64
import json
import os
import select
import shutil
import signal
import struct
import subprocess
import tempfile
import time
import zlib

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")


def find_program():
    return next((path for path in map(shutil.which, PROGRAMS) if path), None)


class Picture:
    """Rows of red, green and blue bytes from a PNG of eight bits a channel."""

    def __init__(self, png):
        at, data = 8, b""
        while at < len(png):
            length, kind = struct.unpack(">I4s", png[at:at + 8])
            body = png[at + 8:at + 8 + length]
            if kind == b"IHDR":
                self.width, self.height, depth, colours = struct.unpack(">IIBB", body[:10])
                assert depth == 8 and colours in (2, 6), "not an RGB picture of eight bits"
                step = 3 if colours == 2 else 4
            elif kind == b"IDAT":
                data += body
            at += 12 + length
        data = zlib.decompress(data)
        row = bytes(self.width * step)
        self.rows = []
        for y in range(self.height):
            start = y * (len(row) + 1)
            row = self._unfilter(data[start], data[start + 1:start + 1 + len(row)], row, step)
            self.rows.append(row if step == 3 else bytes(b for k, b in enumerate(row) if k % 4 != 3))

    @staticmethod
    def _unfilter(kind, line, above, step):
        line = bytearray(line)
        for i in range(len(line)):
            left = line[i - step] if i >= step else 0
            up = above[i]
            corner = above[i - step] if i >= step else 0
            if kind == 1:
                line[i] = (line[i] + left) & 255
            elif kind == 2:
                line[i] = (line[i] + up) & 255
            elif kind == 3:
                line[i] = (line[i] + (left + up) // 2) & 255
            elif kind == 4:
                guess = left + up - corner
                nearest = min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))
                line[i] = (line[i] + nearest[2]) & 255
        return bytes(line)

    def pixels(self):
        for row in self.rows:
            yield from zip(row[0::3], row[1::3], row[2::3])


class Browser:
    def __init__(self, program):
        self.folder = tempfile.mkdtemp(prefix="bisector-browser-")
        to_read, self.write_end = os.pipe()
        self.read_end, to_write = os.pipe()
        # The protocol's pipe is at the descriptors 3 and 4.
        command = ["bash", "-c", f'exec "$@" 3<&{to_read} 4>&{to_write}', "bash", program, "--headless=new",
                   "--remote-debugging-pipe", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
                   "--disable-dev-shm-usage", "--no-first-run", "--disable-background-networking",
                   "--force-color-profile=srgb", f"--user-data-dir={self.folder}", "about:blank"]
        self.process = subprocess.Popen(command, pass_fds=(to_read, to_write), start_new_session=True,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_read)
        os.close(to_write)
        self.next_id = 0
        self.rest = b""
        self.events = []
        target = self.call("Target.createTarget", url="about:blank", session=None)["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True, session=None)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def close(self):
        try:
            self.call("Browser.close", session=None)
            self.process.wait(10)
        except (OSError, RuntimeError, subprocess.TimeoutExpired):
            pass
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
        for _ in range(20):  # its children write a while longer
            shutil.rmtree(self.folder, ignore_errors=True)
            if not os.path.exists(self.folder):
                break
            time.sleep(0.1)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _message(self, until):
        while b"\0" not in self.rest:
            if not select.select([self.read_end], [], [], max(0, until - time.monotonic()))[0]:
                raise RuntimeError("the browser does not answer")
            read = os.read(self.read_end, 1 << 20)
            if not read:
                raise RuntimeError("the browser has ended")
            self.rest += read
        text, self.rest = self.rest.split(b"\0", 1)
        return json.loads(text)

    def call(self, method, session="", **parameters):
        self.next_id += 1
        message = {"id": self.next_id, "method": method, "params": parameters}
        if session is not None:
            message["sessionId"] = self.session
        os.write(self.write_end, json.dumps(message).encode() + b"\0")
        until = time.monotonic() + 60
        while True:
            answer = self._message(until)
            if answer.get("id") == self.next_id:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]
            self.events.append(answer)

    def evaluate(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in result:
            raise RuntimeError(result["exceptionDetails"].get("exception", {}).get("description", expression))
        return result["result"].get("value")

    def wait(self, expression, seconds=30):
        until = time.monotonic() + seconds
        while not self.evaluate(expression):
            if time.monotonic() > until:
                raise RuntimeError(f"after {seconds} s still not: {expression}")
            time.sleep(0.02)

    def open(self, path, width=800, height=560, dark=False):
        """Opens a page; returns the seconds until its first picture."""
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self.call("Emulation.setEmulatedMedia", features=[
            {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])
        self.call("Emulation.setScrollbarsHidden", hidden=True)
        self.events.clear()
        start = time.monotonic()
        self.call("Page.navigate", url="file://" + os.path.abspath(path))
        self.wait("(e => e?.dataset.state === 'failed' || (e?.dataset.state === 'ready' && (!!e.querySelector('#look[hidden]')"
                  " || !!e.querySelector('#views[data-drawn], #views[hidden]'))))(document.documentElement)")
        seconds = time.monotonic() - start
        self.settle()
        return seconds

    def settle(self):
        """Waits until what was asked for is drawn."""
        self.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => "
                      "requestAnimationFrame(() => setTimeout(done, 0)))))")

    def box(self, selector):
        return self.evaluate(f"(() => {{ const b = document.querySelector({json.dumps(selector)})"
                             ".getBoundingClientRect(); return [b.x + scrollX, b.y + scrollY, b.width, b.height]; })()")

    def screenshot(self, selector=None, whole=False):
        clip = {}
        if selector:
            x, y, width, height = self.box(selector)
            clip = {"clip": {"x": x, "y": y, "width": width, "height": height, "scale": 1}}
        elif whole:
            size = self.call("Page.getLayoutMetrics")["cssContentSize"]
            clip = {"clip": {"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1}}
        shot = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole, **clip)
        return base64.b64decode(shot["data"])

    def mouse(self, *events):
        for kind, x, y in events:
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1,
                      buttons=0 if kind == "mouseReleased" else 1)

    def press(self, key, code, modifiers=0):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=code, modifiers=modifiers)

    def problems(self):
        """Errors of scripts and of the policy, and requests beyond the page itself."""
        found = []
        for event in self.events:
            method, values = event.get("method"), event.get("params", {})
            if method == "Network.requestWillBeSent":
                url = values["request"]["url"]
                if values.get("type") != "Document" and not url.startswith(("data:", "blob:")):
                    found.append("request " + url)
            elif method == "Runtime.exceptionThrown":
                found.append("exception " + json.dumps(values)[:300])
            elif method == "Log.entryAdded" and values["entry"]["level"] == "error":
                found.append("log " + values["entry"]["text"])
            elif method == "Runtime.consoleAPICalled" and values["type"] in ("error", "assert"):
                found.append("console " + json.dumps(values["args"])[:300])
        return found
