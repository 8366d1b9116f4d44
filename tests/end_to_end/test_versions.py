"""The version line names what computes: the versions of CasADi and IPOPT are those that run."""

import importlib.util
import re
import sys
from typing import Any

import casadi
import pytest

import loomopt as lo
from loomopt.interface.cli import app


def test_the_line_names_the_casadi_and_the_ipopt_that_run(capfd):
    x = casadi.SX.sym("x")
    options: dict[str, Any] = {"print_time": False, "ipopt": {"sb": "yes", "print_level": 5, "max_iter": 0}}
    casadi.nlpsol("s", "ipopt", {"x": x, "f": x**2}, options)(x0=1.0)
    banner = re.search(r"Ipopt version ([\d.]+\d)", capfd.readouterr().out)
    assert app.run(["--version"]) == 0
    line = f"loomopt {lo.__version__} (CasADi {casadi.CasadiMeta.version()}, IPOPT {banner[1]})\n"
    assert capfd.readouterr().out == line


@pytest.mark.parametrize("content", [None, "nothing of it\n"])
def test_an_ipopt_that_does_not_tell_is_not_made_up(content, tmp_path, monkeypatch):
    header = tmp_path / app.HEADER
    header.parent.mkdir(parents=True)
    if content:
        header.write_text(content)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    assert app.ipopt() == app.UNTOLD
    header.write_text('#define IPOPT_VERSION "3.14.1"\n')
    assert app.ipopt() == "3.14.1"
