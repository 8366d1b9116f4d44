"""Random designs in plain NumPy do not refute what boxes prove."""

import json
import subprocess
import sys
from pathlib import Path

TOP, SCRIPT = Path(__file__).parents[2], "benchmarks.peers.global_peers"


def test_no_random_design_lies_below_a_proven_bound_and_peers_agree_where_they_are_installed():
    command = [sys.executable, "-m", SCRIPT, "--quick", "--json"]
    done = subprocess.run(command, cwd=TOP, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    rows = {row["method"]: row for row in json.loads(done.stdout)["rows"]}
    assert not any(row["refuted"] for row in rows.values())
    assert all(row["drawn"] > 50 for row in rows.values())
    for name in ("beatup-light", "beatup"):
        assert rows[f"loomopt, {name}"]["status"] == "proven"
        peer = rows[f"SCIP, {name}"]
        if peer["status"] in ("optimal", "gaplimit"):
            assert abs(peer["best"] - rows[f"loomopt, {name}"]["best"]) < 0.02
