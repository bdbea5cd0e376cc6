"""From a wheel in a fresh environment: a table of another program has a verdict in three commands, and a gate in five.

The environment takes its other packages from the one that runs the tests, so that nothing is fetched.
"""

import re
import shutil
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]
INTEGRATOR = '''
"""A program of somebody else: Runge-Kutta of order 4 for the top of the case lagrange; it knows nothing of heavytop."""
import sys

I, n = (2.5, 2.5, 1.5), (0.0, 0.0, 1.5)

def cross(a, b):
    return a[1]*b[2] - a[2]*b[1], a[2]*b[0] - a[0]*b[2], a[0]*b[1] - a[1]*b[0]

def slope(y):
    w, g = y[:3], y[3:]
    m = [i * x for i, x in zip(I, w)]
    return [(a + b) / i for a, b, i in zip(cross(m, w), cross(g, n), I)] + list(cross(g, w))

def step(y, h):
    a = slope(y)
    b = slope([x + h / 2 * s for x, s in zip(y, a)])
    c = slope([x + h / 2 * s for x, s in zip(y, b)])
    d = slope([x + h * s for x, s in zip(y, c)])
    return [x + h / 6 * (p + 2*q + 2*r + s) for x, p, q, r, s in zip(y, a, b, c, d)]

h, file = float(sys.argv[1]), open(sys.argv[2], "w")
y = [1/5, -1/3, 7/4, 2/7, 3/7, 6/7]
print("time;wx;wy;wz;gx;gy;gz", file=file)
for k in range(1, 11):
    for _ in range(round(1 / h)):
        y = step(y, h)
    print(k, *y, sep=";", file=file)
'''


def done(folder: Path, *line: object, code: int = 0) -> str:
    """What a command prints; it must end with that exit code."""
    parts = [str(part) for part in line]
    found = subprocess.run(parts, cwd=folder, capture_output=True, text=True, timeout=120, check=False)
    assert found.returncode == code, found.stderr
    return found.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("hatchling")
    folder = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"]
    done(ROOT, *pip, "--wheel-dir", folder, ROOT)
    (found,) = folder.glob("heavytop-*.whl")
    return found


def packages() -> str:
    """Where the other packages are, but not this project's own sources."""
    sources = str(ROOT / "src")
    return "\n".join(path for path in sys.path if path.endswith("site-packages") and path != sources) + "\n"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory, wheel: Path) -> tuple[Path, float]:
    """The first two of three commands, an environment and heavytop in it: the folder of its programs, and seconds."""
    folder, began = tmp_path_factory.mktemp("installed"), time.monotonic()
    done(folder, sys.executable, "-m", "venv", "--without-pip", "env")
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    site = folder / "env" / "lib" / version / "site-packages"
    (site / "others.pth").write_text(packages())
    # the packages that are lent to it may hold a heavytop, which is not the one to try
    pip = (sys.executable, "-m", "pip", "--python", "env/bin/python", "install", "--quiet", "--no-deps")
    done(folder, *pip, "--ignore-installed", wheel)
    return folder / "env" / "bin", time.monotonic() - began


def test_a_program_in_c_keeps_the_contract_in_three_commands(installed: tuple[Path, float], tmp_path: Path) -> None:
    """From nothing; `tests/support/from_a_wheel.py` goes on to its gate and to a mistake, as the README does."""
    if not all(map(shutil.which, ("cc", "make"))):
        pytest.skip("there is no compiler of C here")
    heavytop = installed[0] / "heavytop"
    done(tmp_path, heavytop, "new", "mine", "--language", "c")
    folder = tmp_path / "mine"
    starters = ROOT / "src" / "heavytop" / "api" / "starters"
    parts = [path for part in ("common", "c") for path in (starters / part).iterdir()]
    methods = {starters / "c" / f"{name}.txt" for name in ("step", "adaptive", "multistep")}  # one is in mine.c
    assert len([path for path in folder.rglob("*") if path.is_file()]) == len(set(parts) - methods)
    done(folder, "make")
    assert "Nothing is violated" in done(folder, heavytop, "check-integrator", "mine.toml")


@pytest.mark.skipif(sys.platform == "win32" or not sysconfig.get_path("purelib"), reason="paths of POSIX")
def test_a_table_of_another_program_has_a_verdict_and_a_gate(installed: tuple[Path, float], tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(INTEGRATOR)
    done(tmp_path, sys.executable, "mine.py", "0.01", "mine.csv")
    (programs, taken), began = installed, time.monotonic()
    heavytop = programs / "heavytop"
    # it is the wheel that runs, not the sources
    where = done(tmp_path, programs / "python", "-c", "import heavytop; print(heavytop.__file__)")
    assert str(programs.parent) in where
    # with its documentation, which messages refer to
    assert done(tmp_path, heavytop, "docs", "score") == (ROOT / "docs" / "score.md").read_text("utf-8")
    assert done(tmp_path, heavytop, "docs") == done(tmp_path, sys.executable, "-m", "heavytop", "docs")
    # the third command
    said = done(tmp_path, heavytop, "score", "mine.csv", "--case", "lagrange", "--html", "page.html")
    assert re.match(
        r"\d\.\d of 16 digits right at every sample up to T = 10; heyoka in double: 1\d\.\d\. ",
        " ".join(said.split()),
    )
    assert taken + time.monotonic() - began < 120
    assert "Digits right over time" in (tmp_path / "page.html").read_text("utf-8")
    # a gate: the next version of the program is worse, and the exit code says so
    for step, name in (("0.01", "old"), ("0.1", "new")):
        done(tmp_path, sys.executable, "mine.py", step, "mine.csv")
        done(tmp_path, heavytop, "score", "mine.csv", "--case", "lagrange", "--out", name)
    done(tmp_path, heavytop, "compare", "old", "old")
    assert "worse" in done(tmp_path, heavytop, "compare", "old", "new", code=1)
