"""Proofs of bundles in a real browser, from a server and from files; called like `browser.py`.

Skips if the programs were compiled without the simulator for browsers.
"""

import hashlib
import pathlib
import tempfile
import unittest
import zipfile

from harness import CONFIG, NARROW, BrowserTest, swarmctl, with_simulator

from selenium.webdriver.common.by import By

BUNDLES = pathlib.Path(__file__).parents[3] / "results/bundles"
QUICKSTART = "c11a2917b82381af1a41371a42c3911ac5021fcc9648ee67041e4e9f52290003"


class Proofs(BrowserTest):
    @classmethod
    def setUpClass(cls):
        directory = tempfile.TemporaryDirectory()
        cls.addClassCleanup(directory.cleanup)
        cls.directory = pathlib.Path(directory.name)
        cls.bundle = cls.directory / "quickstart.zip"
        data = cls.directory / "data"
        for command in (
            ["run", CONFIG, "--data-dir", data],
            ["export", "1", "--to", cls.bundle, "--data-dir", data],
        ):
            done = swarmctl(*command)
            assert done.returncode == 0, done.stderr
        cls.page = cls.directory / "quickstart.html"
        proof = with_simulator("verify", cls.bundle, "--page", cls.page)
        # A browser does not know the folder of a file.
        cls.proof = proof.removeprefix(f"{cls.directory}/")
        cls.start_fleet()

    def choose(self, path):
        self.find("#file").send_keys(str(path))

    def finish(self):
        self.wait(lambda: self.script("return document.querySelector('#proof').textContent"), "no result")
        return self.text("#proof")

    def lines(self):
        """The proof, as the command prints it."""
        head = self.text("#proof .digest")
        rows = self.script("return [...document.querySelectorAll('.proof li')].map((row) => [...row.children].map((part) => part.textContent))")
        return "\n".join([head, *(f"{kind:<10}{text}" for kind, text in rows)])

    def test_a_file_proves_itself_with_the_words_of_the_command(self):
        for width, name in [(NARROW, "narrow"), (1280, "middle"), (2560, "wide")]:
            self.browser.set_window_size(width, 1000)
            if width == NARROW:
                self.narrow()
            self.browser.get(self.page.as_uri())
            self.find("#start").click()
            self.finish()
            self.assertEqual(self.lines(), self.proof)
            self.assertIn(QUICKSTART, self.text("#proof"))
            if width == NARROW:
                self.assertLessEqual(self.width(), NARROW)
            self.picture(f"proof-{name}")
            self.browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        self.browser.execute_cdp_cmd("Browser.grantPermissions", {"permissions": ["clipboardReadWrite", "clipboardSanitizedWrite"]})
        self.find("#copy").click()
        self.wait_for_text("#proof .row", "copied")

    def test_a_server_offers_the_same_page(self):
        self.browser.get(self.fleet.pages + "/verify")
        self.picture("proof-before")
        self.choose(self.bundle)
        self.finish()
        self.assertEqual(self.lines(), self.proof)
        self.assertEqual(self.text("nav [aria-current]"), "Verify")

    def test_bundles_of_results_are_proven(self):
        bundle = BUNDLES / "transport-0.zip"
        self.browser.get(self.fleet.pages + "/verify")
        self.choose(bundle)
        self.finish()
        self.assertEqual(self.lines().splitlines()[1:], swarmctl("verify", bundle).stdout.splitlines()[1:])

    def test_a_changed_bundle_is_refused_with_the_flaw_that_the_command_names(self):
        changed = self.directory / "changed.zip"
        with zipfile.ZipFile(self.bundle) as source, zipfile.ZipFile(changed, "w", zipfile.ZIP_DEFLATED) as target:
            contents = {name: source.read(name) for name in source.namelist()}
            true = contents["history.csv"]
            history = true.decode().splitlines()
            cells = history[7].split(",")
            cells[1] = "0.75"
            history[7] = ",".join(cells)
            contents["history.csv"] = ("\n".join(history) + "\n").encode()
            # A liar also states the digest of the changed file.
            digests = [hashlib.sha256(it).hexdigest().encode() for it in (true, contents["history.csv"])]
            for name, content in contents.items():
                content = content.replace(*digests)
                target.writestr(name, content)
        refused = swarmctl("verify", changed)
        flaw = refused.stderr.split("changed.zip: ", 1)[1].splitlines()[0]
        self.assertEqual((refused.returncode, flaw.split(":")[0]), (12, "history"), refused.stderr)
        self.browser.get(self.page.as_uri())
        self.choose(changed)
        found = self.finish()
        self.assertIn("not proven", found)
        self.assertIn(flaw, found)
        self.picture("proof-refused")
        # Nothing of the refused bundle remains.
        self.find("#start").click()
        self.wait(lambda: self.browser.find_elements(By.CSS_SELECTOR, ".proof li"), "no proof")
        self.assertEqual(self.lines(), self.proof)

    def test_files_of_other_kinds_are_refused(self):
        other = self.directory / "notes.zip"
        other.write_text("no archive")
        self.browser.get(self.page.as_uri())
        self.choose(other)
        self.assertIn("it is not a bundle", self.finish())

    def test_a_file_that_is_read_late_replaces_no_later_choice(self):
        other = self.directory / "late.zip"
        other.write_text("no archive")
        self.browser.get(self.page.as_uri())
        self.browser.set_script_timeout(20)
        self.script("""
            const read = File.prototype.arrayBuffer;
            File.prototype.arrayBuffer = function () {
                return new Promise((done) => (window.goOn = () => done(read.call(this))));
            };
        """)
        self.choose(other)
        self.wait(lambda: self.script("return Boolean(window.goOn)"), "nobody reads the file")
        self.find("#start").click()
        self.finish()
        self.browser.execute_async_script("window.goOn(); setTimeout(arguments[0], 500);")
        self.assertEqual(self.lines(), self.proof)

    def test_a_proof_can_be_cancelled(self):
        self.browser.get(self.page.as_uri())
        self.script("document.querySelector('#sample').value = 'all'")
        self.find("#start").click()
        self.wait_for_text("#status", "generation")
        self.find("#cancel").click()
        self.wait_for_text("#status", "cancelled; nothing is proven")
        self.assertEqual(self.text("#proof"), "")
        self.assertFalse(self.find("#cancel").is_displayed())


if __name__ == "__main__":
    unittest.main()
