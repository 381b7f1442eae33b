"""The common parts of tests and measurements of pages: programs, a fleet, a browser.

The first argument is the folder with coordinator, worker and swarmctl. Without Chromium and its
driver the script prints a line and ends. SWARM_SCREENSHOTS=DIR also takes pictures of pages there.
"""

import json
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import unittest

PROGRAMS = pathlib.Path(sys.argv.pop(1) if len(sys.argv) > 1 else "target/debug").resolve()
CONFIG = pathlib.Path(__file__).parents[3] / "configs/quickstart.json"
CLIENT_TOKEN = "client-token-0123456789abcdef0123"
WORKER_TOKEN = "worker-token-0123456789abcdef0123"
CHROMIUM = shutil.which("chromium")
DRIVER = shutil.which("chromedriver")

if not (CHROMIUM and DRIVER):
    print(
        "SKIPPED, but can be installed: no Chromium, so that pages are not tested; "
        "apt-get install chromium chromium-driver"
    )
    sys.exit(0)

from axe_core_python.selenium import Axe
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.support.wait import WebDriverWait

# A time limit that only a hanging page exceeds.
DEADLINE = 300
# A phone's, pixels.
NARROW = 390


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


def swarmctl(*args):
    return subprocess.run([PROGRAMS / "swarmctl", *map(str, args)], text=True, capture_output=True)


def with_simulator(*args):
    """The output of a command that makes a page with the simulator for browsers."""
    made = swarmctl(*args)
    if "without the simulator" in made.stderr:
        print("SKIPPED: the programs have no simulator for browsers; dist/build simulator makes it")
        sys.exit(0)
    assert made.returncode == 0, made.stderr
    return made.stdout.strip()


class Fleet:
    """A coordinator with pages; workers when a test starts them."""

    def __init__(self, *args, environment=None):
        self.directory = tempfile.TemporaryDirectory()
        self.ports = free_port(), free_port()
        self.args = args
        self.environment = dict(os.environ, **(environment or {}))
        self.processes = []
        self.start_coordinator()

    def start_coordinator(self):
        listen, pages = (f"127.0.0.1:{port}" for port in self.ports)
        command = ["coordinator", "--listen", listen, "--web-listen", pages]
        self.coordinator = self.start(*command, "--data-dir", self.directory.name, *self.args)
        # An earlier line says that the coordinator listens for clients.
        for line in self.coordinator.stderr:
            if "pages are served" in line:
                # Somebody must read the pipe: a program that writes into a full one waits.
                threading.Thread(target=self.coordinator.stderr.read, daemon=True).start()
                return
        raise AssertionError("the coordinator does not start")

    def start_worker(self, name="w"):
        return self.start("worker", "--coordinator", self.url, "--name", name, "--slots", "1")

    def start(self, program, *args):
        stderr = subprocess.PIPE if program == "coordinator" else subprocess.DEVNULL
        process = subprocess.Popen(
            [PROGRAMS / program, *args], env=self.environment, stderr=stderr, text=True
        )
        self.processes.append(process)
        return process

    @property
    def url(self):
        return f"http://127.0.0.1:{self.ports[0]}"

    @property
    def pages(self):
        return f"http://127.0.0.1:{self.ports[1]}"

    def swarmctl(self, *args):
        command = [PROGRAMS / "swarmctl", "--coordinator", self.url, "--output", "json", *args]
        return subprocess.run(command, check=True, text=True, capture_output=True).stdout

    def stop(self):
        for process in self.processes:
            process.kill()
            process.wait()
        self.directory.cleanup()


class BrowserTest(unittest.TestCase):
    """A separate browser for each test, whose console and requests are checked."""

    is_dark = False
    # Errors that a test provokes on purpose, such as a refused login.
    expected_complaints = ()

    @classmethod
    def start_fleet(cls, generations=0):
        """A fleet for all tests of the class, with some generations of the quickstart."""
        cls.fleet = Fleet()
        cls.addClassCleanup(cls.fleet.stop)
        if generations:
            cls.fleet.start_worker()
            cls.fleet.swarmctl("submit", str(CONFIG), "--generations", str(generations), "--watch")

    def setUp(self):
        options = webdriver.ChromeOptions()
        options.binary_location = CHROMIUM
        for argument in ["--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1400,1000"]:
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(DRIVER))
        self.addCleanup(self.browser.quit)
        self.prefer("dark" if self.is_dark else "light")

    def tearDown(self):
        complaints = [
            entry["message"]
            for entry in self.browser.get_log("browser")
            if entry["level"] in ("SEVERE", "WARNING")
            and not any(part in entry["message"] for part in self.expected_complaints)
        ]
        self.assertEqual(complaints, [], "the console has errors")
        for entry in self.browser.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                url = message["params"]["request"]["url"]
                is_ours = url.startswith(("http://127.0.0.1:", "https://127.0.0.1:", "file://", "data:", "blob:", "chrome:"))
                self.assertTrue(is_ours, f"a request to another host: {url}")

    def prefer(self, scheme):
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})

    def narrow(self):
        size = {"width": NARROW, "height": 844, "deviceScaleFactor": 1, "mobile": True}
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)

    def assert_accessible(self, what):
        """The page with everything open keeps the rules of accessibility."""
        self.browser.set_script_timeout(DEADLINE)
        self.script("document.querySelectorAll('details').forEach((it) => (it.open = true))")
        found = [(it["id"], [node["target"] for node in it["nodes"]]) for it in Axe().run(self.browser)["violations"]]
        self.assertEqual(found, [], what)

    def width(self):
        """The width of the whole page: a phone shrinks a page that is too wide, and so widens its
        window."""
        return self.script("return document.documentElement.scrollWidth")

    def wait(self, condition, what):
        return WebDriverWait(self.browser, DEADLINE, 0.05).until(lambda _: condition(), what)

    def find(self, selector):
        return self.wait(
            lambda: next(iter(self.browser.find_elements(By.CSS_SELECTOR, selector)), None),
            f"no {selector}",
        )

    def text(self, selector):
        """The visible text of an element that the page may replace at any moment."""
        self.find(selector)
        return self.script(f"const it = document.querySelector({selector!r}); return it?.innerText ?? it?.textContent ?? ''")

    def texts(self, selector):
        return self.script(f"return [...document.querySelectorAll('{selector}')].map((it) => it.textContent)")

    def wait_for_text(self, selector, part):
        self.wait(lambda: part in self.script(f"return document.querySelector({selector!r})?.textContent ?? ''"), f"{selector} never says {part!r}")

    def script(self, text):
        return self.browser.execute_script(text)

    def hold(self, part):
        """Holds answers of the server back, to requests whose address has this part, until `release`."""
        self.browser.execute_script("""
            const [part] = arguments;
            const held = new Promise((go) => (window.goOn = go));
            const ask = window.fetch;
            window.nHeld = window.nTaken = 0;
            window.fetch = async (address, ...more) => {
                const answer = await ask(address, ...more);
                if (String(address).includes(part)) {
                    window.nHeld += 1;
                    await held;
                    for (const read of ["json", "arrayBuffer"]) {
                        // After a task of its own, the page has done what follows the reading.
                        answer[read] = () => Response.prototype[read].call(answer)
                            .finally(() => setTimeout(() => (window.nTaken += 1)));
                    }
                }
                return answer;
            };
        """, part)

    def release(self):
        """Lets the held answers go, and waits until the page has taken them."""
        self.wait(lambda: self.script("return window.nHeld > 0"), "no answer is held back")
        self.script("window.goOn()")
        self.wait(lambda: self.script("return window.nTaken === window.nHeld"), "an answer is not read")

    def complete_before_an_answer(self, part, file=CONFIG, prepare=lambda: None):
        """A run that completes while the answers to requests whose address has this part are held back."""
        fleet = Fleet()
        self.addCleanup(fleet.stop)
        fleet.swarmctl("submit", str(file), "--generations", "40")
        self.browser.get(fleet.pages + "/experiment/1")
        self.wait_for_text(".standing", "Before the first generation")
        self.hold(part)
        prepare()
        fleet.start_worker()
        self.wait_for_text(".state", "completed")
        self.release()

    def refuse(self, part, error):
        """Refuses all requests whose address has this part with an error."""
        self.browser.execute_script("""
            const [part, error] = arguments;
            const ask = (window.answered ??= window.fetch);
            const refusal = () => Promise.resolve(new Response(JSON.stringify({ error }), { status: 400 }));
            window.fetch = (address, ...more) => (String(address).includes(part) ? refusal() : ask(address, ...more));
        """, part, error)

    def saved(self, selector):
        """The file that a button saves."""
        return self.browser.execute_async_script("""
            const [selector, done] = arguments;
            const make = URL.createObjectURL;
            URL.createObjectURL = (blob) => (blob.text().then(done), make(blob));
            HTMLAnchorElement.prototype.click = () => {};
            document.querySelector(selector).click();
        """, selector)

    def picture(self, name):
        directory = os.environ.get("SWARM_SCREENSHOTS")
        if directory:
            self.browser.save_screenshot(str(pathlib.Path(directory) / f"{name}.png"))
