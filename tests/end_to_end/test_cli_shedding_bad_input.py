"""Bad input to cam shedding on the command line: one plain line on stderr, exit 2, nothing on stdout."""

from pathlib import Path

import pytest

from loomopt.interface.cli.app import run


@pytest.fixture
def cli(capsys):
    """Return a call of the command line: exit status, stdout, stderr."""

    def call(*arguments):
        status = run([str(argument) for argument in arguments])
        return status, *capsys.readouterr()

    return call


# command line, ~ for a space in a value -> what the one line on stderr must say
BAD = [
    ("--set mechanism.rise=121~deg", ["segments add to 361 deg", "360 deg together"]),
    ("--set mechanism.rise=0~deg --set mechanism.far_dwell=180~deg", ["mechanism.rise", "no cam angle"]),
    ("--set mechanism.return=1e-40~deg --set mechanism.far_dwell=180~deg", ["mechanism.return", "no cam angle"]),
    ("--set mechanism.law=cycloid", ["mechanism.law", '"cycloidal"']),
    ("--set mechanism.law=spline", ["mechanism.law_coefficients", "needs its coefficients"]),
    ("--set mechanism.law=table", ["mechanism.law_table", "needs its file"]),
    ("--set mechanism.law_table=falls.csv", ["mechanism.law_table", 'law = "table"']),
    ("--set mechanism.law=table --set mechanism.law_table=none.csv", ["none.csv", "does not exist"]),
    ("--set mechanism.law=table --set mechanism.law_table=falls.csv", ["falls.csv", "falls between u ="]),
    ("--set mechanism.law=table --set mechanism.law_table=back.csv", ["back.csv", "u must increase"]),
    (
        "--set mechanism.law=table --set mechanism.law_table=head.csv",
        ["head.csv", "line 1, column theta", "unit is missing"],
    ),
    ("--set mechanism.law=table --set mechanism.law_table=units.csv", ["units.csv", "column s", '"kg" is not a unit']),
    ("--set mechanism.law=table --set mechanism.law_table=few.csv", ["few.csv", "3 rows"]),
    (
        "--set mechanism.law=table --set mechanism.law_table=word.csv",
        ["word.csv", "line 11, column s", '"ten" is no number'],
    ),
    ("--set mechanism.travel=-1~mm", ["mechanism.travel", "at least 0 mm"]),
    ("--set mechanism.X0=-1~mm", ["mechanism.X0", "at least 0 mm"]),
    ("--set mechanism.K1=-1~N/m", ["mechanism.K1", "at least 0 N/m"]),
    ("--set mechanism.K1=8~kN", ["mechanism.K1", "unit of force, not of stiffness"]),
    ("--set mechanism.travel=65~deg", ["mechanism.travel", "unit of angle, not of length"]),
    ("--set mechanism.rise=120", ["mechanism.rise", "unit is missing"]),
    ("--set operation.speed=10~Hz", ["operation.speed", "600 rpm"]),
    ("--set operation.N_min=-1~N", ["operation.N_min", "at least 0 N"]),
    ("--set effects.warp_tension.shape=steps", ["effects.warp_tension.shape", '"step"']),
    ("--set mechanism.base_radius=5~mm", ["follower cannot work", "base_radius 5 mm"]),
    ("--set limits.contact_max.min=1~N", ["limits.contact_max.min", "no limit min"]),
    ("--set bounds.X0.min=90~mm", ["bounds.X0", "min is more than max"]),
    ("--target balance", ["balance", "stiffness, law, force, speed"]),
    ("--target speed --without inertia", ["effects.inertia", "target speed needs"]),
    ("--with gravity", ["gravity", "damping, dry_friction"]),
    ("--free sley", ["sley", "cannot be freed", "Allowed: rise, far_dwell, return, near_dwell."]),
]
TABLES = {
    "falls.csv": "angle [deg],s [mm]\n0,0\n10,1\n20,3\n30,2.5\n40,5\n50,7\n60,9\n70,9.5\n80,10\n",
    "back.csv": "angle [deg],s [mm]\n0,0\n10,1\n20,3\n15,3.5\n40,5\n50,7\n60,9\n70,9.5\n80,10\n",
    "head.csv": "theta,s [mm]\n" + "".join(f"{k},{k}\n" for k in range(9)),
    "units.csv": "angle [deg],s [kg]\n" + "".join(f"{k},{k}\n" for k in range(9)),
    "few.csv": "angle [deg],s [mm]\n0,0\n10,1\n20,3\n",
    "word.csv": "angle [deg],s [mm]\n" + "".join(f"{k},{k}\n" for k in range(9)) + "10,ten\n",
}


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Work in a folder that holds the packaged scene and bad tables."""
    monkeypatch.chdir(tmp_path)
    scene = Path(__file__).parents[2] / "problems" / "shedding.toml"
    for name, text in {"mine.toml": scene.read_text(encoding="utf-8"), **TABLES}.items():
        (tmp_path / name).write_text(text, encoding="utf-8")


@pytest.mark.parametrize(("line", "report"), BAD, ids=[line for line, _ in BAD])
def test_bad_input_exits_with_2_one_message_and_nothing_on_stdout(cli, place, line, report):
    status, out, err = cli("solve", "mine.toml", *(word.replace("~", " ") for word in line.split()), "--json")
    assert (status, out) == (2, "")
    assert err.startswith("loomopt: ")
    assert err.endswith("\n")
    assert err[:-1].isprintable()
    assert all(part in err for part in report), err


LINES = {
    "speed missing with inertia": ('speed = "600 rpm"', "", ["operation.speed", "effect inertia needs it"]),
    "a spline that does not arrive": (
        'law = "cycloidal"',
        'law = "spline"\nlaw_coefficients = [0.0, 1.0, 2.0, 3.0, 0.0]',
        ["mechanism.law_coefficients", "ends at s = 0.625"],
    ),
    "a spline of two intervals": (
        'law = "cycloidal"',
        'law = "spline"\nlaw_coefficients = [0.0, 9.0, -9.0]',
        ["mechanism.law_coefficients", "2 intervals"],
    ),
    "coefficients of another law": (
        'law = "cycloidal"',
        'law = "cycloidal"\nlaw_coefficients = [0.0, 6.0, 0.0, -6.0, 0.0]',
        ["mechanism.law_coefficients", 'law = "spline"'],
    ),
    "an angle missing": ('near_dwell = "60 deg"', "", ["mechanism.near_dwell", "near_dwell is missing"]),
    "an unknown key": ('K1 = "8029.14 N/m"', 'K2 = "8029.14 N/m"', ["mechanism.K2", '"K1"']),
}


@pytest.mark.parametrize("name", LINES)
def test_a_bad_line_in_a_file_exits_with_2(cli, place, name):
    before, after, report = LINES[name]
    text = Path("mine.toml").read_text(encoding="utf-8")
    assert before in text
    Path("mine.toml").write_text(text.replace(before, after, 1), encoding="utf-8")
    status, out, err = cli("solve", "mine.toml", "--json")
    assert (status, out) == (2, "")
    assert err[:-1].isprintable()
    assert all(part in err for part in report), err


def test_a_limit_on_the_coils_without_coils_is_refused(cli):
    status, out, err = cli("solve", "shedding", "--set", "limits.shear_stress.max=500 MPa")
    assert (status, out) == (2, "")
    assert "coil" in err


def test_coefficients_that_are_no_list_of_numbers_are_refused_in_plain_words(cli):
    _, _, err = cli("solve", "shedding", "--set", "mechanism.law=spline", "--set", "mechanism.law_coefficients=5")
    assert "mechanism.law_coefficients" in err
    assert "tuple" not in err
