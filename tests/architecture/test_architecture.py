"""Imports run one way, without a circle; a job and an effect are known by name in their own files only."""

import ast
import functools
import re
from pathlib import Path

import pytest

import loomopt
from loomopt.base.units import SI_UNIT
from loomopt.jobs import registry
from loomopt.physics.effects import kinds

PACKAGE = Path(loomopt.__file__).parent
JOBS = registry.builtin_names()

ROOMS = ("base", "maths", "physics", "scenes", "model", "picture", "jobs", "solving", "studies", "interface")
"""In the order of imports: a room takes from itself and from those before it."""
FACE = ("__init__", "__main__")
"""What stands beside the rooms and may take from all of them."""
FLOOR = {name: floor for floor, name in enumerate((*ROOMS, *FACE))}
IN_A_JOB = {"__init__", "scene", "model", "program", "job", "views", "drawing"}
"""The files that every job's folder has, beside template.toml."""
MORE_IN_A_JOB = {"linkage": {"parts"}}
"""What one job has beside them: a linkage is described in the scene."""
COMMON = {"load", "counterweight", "contact"}
"""Names of effects that name other things too: a public function, a move of the beat-up, a curve of shedding."""
WITHOUT_TYPES = {
    *("solving.nlp", "interface.figures", "interface.files.dxf", "interface.text.layout"),
    *("maths.systems", "picture.equations"),
}
"""Folders and files at the edge of CasADi, matplotlib, ezdxf, Rich and SymPy, where `Any` may stand."""
MAY_SOLVE = {"interface.api", "interface.results"}
"""The public functions, and answers that are asked for more."""
MOST_ANY = 12
"""Annotations `Any` elsewhere, maths.Number apart."""


def modules(folder=PACKAGE):
    """Return every module's name in the package with its file."""
    return {".".join(path.relative_to(folder).with_suffix("").parts): path for path in folder.rglob("*.py")}


def room(name):
    return name.split(".")[0]


tree_of = functools.cache(ast.parse)


@functools.cache
def text_of(path):
    return path.read_text(encoding="utf-8")


def parsed(path):
    return tree_of(text_of(path))


@functools.cache
def imports(source):
    """Return what source imports of loomopt, inside functions and for types too, with the line of each."""
    names = []
    for node in ast.walk(tree_of(source)):
        if isinstance(node, ast.Import):
            names += [(alias.name, node.lineno) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"line {node.lineno}: imports name the whole path"
            names += [(f"{node.module}.{alias.name}", node.lineno) for alias in node.names]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            names += [(node.value, node.lineno)] if re.fullmatch(r"loomopt(\.\w+)+", node.value) else []
    # What is taken from the package itself would come from above all rooms.
    names = [("loomopt.__init__" if name.startswith("loomopt.__") else name, line) for name, line in names]
    inner = [(name.removeprefix("loomopt."), line) for name, line in names if name.startswith("loomopt.")]
    return [(name, line) for name, line in inner if room(name) in FLOOR]


def climbing(name, source):
    """Return what a module imports from above itself."""
    return [
        f"{name}:{line} imports {other}" for other, line in imports(source) if FLOOR[room(other)] > FLOOR[room(name)]
    ]


def test_every_module_has_a_room():
    assert {room(name) for name in modules()} == set(FLOOR)


@pytest.mark.slow
def test_the_library_imports_nothing_of_the_command_line():
    values = ("interface.cli", "__main__")
    outside = {name: path for name, path in modules().items() if not name.startswith(values)}
    spots = [
        f"{name}:{line}"
        for name, path in outside.items()
        for other, line in imports(text_of(path))
        if other.startswith("interface.cli")
    ]
    assert spots == []


def test_imports_run_one_way():
    sources = {name: text_of(path) for name, path in modules().items()}
    assert [line for name, source in sources.items() for line in climbing(name, source)] == []


@pytest.mark.parametrize(
    "source",
    [
        "from loomopt.interface.files import svg",
        "from loomopt.interface import tables; from loomopt.base import errors",
        "def f():\n    import loomopt.solving.engine",
        "import importlib\nimportlib.import_module('loomopt.solving.nlp.exchange')",
    ],
)
def test_an_import_from_above_is_found(source):
    assert len(climbing("jobs.beatup.model", source)) == 1


def test_imports_of_a_module_below_or_beside_are_allowed():
    below = "from loomopt.model import sampling\nfrom loomopt.base.errors import BadInput"
    assert climbing("jobs.beatup.model", below) == []


def arrows():
    """Return every module with the modules it imports."""
    known = {name.removesuffix(".__init__"): path for name, path in modules().items()}
    counts = {}
    for name, path in known.items():
        named = [other for other, _ in imports(text_of(path))]
        homes = {other if other in known else other.rpartition(".")[0] for other in named}
        counts[name] = {home for home in homes if home in known and home != name and known[home].stem != "__init__"}
    return counts


def test_no_file_reaches_itself():
    graph = arrows()

    def reached(start):
        seen, todo = set[str](), [start]
        while todo:
            new = graph[todo.pop()] - seen
            seen |= new
            todo += new
        return seen

    assert [name for name in graph if name in reached(name)] == []


def test_what_people_see_never_solves_and_knows_no_job():
    for name, path in modules().items():
        if name.startswith("interface."):
            taken = {other for other, _ in imports(text_of(path))}
            if name not in MAY_SOLVE:
                assert not {other for other in taken if other.startswith(("solving.nlp", "solving.engine"))}, name
            assert not {other for other in taken if re.match(rf"jobs\.({'|'.join(JOBS)})\b", other)}, name


def code_of(path):
    """Text of a file without the examples of its docstrings, which show any job."""
    return "\n".join(line for line in text_of(path).splitlines() if not line.lstrip().startswith(">>> "))


@pytest.mark.parametrize("job", JOBS)
def test_a_job_is_named_in_its_own_files_only(job):
    word = re.compile(rf"loomopt\.jobs\.{job}\b|[\"']{job}[\"']")
    strangers = [n for n, path in modules().items() if job not in path.parts and word.search(code_of(path))]
    assert strangers == []


@pytest.mark.parametrize("job", JOBS)
def test_an_effect_is_named_in_its_own_file_only_and_where_a_target_needs_it(job):
    for name in (
        set(kinds.of(f"loomopt.physics.effects.{job}")) - set(SI_UNIT) - COMMON
    ):  # "inertia" is a kind of quantity too
        quoted = (f'"{name}"', f"'{name}'")
        strangers = [n for n, path in modules().items() if any(word in code_of(path) for word in quoted)]
        assert set(strangers) <= {
            *(n for n in modules() if n.startswith("physics.effects")),
            *(f"jobs.{j}.scene" for j in JOBS),
        }


def test_jobs_have_the_same_files():
    for job in JOBS:
        folder = PACKAGE / "jobs" / job
        assert {path.stem for path in folder.glob("*.py")} == IN_A_JOB | MORE_IN_A_JOB.get(job, set()), job
        assert (folder / "template.toml").is_file()


def mentions_casadi(source):
    """Say whether code, comments and documentation apart, speaks of CasADi."""
    for node in ast.walk(tree_of(source)):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import | ast.ImportFrom) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        names += [node.attr] if isinstance(node, ast.Attribute) else [node.id] if isinstance(node, ast.Name) else []
        if any("casadi" in name for name in names):
            return True
    return False


@pytest.mark.slow
def test_only_maths_and_the_solver_rooms_use_casadi():
    users = {room(name) for name, path in modules().items() if mentions_casadi(text_of(path))}
    assert users == {"maths", "solving"}
    assert mentions_casadi("from loomopt.maths import systems as maths\nmaths.casadi()")
    assert mentions_casadi("def f():\n    import casadi as ca")


def test_every_effect_is_in_a_file_of_its_name():
    files = {job: {p.stem for p in (PACKAGE / "physics" / "effects" / job).glob("*.py")} - {"__init__"} for job in JOBS}
    assert files == {job: set(kinds.of(f"loomopt.physics.effects.{job}")) for job in JOBS}


def test_ranks_of_a_jobs_effects_differ():
    for job in JOBS:
        ranks = [effect.rank for effect in kinds.of(f"loomopt.physics.effects.{job}").values()]
        assert len(set(ranks)) == len(ranks), job


def test_rows_are_read_in_one_place_and_names_are_never_parted():
    for name, path in modules().items():
        source = text_of(path)
        if room(name) != "model":
            assert not re.search(r"\b(limit|each)\.(weight|complement)\b", source), name
        assert not re.search(r"\.(family|form) [!=]=|__class__ =|\[case ", source), name
        if room(name) in {"model", "jobs", "solving", "studies", "interface"}:
            assert not re.search(r"r?(partition|split)\(\"\.\"", source), name


VECTORS = {"g", "lam_g", "lbg", "ubg", "lam_x", "lbx", "ubx"}
"""What an NLP's rows, its variables, their bounds and multipliers are called."""
SEE_ROWS = ("solving.nlp.", "solving.search.", "solving.engine", "studies.")
"""Folders and files that meet an NLP; certificates and proofs do without."""
ORDERED_IN = {"solving.nlp.rows"}
"""The file that knows their order."""


def counted(source):
    """Return the lines where a place in an NLP's rows or variables is counted: by an index, slice or new shape."""

    def is_vector(node):
        if isinstance(node, ast.Subscript):
            return isinstance(node.slice, ast.Constant) and node.slice.value in VECTORS
        return getattr(node, "attr", getattr(node, "id", "")) in VECTORS

    lines = []
    for node in ast.walk(tree_of(source)):
        if isinstance(node, ast.Subscript):
            lines += [node.lineno] if is_vector(node.value) else []
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            parted = node.func.attr in {"reshape", "split"} and any(map(is_vector, [node.func.value, *node.args]))
            lines += [node.lineno] if parted else []
    return lines


def test_the_order_of_an_nlps_rows_and_variables_is_known_in_one_file():
    files = {name: path for name, path in modules().items() if name.startswith(SEE_ROWS) and name not in ORDERED_IN}
    counts = {name: counted(text_of(path)) for name, path in files.items()}
    assert {name: lines for name, lines in counts.items() if lines} == {}


@pytest.mark.parametrize(
    "source",
    [
        "point.multipliers.lam_g[-len(nodes) * slots :]",
        "raw['lam_g'][:first]",
        "lam_x[k]",
        "lam_g.reshape(2, 3)",
        "np.split(lam_g, [3])",
        "arguments['ubg'][3:] = 1.0",
    ],
)
def test_a_place_that_is_counted_is_found(source):
    assert counted(source) == [1]


def test_rows_that_are_read_by_name_are_allowed():
    assert counted("rows.at_nodes(lam_g)[:2] = arguments['ubg']; np.all(values <= arguments['ubg'] + 1)") == []


def anything(path):
    """Return the lines of a file where a parameter, a field or a result is annotated with Any itself."""
    spots = []
    for node in ast.walk(parsed(path)):
        notes = [node.annotation] if isinstance(node, ast.arg | ast.AnnAssign) else []
        notes += [node.returns] if isinstance(node, ast.FunctionDef) else []
        spots += [note.lineno for note in notes if isinstance(note, ast.Name) and note.id == "Any"]
    return spots


def test_types_say_what_they_are():
    inside = {n: path for n, path in modules().items() if not n.startswith(tuple(WITHOUT_TYPES))}
    spots = {name: len(anything(path)) for name, path in inside.items() if anything(path)}
    assert sum(spots.values()) <= MOST_ANY, spots
    scenes = [name for name, path in modules().items() if re.search(r"\bscene: Any\b", text_of(path))]
    assert scenes == []


def test_tolerances_of_several_files_have_one_value_and_say_where_they_come_from():
    body = parsed(PACKAGE / "physics" / "tolerances.py").body
    assigned = [(k, node) for k, node in enumerate(body) if isinstance(node, ast.Assign)]
    names = [n.id for _, node in assigned for n in ast.walk(node.targets[0]) if isinstance(n, ast.Name)]
    assert len(set(names)) == len(names)
    for place, node in assigned:
        after = body[place + 1]
        message = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
        assert message, f"line {node.lineno}: nothing is said of it"
    others = {name: path for name, path in modules().items() if name != "physics.tolerances"}
    words = {name: set(re.findall(r"\w+", text_of(path))) for name, path in others.items()}
    for _, node in assigned:
        group = [n.id for n in ast.walk(node.targets[0]) if isinstance(n, ast.Name)]
        readers = {name for name, known in words.items() if not known.isdisjoint(group)}
        assert len(readers) > 1, f"{group}: a constant of one file stands there"
