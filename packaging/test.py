"""Tests of what is published: `python3 packaging/test.py`.

The archive is made of the tool that the variable GIP names, or else that of
`cargo build --release --features cli`.
"""

import hashlib
import json
import os
import re
import shutil
import subprocess
import tarfile
import tempfile
import tomllib
import unittest
from email.utils import parsedate_to_datetime
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
GIP = Path(os.environ.get("GIP", ROOT / "target" / "release" / "gip"))
REPOSITORY = "https://code.example/somebody/image-gip"
CONTACT = "Some Body <somebody@code.example>"
# Where only addresses work as links, and where links are followed in the repository that is named.
NO_REPOSITORY = ["bindings/python/README.md"]
REPOSITORY_KNOWN = ["README.md", "gpu/README.md", "bindings/wasm/README.md"]


def manifest(path: str, root: Path = ROOT) -> dict:
    return tomllib.loads((root / path).read_text())


class Owner(unittest.TestCase):
    """`set-owner`, in a copy of what it changes."""

    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)
        for name in (
            "Cargo.toml",
            "gpu/Cargo.toml",
            "bindings/python/Cargo.toml",
            "bindings/wasm/package.json",
            "packaging/debian/changelog",
            "packaging/set-owner",
        ):
            copy = self.root / name
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, copy)

    def set_owner(self, *words: str) -> int:
        command = [self.root / "packaging/set-owner", *words]
        return subprocess.run(command, stderr=subprocess.DEVNULL).returncode

    def test_all_that_is_published(self) -> None:
        for repository in ("https://old.example/a", f"{REPOSITORY}.git", f"{REPOSITORY}/"):
            self.assertEqual(self.set_owner(repository, CONTACT), 0)
            # It can be run again, to the same effect.
            once = {path: path.read_text() for path in self.root.rglob("*") if path.is_file()}
            self.assertEqual(self.set_owner(repository, CONTACT), 0)
            again = {path: path.read_text() for path in self.root.rglob("*") if path.is_file()}
            self.assertEqual(once, again)
            self.assertNotIn(".git.git", again[self.root / "bindings/wasm/package.json"])
        for path in ("Cargo.toml", "gpu/Cargo.toml", "bindings/python/Cargo.toml"):
            before, after = manifest(path), manifest(path, self.root)
            self.assertEqual(after["package"].pop("repository"), REPOSITORY, path)
            before["package"].pop("repository", None)
            if path == "Cargo.toml":
                self.assertEqual(after["package"]["metadata"]["deb"].pop("maintainer"), CONTACT)
                del before["package"]["metadata"]["deb"]["maintainer"]
            self.assertEqual(before, after, path)
        after = json.loads((self.root / "bindings/wasm/package.json").read_text())
        expected = {
            "type": "git",
            "url": f"git+{REPOSITORY}.git",
            "directory": "bindings/wasm",
        }
        self.assertEqual(after["repository"], expected)
        news = (self.root / "packaging/debian/changelog").read_text()
        self.assertIn(f"\n -- {CONTACT}  ", news)

    def test_what_is_refused(self) -> None:
        for repository, contact in [
            ("code.example", CONTACT),
            ('https://code.example/"', CONTACT),
            (REPOSITORY, "Some Body"),
            (REPOSITORY, "<somebody@code.example>"),
        ]:
            self.assertEqual(self.set_owner(repository, contact), 2)
        self.assertEqual(self.set_owner(REPOSITORY), 2)


class Notices(unittest.TestCase):
    """`notices`, of a program with one crate of somebody else."""

    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)
        self.write("Cargo.toml", '[package]\nname = "own"\n[dependencies]\nother = "1"\n')
        self.write("src/main.rs", "")
        self.write("vendor/other/src/lib.rs", "")
        self.write("vendor/other/.cargo-checksum.json", '{"files": {}}')
        self.write(
            "config.toml",
            f'[source.crates-io]\nreplace-with = "kept"\n[source.kept]\ndirectory = "{self.root}/vendor"\n',
        )

    def write(self, name: str, text: str) -> None:
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    def notices(self, licence: str) -> subprocess.CompletedProcess:
        package = f'[package]\nname = "other"\nversion = "1.2.3"\nauthors = ["Some Body"]\nlicense = "{licence}"\n'
        self.write("vendor/other/Cargo.toml", package)
        command = [
            *(ROOT / "packaging/notices", self.root / "out", "--offline"),
            *("--config", self.root / "config.toml", "--manifest-path", self.root / "Cargo.toml"),
        ]
        return subprocess.run(command, capture_output=True, text=True)

    def test_licences_of_the_crate(self) -> None:
        self.write("vendor/other/LICENSE-APACHE", "the one that is not chosen")
        self.write("vendor/other/LICENSE-MIT", "the one that is")
        self.write("vendor/other/NOTICE", "what they demand")
        self.assertEqual(self.notices("MIT OR Apache-2.0").returncode, 0)
        told = (self.root / "out").read_text()
        self.assertIn("other 1.2.3\n\nthe one that is\n", told)
        self.assertIn("what they demand", told)
        self.assertNotIn("not chosen", told)
        self.assertNotIn("own 0", told)

    def test_without_a_text(self) -> None:
        self.assertEqual(self.notices("Apache-2.0/MIT").returncode, 0)
        told = (self.root / "out").read_text()
        self.assertIn("Copyright (c) Some Body\n\nPermission is hereby granted", told)
        # Of others the words differ.
        refused = self.notices("BSD-3-Clause")
        self.assertEqual((refused.returncode, "other 1.2.3" in refused.stderr), (1, True))


class Published(unittest.TestCase):
    def test_one_version(self) -> None:
        version = manifest("Cargo.toml")["package"]["version"]
        web = ("bindings/wasm", "bindings/wasm/encoder", "bindings/wasm/encoder/threads")
        for path in ("gpu", "bindings/c", "bindings/python", *web):
            self.assertEqual(manifest(f"{path}/Cargo.toml")["package"]["version"], version, path)
        gpu = manifest("gpu/Cargo.toml")
        for kind in ("dependencies", "dev-dependencies"):
            self.assertEqual(gpu[kind]["image-gip"]["version"], version, kind)
        for path in web:
            crate = manifest(f"{path}/Cargo.toml")["dependencies"]["image-gip"]
            self.assertEqual(crate["version"], version, path)
        package = json.loads((ROOT / "bindings/wasm/package.json").read_text())
        self.assertEqual(package["version"], version)
        news = (ROOT / "packaging/debian/changelog").read_text()
        self.assertTrue(news.startswith(f"image-gip ({version}-"), news)

    def test_manual_pages(self) -> None:
        news = (ROOT / "packaging/debian/changelog").read_text()
        released = parsedate_to_datetime(re.findall("^ -- .*>  (.*)$", news, re.MULTILINE)[0]).date()
        version = manifest("Cargo.toml")["package"]["version"]
        pages = sorted((ROOT / "packaging/man").iterdir())
        self.assertTrue(pages)
        for page in pages:
            text = page.read_text()
            self.assertRegex(text, f'(?m)^.TH {page.stem} 1 {released} "gip {version}" *$')
            # Tables of the help are wider than a page, and would be filled as any text.
            self.assertNotRegex(text, "(?m)^ ", page.name)
        if shutil.which("mandoc"):
            command = ["mandoc", "-Tlint", "-Wwarning", *pages]
            self.assertEqual(subprocess.run(command, capture_output=True, text=True).stdout, "")
        else:
            print("skipped: there is no mandoc to check manual pages")

    def test_links(self) -> None:
        """crates.io and npm follow links in the repository that is named; PyPI does not."""
        link = re.compile(r"\]\(([^)\s]+)\)")
        for name in NO_REPOSITORY:
            for target in link.findall((ROOT / name).read_text()):
                self.assertRegex(target, "^(https://|#)", name)
        for name in REPOSITORY_KNOWN:
            for target in link.findall((ROOT / name).read_text()):
                if re.match("https?://|#", target):
                    continue
                # They begin at the file, as sites differ in what they make of others.
                self.assertFalse(target.startswith(("/", ".")), f"{name}: {target}")
                path, _, _ = target.partition("#")
                self.assertTrue(((ROOT / name).parent / path).exists(), f"{name}: {target}")

    def test_archive_of_nothing(self) -> None:
        told = subprocess.run([ROOT / "packaging/archive"], capture_output=True, text=True)
        self.assertEqual(told.returncode, 2)
        self.assertIn("TARGET TOOL FOLDER", told.stderr)

    def test_archive(self) -> None:
        if not GIP.exists():
            reason = f"there is no {GIP} for the test of the archive"
            print(f"skipped: {reason}")
            self.skipTest(reason)
        target = "x86_64-unknown-linux-gnu"
        with tempfile.TemporaryDirectory() as folder:
            command = [ROOT / "packaging/archive", target, GIP, folder]
            made = Path(subprocess.check_output(command, text=True).strip())
            package = manifest("Cargo.toml")["package"]
            place = package["metadata"]["binstall"]
            words = {
                "repo": REPOSITORY,
                "version": package["version"],
                "target": target,
                "archive-suffix": f".{place['pkg-fmt']}",
                "bin": "gip",
                "binary-ext": "",
            }

            def filled(pattern: str) -> str:
                return re.sub(r"\{ ([a-z-]+) \}", lambda found: words[found[1]], pattern)

            # Where `cargo binstall` looks for it, and in it.
            self.assertEqual(filled(place["pkg-url"]).rpartition("/")[2], made.name)
            with tarfile.open(made) as archive:
                names = set(archive.getnames())
                tool = archive.extractfile(filled(place["bin-dir"]))
                self.assertIsNotNone(tool)
                self.assertEqual(tool and tool.read(), GIP.read_bytes())
                notices = archive.extractfile(f"{made.name.removesuffix('.tgz')}/LICENSE-THIRD-PARTY")
                told = notices.read().decode() if notices else ""
            crates = {crate.split()[0] for line in re.findall("=\n(.+)\n", told) for crate in line.split(",")}
            self.assertLessEqual({"exr", "kamadak-exif", "lebe", "mutate_once", "tiff"}, crates)
            # Neither what is only in tests, nor what only builds.
            self.assertTrue(crates.isdisjoint({"clap_mangen", "proptest", "syn", "thiserror-impl"}))
            self.assertTrue("Redistributions in binary form must reproduce" in told)
            for name in ("LICENSE-MIT", "man/gip.1", "completions/gip.bash", "desktop/gip.xml", "docs/metadata.md"):
                self.assertIn(f"{made.name.removesuffix('.tgz')}/{name}", names)
            told = Path(f"{made}.sha256").read_text().split()
            self.assertEqual(told, [hashlib.sha256(made.read_bytes()).hexdigest(), made.name])


if __name__ == "__main__":
    unittest.main()
