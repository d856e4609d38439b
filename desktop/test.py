"""Tries the files of this folder with the tools that read them.

`python3 desktop/test.py` runs it. What is not installed is reported as `skipped: ...`. The thumbnailer
runs the tool that the variable GIP names, or else that of `cargo build --release --features cli`.
"""

import configparser
import json
import os
import plistlib
import shlex
import shutil
import struct
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree as ET
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
GIP = Path(os.environ.get("GIP", FOLDER.parent / "target" / "release" / "gip"))
VECTORS = FOLDER.parent / "spec" / "vectors"
MEDIA_TYPE = "image/vnd.gip"
SIGNATURE = b"\xc7GIP\r\n\x01\n"
MODELS = ("gray", "gray with alpha", "RGB", "RGBA")


def number(value: int) -> bytes:
    """A number of one to five bytes (specification, section 2)."""
    low = bytearray()
    while value > 127:
        low.append(value % 128 + 128)
        value //= 128
    return bytes([*low, value])


def beginning(width: int, height: int, form: int = 0, version: int = 1) -> bytes:
    """The beginning of a file of so many pixels, up to the height."""
    signature = SIGNATURE[:6] + bytes([version]) + SIGNATURE[7:]
    return signature + b"H\x18" + bytes([form]) + number(width) + number(height)


def run(*command: str | Path, **variables: str) -> str:
    """What a tool prints."""
    environment = os.environ | variables
    return subprocess.check_output(command, text=True, env=environment).strip()


class TestCase(unittest.TestCase):
    """Tests with a folder, which are skipped if there is no tool."""

    tools: tuple[str, ...] = ()

    @classmethod
    def setUpClass(cls) -> None:
        for tool in cls.tools:
            if shutil.which(tool) is None:
                reason = f"there is no {tool} for the tests of {cls.__name__}"
                print(f"skipped: {reason}")
                raise unittest.SkipTest(reason)

    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def written(self, name: str, content: bytes) -> Path:
        path = self.folder / name
        path.write_bytes(content)
        return path


class Magic(TestCase):
    """`gip.magic`, and `file`."""

    tools = ("file",)

    def told(self, path: Path, *options: str, others: str = "") -> str:
        return run("file", "--brief", "--magic-file", f"{FOLDER}/gip.magic{others}", *options, path)

    def check(self, width: int, height: int, form: int) -> None:
        sides = [side if side < 2**14 else "over 16383" for side in (width, height)]
        depth = 16 if form & 4 else 8
        expected = f"{sides[0]} x {sides[1]}, {depth}-bit {MODELS[form & 3]}"
        path = self.written("a", beginning(width, height, form) + bytes(16))
        self.assertEqual(self.told(path), f"GIP image data, version 1, {expected}")

    def test_sides(self) -> None:
        edges = [1, 9, 127, 128, 129, 255, 256, 300, 1920, 4095, 8191, 16383, 16384, 2**20]
        for at, width in enumerate(edges):
            self.check(width, edges[-1 - at], form=0x18)

    def test_the_table_is_complete(self) -> None:
        pairs = [f">>1\tubyte\t{k}\n>>>0\tuleshort-{128 + 128 * k}\tx\t%u\n" for k in range(1, 128)]
        self.assertTrue((FOLDER / "gip.magic").read_text().endswith("".join(pairs)))

    def test_formats(self) -> None:
        for form in range(0x80):
            if form & 0x60 != 0x60:
                self.check(640, 48, form)

    def test_vectors(self) -> None:
        paths = sorted(VECTORS.glob("[!x]*.gip"))
        self.assertGreater(len(paths), 60)
        for path in paths:
            with self.subTest(path.name):
                self.assertRegex(
                    self.told(path), r"^GIP image data, version 1, \d+ x \d+, (8|16)-bit (gray|RGB)"
                )

    def test_names(self) -> None:
        # Alone, and among those of all other formats.
        for others in ("", ":/usr/share/misc/magic"):
            path = VECTORS / "rgb8.gip"
            self.assertEqual(self.told(path, "--mime-type", others=others), MEDIA_TYPE)
            self.assertEqual(self.told(path, "--extension", others=others), "gip")

    def test_other_versions(self) -> None:
        path = self.written("a", beginning(640, 48, version=7))
        self.assertEqual(self.told(path), "GIP image data, version 7")

    def test_what_is_no_gip(self) -> None:
        for changed in (b"GIP\r\n\x01\n", b"\xc7GIP\n\x01\n", b"\x47GIP\r\n\x01\n", b"GIF89a"):
            path = self.written("a", changed + beginning(640, 48)[8:])
            self.assertNotIn("GIP image", self.told(path))


class SharedMimeInfo(TestCase):
    """`gip.xml`, and `xdg-mime`, which asks `gio` for files."""

    tools = ("update-mime-database", "xdg-mime", "gio")

    def test_types(self) -> None:
        packages = self.folder / "data" / "mime" / "packages"
        packages.mkdir(parents=True)
        shutil.copy(FOLDER / "gip.xml", packages)
        data = {"XDG_DATA_HOME": str(self.folder / "data"), "XDG_CURRENT_DESKTOP": "GNOME"}
        run("update-mime-database", packages.parent, **data)
        file = (VECTORS / "rgb8.gip").read_bytes()
        for name, content, expected in [
            ("a.gip", file, MEDIA_TYPE),
            # By its content alone, and by its name alone.
            ("a", file, MEDIA_TYPE),
            ("another version", beginning(640, 48, version=2), MEDIA_TYPE),
            ("b.gip", bytes(9), MEDIA_TYPE),
            ("a.png", file[1:], "image/png"),
            ("text", b"GIP\r\n", "text/plain"),
        ]:
            with self.subTest(name):
                path = self.written(name, content)
                self.assertEqual(run("xdg-mime", "query", "filetype", path, **data), expected)


class Thumbnailer(TestCase):
    """`gip.thumbnailer`, as file managers run it."""

    tools = (str(GIP),)

    def setUp(self) -> None:
        super().setUp()
        parser = configparser.RawConfigParser()
        parser.optionxform = str  # type: ignore[assignment, method-assign]
        parser.read(FOLDER / "gip.thumbnailer")
        self.entry = parser["Thumbnailer Entry"]

    def thumbnail(self, source: Path, output: Path, size: int) -> tuple[int, int]:
        """The size of a thumbnail, of which the file manager gives name and longest side."""
        programs = self.folder / "bin"
        programs.mkdir(exist_ok=True)
        link = programs / self.entry["TryExec"]
        if not link.exists():
            link.symlink_to(GIP.resolve())
        # Fields stand alone, and what stands for them is no text of a shell.
        fields = {"%s": str(size), "%i": str(source), "%o": str(output), "%u": source.as_uri()}
        words = [fields.get(word, word) for word in shlex.split(self.entry["Exec"])]
        self.assertFalse(any("%" in word for word in words))
        done = subprocess.run(words, env={"PATH": str(programs)}, capture_output=True, text=True)
        # What of a picture is left out is told on standard error.
        self.assertEqual((done.returncode, done.stdout), (0, ""), done.stderr)
        content = output.read_bytes()
        self.assertEqual(content[:8], b"\x89PNG\r\n\x1a\n")
        width, height = struct.unpack(">II", content[16:24])
        return width, height

    def test_types(self) -> None:
        self.assertEqual(self.entry["MimeType"], f"{MEDIA_TYPE};")
        self.assertEqual(shlex.split(self.entry["Exec"])[0], self.entry["TryExec"])

    def test_names_without_an_extension(self) -> None:
        # The name of the picture says nothing, and the output is there, as from mkstemp.
        source = self.written("a picture", (VECTORS / "rgb8.gip").read_bytes())
        for name in (".thumbnail.Xy12Ab", "gnome-desktop-thumbnailer.png", "tumbler-Xy12Ab"):
            output = self.written(name, b"")
            output.chmod(0o600)
            with self.subTest(name):
                self.assertEqual(max(self.thumbnail(source, output, 16)), 16)
                self.assertEqual(output.stat().st_mode & 0o777, 0o600)

    def test_sizes(self) -> None:
        paths = sorted(VECTORS.glob("[!x]*.gip"))
        self.assertGreater(len(paths), 60)
        for path in paths:
            whole = json.loads(run(GIP, "info", "--json", path))
            sides = [whole["upright_width"], whole["upright_height"]]
            for size in (8, 1024):
                with self.subTest(path.name, size=size):
                    made = self.thumbnail(path, self.folder / "thumbnail", size)
                    self.assertEqual(max(made), min(size, max(sides)))


class Declarations(TestCase):
    """What is read by systems that are not at hand here."""

    def test_uniform_type_identifier(self) -> None:
        content = plistlib.loads((FOLDER / "gip.plist").read_bytes())
        [declared] = content["UTImportedTypeDeclarations"]
        self.assertEqual(declared["UTTypeConformsTo"], ["public.image"])
        self.assertEqual(
            declared["UTTypeTagSpecification"],
            {"public.filename-extension": ["gip"], "public.mime-type": [MEDIA_TYPE]},
        )

    def test_registry(self) -> None:
        content = (FOLDER / "gip.reg").read_bytes()
        self.assertTrue(content.startswith(b"Windows Registry Editor Version 5.00\r\n\r\n"))
        # Each line ends as on Windows.
        self.assertEqual(content.count(b"\n"), content.count(b"\r\n"))
        keys: dict[str, dict[str, str]] = {}
        values: dict[str, str] = {}
        for line in content.decode("ascii").splitlines()[1:]:
            if line.startswith("["):
                self.assertTrue(line.endswith("]"))
                values = keys[line[1:-1]] = {}
            elif line and not line.startswith(";"):
                name, _, value = line.partition("=")
                self.assertTrue(value.startswith('"') and value.endswith('"'))
                values[name.strip('"')] = value.strip('"')
        classes = r"HKEY_CURRENT_USER\Software\Classes"
        extension = keys[rf"{classes}\.gip"]
        program = extension["@"]
        self.assertEqual(extension["PerceivedType"], "image")
        self.assertEqual(extension["Content Type"], MEDIA_TYPE)
        self.assertIn(rf"{classes}\{program}", keys)
        self.assertEqual(keys[rf"{classes}\.gip\OpenWithProgids"], {program: ""})
        media_type = keys[rf"{classes}\MIME\Database\Content Type\{MEDIA_TYPE}"]
        self.assertEqual(media_type, {"Extension": ".gip"})
        # As Microsoft has it for a ProgID.
        self.assertRegex(program, r"^[A-Za-z][A-Za-z0-9.]{0,38}$")

    def test_one_media_type(self) -> None:
        mime = "{http://www.freedesktop.org/standards/shared-mime-info}"
        [declared] = ET.parse(FOLDER / "gip.xml").getroot().iter(f"{mime}mime-type")
        self.assertEqual(declared.get("type"), MEDIA_TYPE)
        for name in (
            "desktop/README.md",
            "desktop/gip.thumbnailer",
            "spec/gip.md",
            "bindings/python/python/image_gip/pillow.py",
            "bindings/wasm/README.md",
            "web/serve.js",
        ):
            self.assertIn(MEDIA_TYPE, (FOLDER.parent / name).read_text())
        template = (FOLDER / "media-type.txt").read_text()
        kind, _, subtype = MEDIA_TYPE.partition("/")
        self.assertIn(f"Type name: {kind}\n", template)
        self.assertIn(f"Subtype name: {subtype}\n", template)


if __name__ == "__main__":
    unittest.main()
