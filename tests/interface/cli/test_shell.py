"""What the commands share: errors in the words of the command line."""

import pytest

from loomopt.base.errors import BadInput
from loomopt.interface.cli import shell


@pytest.mark.parametrize("key", shell.OPTIONS)
def test_an_argument_is_an_option_at_the_command_line(key):
    error = BadInput("it is out of range", file="a.toml", key=key, value="3", allowed="1 to 2", remedy="Give 1.")
    assert str(error) == f"a.toml: {key}: it is out of range (given: 3). Allowed: 1 to 2. Give 1."
    assert str(shell.name_option(error)) == str(error).replace(key, shell.OPTIONS[key], 1)


def test_a_key_of_a_scene_is_no_option():
    error = BadInput("it is no table", file="a.toml", key="targets", remedy="Correct it.")
    assert shell.name_option(error) is error
