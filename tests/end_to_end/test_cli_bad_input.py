"""Bad input through the command line: one plain line on stderr, exit 2, nothing on stdout, nothing written."""

import json
import os
import re

import pytest

from loomopt.interface.cli.app import run
from loomopt.jobs import registry

TEMPLATE = registry.template("beatup")
CRANK = {"l1": 0.031, "l2": 0.065, "l3": 0.155, "l4": 0.167}

# command line, ~ for a space in a value -> what the line on stderr must say: file, key, value, what to do
CASES = [
    ("slove beatup", ["slove", "--help"]),
    ("solve", ["Missing argument", "solve --help"]),
    ("solve beatup extra", ["extra", "--help"]),
    ("solve beatup --starst 3", ["--starst", "--starts"]),
    ("solve beatup --target", ["--target", "requires an argument"]),
    ("list --foo", ["--foo", "list --help"]),
    ("export beatup", ["--out", "export --help"]),
    ("solve betup", ["betup", 'perhaps "beatup" is meant']),
    ("solve beatup-lihgt", ['"beatup-light"']),
    ("solve zzz", ["zzz", "loomopt list"]),
    ("solve none.toml", ["none.toml", "does not exist", "loomopt list"]),
    ("solve ./folder", ["folder", "Name the file in it"]),
    ("solve big.toml", ["big.toml", "too large"]),
    ("solve binary.toml", ["binary.toml", "not UTF-8"]),
    ("solve latin.toml", ["latin.toml", "not UTF-8", "Save the file as UTF-8"]),
    ("solve broken.toml", ["broken.toml", "not TOML", "Correct the line"]),
    ("solve answer.json", ["answer.json", "does not exist"]),
    ("solve comma.toml", ["comma.toml", "mechanism.l1", "31,5 mm", "decimal point"]),
    ("solve swapped.toml", ["swapped.toml", "not a crank-rocker", "mechanism.l1", "shortest"]),
    ("solve beatup --target ballance", ["--target", "ballance", "balance, pulse"]),
    ("solve beatup --set operation.M0", ["--set", "operation.M0", "KEY=VALUE"]),
    ("solve beatup --set operation.MO=5", ["operation.MO", '"M0"']),
    ("solve beatup --set operaton.M0=5", ["operaton", '"operation"']),
    ("solve beatup --set operation.M0=800mm", ["operation.M0", "800mm", "N*m"]),
    ("solve beatup --set operation.M0=800", ["operation.M0", "unit is missing", "N*m"]),
    ("solve beatup --set operation.M0=800,5~N*m", ["operation.M0", "comma", "decimal point"]),
    ("solve beatup --set operation.speed=10~Hz", ["operation.speed", "10 Hz", "600 rpm"]),
    ("solve beatup --set mechanism.l4=600~mm", ["not a crank-rocker", "mechanism.l1"]),
    ("solve beatup --set bounds.l2.min=90~mm", ["bounds.l2", "min is more than max"]),
    ("solve beatup --with gravty", ["gravty", '"gravity"']),
    ("solve bare.toml --with gravity", ["available.gravity", "effects.gravity.tilt"]),
    ("solve beatup --without wind", ["wind", "resistance"]),
    ("solve beatup --without inertia --without resistance", ["effects", "needs a reed torque"]),
    ("solve beatup --target pulse --without resistance", ["effects.resistance", "pulse"]),
    ("solve beatup --without resistance --set limits.pulse_rms.max=300~N*m", ["limits.pulse_rms"]),
    ("solve beatup --free l9", ["bounds.l9", "cannot be freed"]),
    ("solve beatup --accuracy 0", ["--accuracy", "0", "1e-11 to 0.1"]),
    ("solve beatup --accuracy 2", ["--accuracy", "2", "1e-11 to 0.1"]),
    ("solve beatup --accuracy nan", ["--accuracy", "nan", "1e-11 to 0.1"]),
    ("solve beatup --accuracy 1e-99", ["--accuracy", "1e-11 to 0.1"]),
    ("solve beatup --accuracy abc", ["--accuracy", "abc", "such as 1e-8"]),
    ("solve beatup --starts 0", ["--starts", "0", "1 to 10000"]),
    ("solve beatup --starts -1", ["--starts", "-1", "1 to 10000"]),
    ("solve beatup --starts x", ["--starts", "x", "such as 20"]),
    ("solve beatup --starts 1_0", ["--starts", "1_0", "such as 20"]),
    ("solve beatup --starts \u0663", ["--starts", "such as 20"]),
    ("solve beatup --accuracy 1_0e-9", ["--accuracy", "1_0e-9", "such as 1e-8"]),
    ("solve beatup --starts 1.5", ["--starts", "1.5", "such as 20"]),
    ("solve beatup --out full.json", ["full.json", "--out", "Name another folder"]),
    ("solve beatup --out full.json/deeper", ["full.json/deeper", "Name another folder"]),
    ("evaluate beatup --design none.json", ["none.json", "does not exist", "path"]),
    ("evaluate beatup --design folder", ["folder", "not an ordinary file"]),
    ("evaluate beatup --design /dev/zero", ["/dev/zero", "not an ordinary file"]),
    ("evaluate beatup --design big.toml", ["big.toml", "too large"]),
    ("evaluate beatup --design broken.toml", ["broken.toml", "not JSON", "loomopt solve --json"]),
    ("evaluate beatup --design binary.toml", ["binary.toml", "not JSON"]),
    ("evaluate beatup --design key.json", ["key.json", "design.l9", '"l']),
    ("evaluate beatup --design text.json", ["text.json", "design.l1", "31 kg", "mm"]),
    ("evaluate beatup --design bare.json", ["bare.json", "design.l1", "38", "metres?", '"38 mm"']),
    ("evaluate shedding --design digits.json", ["digits.json", "design.law_999", "unknown"]),
    ("evaluate beatup --design apart.json", ["apart.json", "does not assemble", "lengths"]),
    ("evaluate beatup --design list.json", ["list.json", "no design", "l1, l2"]),
    ("simulate beatup --design nan.json", ["nan.json", "design.l1", "finite"]),
    ("simulate beatup --out curves.foo", ["curves.foo", ".foo", ".parquet", "curves.csv"]),
    ("simulate beatup --out curves", ["curves", ".csv"]),
    ("simulate beatup --out no/such/curves.csv", ["no/such/curves.csv", "folder", "Make the folder"]),
    ("export beatup --out linkage", ["linkage", ".dxf"]),
    ("export beatup --out linkage.stl", ["linkage.stl", ".dxf"]),
    ("export beatup --out no/such/linkage.dxf", ["no/such", "Make the folder"]),
    ("export beatup --design apart.json --out linkage.svg", ["apart.json", "does not assemble"]),
    ("show beatup --figure drawing.gif", ["drawing.gif", ".png"]),
    ("new beatup full.json", ["full.json", "exists already", "another name"]),
    ("new rapir mine.toml", ["rapir", "beatup"]),
    ("new beatup no/such/mine.toml", ["no/such/mine.toml", "Make the folder"]),
    ("check nonsense", ["nonsense", "beatup"]),
]


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Work in a folder of bad files."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    with (tmp_path / "big.toml").open("wb") as file:
        file.truncate(100_000_000)
    (tmp_path / "binary.toml").write_bytes(bytes(range(256)))
    (tmp_path / "latin.toml").write_bytes("title = 'für Gewebe'".encode("cp1252"))
    texts = {
        "broken.toml": "l1 = ",
        "bare.toml": re.sub(r"(?ms)^\[available\.gravity\].*?(?=^\[)", "", TEMPLATE),
        "comma.toml": TEMPLATE.replace('"31 mm"', '"31,5 mm"'),
        "swapped.toml": TEMPLATE.replace('"31 mm"', '"310 mm"'),
        "full.json": "here already",
        "key.json": json.dumps(CRANK | {"l9": 1.0}),
        "text.json": json.dumps(CRANK | {"l1": "31 kg"}),
        "bare.json": json.dumps({"l1": 38}),
        "digits.json": json.dumps({"law_" + "9" * 5000: 1}),
        "apart.json": json.dumps({"design": CRANK | {"l4": 0.5}}),
        "list.json": "[0.031, 0.065]",
        "nan.json": '{"l1": NaN}',
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def listing(folder):
    return sorted((str(path), path.stat().st_mtime_ns) for path in folder.rglob("*"))


@pytest.mark.parametrize(("line", "report"), CASES, ids=lambda value: str(value)[:60])
def test_bad_input_is_one_plain_line(line, report, place, capsys):
    before = listing(place)
    status = run([word.replace("~", " ") for word in line.split()])
    out, err = capsys.readouterr()
    assert (status, out) == (2, "")
    assert err.startswith("loomopt: ")
    assert err.endswith("\n")
    assert err[:-1].isprintable(), "more than one line, or an escape sequence"
    for part in report:
        assert part in err
    assert "Traceback" not in err
    assert listing(place) == before


@pytest.mark.parametrize("option", ["--json", "--out"])
def test_bad_input_is_no_json_and_makes_no_folder(option, place, capsys):
    before = listing(place)
    extra = [option] if option == "--json" else [option, "answer"]
    assert run(["solve", "beatup", "--target", "nonsense", *extra]) == 2
    assert capsys.readouterr().out == ""
    assert listing(place) == before


def test_what_a_terminal_would_obey_is_not_repeated(place, capsys):
    (place / "escape.json").write_text(json.dumps({"\x1b[2J": 1, "l1": 0.03}), encoding="utf-8")
    for arguments in (["evaluate", "beatup", "--design", "escape.json"], ["solve", "beatup", "--set", "\x1b[2J\n=1"]):
        assert run(arguments) == 2
        assert capsys.readouterr().err[:-1].isprintable()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_may_not_be_written_to_is_named(place, capsys):
    (place / "folder").chmod(0o555)
    assert run(["simulate", "beatup", "--out", "folder/curves.csv"]) == 2
    assert "folder/curves.csv" in capsys.readouterr().err


def test_there_are_enough_cases():
    assert len(CASES) >= 60
