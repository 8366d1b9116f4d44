"""Messages are read by people: one line, of a length that is read, whatever was given."""

import itertools

import pytest

import loomopt as lo
from loomopt.base.errors import PLUGINS, BadInput, Broken, blamed, clean, naming
from loomopt.interface.cli.app import run

LONGEST_MESSAGE = 2000
"""Characters of a message that is read."""
PARTS = ("problem", "file", "key", "value", "allowed", "remedy")
LONG = ["x" * 5000, "\x1b[2J" * 2000, "\u2028" * 3000, "织" * 4000]


@pytest.mark.parametrize("text", LONG, ids=["letters", "escapes", "lines", "wide"])
def test_no_message_is_longer_than_what_is_read(text):
    for count in (1, 2, len(PARTS)):
        for parts in itertools.combinations(PARTS, count):
            given = dict.fromkeys(parts, text)
            message = str(BadInput(given.pop("problem", "it is wrong"), **given))
            assert len(message) <= LONGEST_MESSAGE
            assert message.isprintable()


def test_what_is_short_is_said_as_it_is():
    error = BadInput("it is wrong", file="a.toml", key="b.c", value="5", allowed="more", remedy="Mend it.")
    assert str(error) == "a.toml: b.c: it is wrong (given: 5). Allowed: more. Mend it."
    assert (error.file, error.key, error.value) == ("a.toml", "b.c", "5")


def test_in_jupyter_it_is_the_sentence_and_no_traceback():
    error = BadInput("it is wrong", key="b.c", value="5")
    assert error._render_traceback_() == ["BadInput: b.c: it is wrong (given: 5)."]


def test_a_shortened_text_says_how_long_it_was():
    assert clean("x" * 20, 5) == "xxxxx... (20 characters)"
    assert clean("a\x1b" * 9, 6) == "a\\x1ba... (18 characters)"


@pytest.mark.parametrize(
    "line",
    ["{}", "solve beatup --{}", "solve beatup {}", "solve beatup --target {}", "solve beatup --accuracy {}",
     "solve beatup --starts {}", "solve beatup --free {}", "solve beatup --set {}", "solve beatup --set {}=1",
     "solve beatup --set operation.M0={}", "solve beatup --set targets.{}.table=1", "solve beatup --with {}",
     "solve beatup --out {}", "solve {}", "solve {}.toml", "solve {}/a.toml", "check {}", "new {} a.toml",
     "new beatup {}/a.toml", "simulate beatup --out {}", "simulate beatup --out {}/a.csv",
     "evaluate beatup --design {}", "export beatup --out {}/a.dxf",
     "solve rapier --target match --set targets.match.table={}"],
)  # fmt: skip
@pytest.mark.parametrize("text", ["x" * 5000, "x/" * 2500, "\x1b[31m" * 900], ids=["long", "deep", "coloured"])
def test_a_command_line_of_any_length_is_answered_shortly(tmp_path, monkeypatch, capsys, line, text):
    monkeypatch.chdir(tmp_path)
    assert run(line.format(text).split(" ")) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err[:-1].isprintable()
    assert len(err) <= LONGEST_MESSAGE + 100


def test_a_scene_of_any_names_is_answered_shortly():
    document = dict(lo.load("beatup").document)
    for table in document:
        with pytest.raises(BadInput) as refused:
            lo.scene({**document, table: {"x" * 5000: "y" * 5000}})
        assert len(str(refused.value)) <= LONGEST_MESSAGE


def entry_point_function(monkeypatch, body):
    """Return a function of a module that an entry point names."""
    monkeypatch.setitem(PLUGINS, "windy.drag", "effect beatup.wind of loomopt-wind")
    module = {"__name__": "windy.formulas"}
    exec(f"def force(given):\n    {body}", module)
    return module["force"]


@pytest.mark.parametrize("body", ["raise SystemExit(0)", "return 1 / 0", "return given['k']", "return force(given)"])
def test_code_of_another_distribution_that_fails_is_named(monkeypatch, body):
    force = entry_point_function(monkeypatch, body)
    message = r"effect beatup\.wind of loomopt-wind fails in force, line 2 of windy"
    with pytest.raises(Broken, match=message) as caught, naming():
        force({})
    assert str(caught.value).isprintable()
    assert caught.value.__cause__ is not None


def test_what_is_told_or_stopped_already_stays_as_it_is(monkeypatch):
    for name in ("BadInput", "KeyboardInterrupt"):
        force = entry_point_function(monkeypatch, f"raise given['{name}']")
        error = {"BadInput": BadInput("ask"), "KeyboardInterrupt": KeyboardInterrupt()}[name]
        with pytest.raises(type(error)) as caught, naming():
            force({name: error})
        assert caught.value is error


def test_an_error_elsewhere_keeps_its_kind_and_says_once_who_takes_part(monkeypatch):
    force = entry_point_function(monkeypatch, "return None")
    for _ in range(2):
        with pytest.raises(TypeError) as caught, naming(), naming():
            len(force({}))
        assert caught.value.__notes__ == ["other distributions take part: effect beatup.wind of loomopt-wind"]
    monkeypatch.delitem(PLUGINS, "windy.drag")
    assert blamed(error := ValueError("x")) is error
    assert not hasattr(error, "__notes__")
