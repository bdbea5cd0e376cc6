"""Bodies out of files of robots: every format, every slip, and bodies that are right."""

from __future__ import annotations

import json
import random
import sys
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path

import pytest

import heavytop as ht
from heavytop.top.body_files import read_body
from heavytop.top.inertia_slips import MassProperties, minus, realisable, rows, second_moments, six_of, slips, steiner
from support.in_process import heavytop

SIX = ("0.31", "0.28", "0.19", "0.05", "-0.02", "0.04")
"""I11, I22, I33, I12, I13, I23 of a body of 2.5 kg."""
URDF_ORDER = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def urdf(six: Sequence[str], mass: str = "2.5", centre: str = "0.1 0 0.2", extra: str = "", rpy: str = "0 0 0") -> str:
    values = dict(zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), six, strict=True))
    tensor = " ".join(f'{key}="{values[key]}"' for key in URDF_ORDER)
    return (
        f'<robot name="r"><link name="base"/><link name="arm"><inertial><origin xyz="{centre}" rpy="{rpy}"/>'
        f'<mass value="{mass}"/><inertia {tensor}/></inertial>{extra}</link></robot>'
    )


def mjcf(six: Sequence[str], mass: str = "2.5", centre: str = "0.1 0 0.2", extra: str = "", rpy: str = "0 0 0") -> str:
    return (
        f'<mujoco><worldbody><body name="arm"><inertial pos="{centre}" mass="{mass}" fullinertia="{" ".join(six)}"/>'
        f"{extra}</body></worldbody></mujoco>"
    )


def sdf(six: Sequence[str], mass: str = "2.5", centre: str = "0.1 0 0.2", extra: str = "", rpy: str = "0 0 0") -> str:
    tensor = "".join(
        f"<{key}>{value}</{key}>" for key, value in zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), six, strict=True)
    )
    return (
        f'<sdf version="1.9"><model name="m"><link name="arm"><inertial><pose>{centre} {rpy}</pose>'
        f"<mass>{mass}</mass><inertia>{tensor}</inertia></inertial>{extra}</link></model></sdf>"
    )


def toml(six: Sequence[str], mass: str = "2.5", centre: str = "0.1 0 0.2", extra: str = "", rpy: str = "0 0 0") -> str:
    about = extra or "centre of mass"
    return (
        f'mass = "{mass}"\ncentre = {json.dumps(centre.split())}\ninertia = {json.dumps(list(six))}\nabout = "{about}"'
    )


FORMATS: dict[str, Callable[..., str]] = {"urdf": urdf, "xml": mjcf, "sdf": sdf, "toml": toml}


def judged(path: Path, text: str, *options: str) -> tuple[int, dict[str, object]]:
    path.write_text(text)
    run = heavytop("body", path, "--json", *options)
    return run.returncode, json.loads(run.stdout)


def in_order(six: Sequence[str], places: Sequence[int]) -> list[str]:
    return [six[place] for place in places]


# The place of each number of D order (I11 I22 I33 I12 I13 I23) where the numbers were written in the other order.
SLIPS: dict[str, tuple[list[str], str]] = {
    "order_urdf": (in_order(SIX, (0, 3, 4, 1, 5, 2)), "mended"),
    "order_of_slots": (in_order(SIX, (0, 3, 5, 1, 2, 4)), "mended"),
    "row_major": (in_order(SIX, (0, 3, 4, 3, 1, 5)), "open"),
    "negative_moment": (["0.31", "-0.28", *SIX[2:]], "mended"),
    "rod": (["0", "0.28", "0.28", "0", "0", "0"], "same"),
    "millimetres": ([str(float(value) * 1e6) for value in SIX], "mended"),
}


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("slip", SLIPS)
def test_each_slip_is_named_in_each_format(tmp_path: Path, suffix: str, slip: str) -> None:
    six, mend = SLIPS[slip]
    if (slip, suffix) == ("millimetres", "toml"):
        pytest.skip("a TOML file has units of its own")
    code, document = judged(tmp_path / f"a.{suffix}", FORMATS[suffix](six))
    assert code == 1
    names = [each["name"] for each in document["slips"]]  # type: ignore[attr-defined, index]
    assert names[0] == {"order_of_slots": "order_urdf"}.get(slip, slip)
    mended = document["slips"][0]["inertia"]  # type: ignore[index]
    if mend == "mended":
        assert [float(value) for value in mended] == pytest.approx([float(value) for value in SIX], rel=1e-12)
    if mend == "open":
        assert mended[2] is None


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_right_body_is_one_and_its_numbers_are_exact(tmp_path: Path, suffix: str) -> None:
    code, document = judged(tmp_path / f"a.{suffix}", FORMATS[suffix](SIX))
    assert (code, document["realisable"], document["slips"]) == (0, True, [])
    assert document["mass"] == "2.5"
    assert document["centre"] == ["0.1", "0", "0.2"]
    assert document["inertia"] == list(SIX)


def test_signs_of_products_about_centre_and_about_pivot(tmp_path: Path) -> None:
    # all products p, moments d: d + 2p, d − p, d − p; with p = 0.07 the largest exceeds the sum, with −0.07 it does not
    assert judged(tmp_path / "a.urdf", urdf(["0.2"] * 3 + ["-0.07"] * 3))[0] == 0
    code, document = judged(tmp_path / "b.urdf", urdf(["0.2"] * 3 + ["0.07"] * 3))
    assert code == 1
    assert document["slips"][0]["name"] == "signs_of_products"  # type: ignore[index]
    central = judged(tmp_path / "c.toml", toml(SIX, centre="1 0 0.5", extra="pivot"))
    assert central[0] == 1
    assert central[1]["slips"][0]["name"] == "about_centre"  # type: ignore[index]
    diagonal = (Fraction("0.31"), Fraction("0.28"), Fraction("0.19"), Fraction(0), Fraction(0), Fraction(0))
    part = steiner(Fraction("2.5"), (Fraction("0.1"), Fraction(0), Fraction("0.2")))
    at_pivot = [str(float(a + b)) for a, b in zip(diagonal, six_of(part), strict=True)]
    code, document = judged(tmp_path / "d.urdf", urdf(at_pivot))
    assert code == 1
    assert document["slips"][0]["name"] == "about_pivot"  # type: ignore[index]


BOX = '<collision><origin xyz="0.1 0 0.2" rpy="0 0 0.7"/><geometry><box size="0.1 0.4 0.8"/></geometry></collision>'


def test_the_geometry_of_a_file_tells_conjugate_axes_grams_and_the_pivot(tmp_path: Path) -> None:
    mass, (a, b, c) = 2.5, (0.1, 0.4, 0.8)
    diagonal = [mass / 12 * (b * b + c * c), mass / 12 * (a * a + c * c), mass / 12 * (a * a + b * b), 0, 0, 0]
    texts = [f"{value:.12g}" for value in diagonal]
    right = judged(tmp_path / "right.urdf", urdf(texts, extra=BOX, rpy="0 0 0.7"))
    assert (right[0], right[1]["slips"]) == (0, [])
    cases = {
        "conjugate_axes": urdf(texts, extra=BOX, rpy="0 0 -0.7"),
        "grams": urdf([f"{value * 1000:.12g}" for value in diagonal], extra=BOX, rpy="0 0 0.7"),
        "millimetres": urdf([f"{value * 1e6:.12g}" for value in diagonal], extra=BOX, rpy="0 0 0.7"),
    }
    for name, text in cases.items():
        code, document = judged(tmp_path / f"{name}.urdf", text)
        assert (code, document["slips"][0]["name"]) == (1, name)  # type: ignore[index]
        mended = [float(value) for value in document["slips"][0]["inertia"]]  # type: ignore[index]
        assert mended == pytest.approx([float(value) for value in right[1]["inertia"]], rel=1e-9)  # type: ignore[union-attr]


def test_no_body_of_random_points_is_refused_and_no_material_is_too_dense() -> None:
    """Second moments of points are those of a body by construction; no slip is told of one of an ordinary density."""
    source = random.Random(4)
    for _ in range(200):
        points = [[Fraction(source.randint(-500, 500), 1000) for _ in range(3)] for _ in range(6)]
        middle = [sum(point[i] for point in points) / 6 for i in range(3)]
        s = [[sum((p[i] - middle[i]) * (p[j] - middle[j]) for p in points) for j in range(3)] for i in range(3)]
        trace = s[0][0] + s[1][1] + s[2][2]
        tensor = rows((trace - s[0][0], trace - s[1][1], trace - s[2][2], -s[0][1], -s[0][2], -s[1][2]))
        assert second_moments(tensor)[1][2] == s[1][2]
        assert realisable(tensor)
        assert (
            slips(MassProperties(six_of(tensor), Fraction(6), (Fraction(0), Fraction(0), Fraction(0)), si=True)) == []
        )
        largest = max(trace - s[i][i] for i in range(3))
        assert not realisable(minus(tensor, rows((largest, *[Fraction(0)] * 5))))


def test_a_tensor_multiplied_in_double_is_read_by_its_upper_entries(tmp_path: Path) -> None:
    """Rounded in the last bit below the diagonal; and its first six numbers, written row by row into six places."""
    nine = [0.3, 0.05, -0.02, 0.05 + 2**-57, 0.28, 0.04, -0.02, 0.04, 0.19]
    body = ht.Body(1, 9.81, (0, 0, 0), nine)
    assert body.tensor[1][0] == body.tensor[0][1] == Fraction(0.05)
    assert judged(tmp_path / "a.toml", f"mass = 1\ninertia = {nine}")[0] == 0
    code, document = judged(tmp_path / "a.urdf", urdf([repr(nine[i]) for i in (0, 3, 5, 1, 2, 4)]))
    assert (code, document["slips"][0]["name"]) == (1, "row_major")  # type: ignore[index]


def test_no_mass_anywhere_is_no_body(tmp_path: Path) -> None:
    code, document = judged(tmp_path / "a.urdf", urdf(["0.0"] * 6))
    assert (code, document["slips"][0]["name"]) == (1, "point_mass")  # type: ignore[index]


def test_a_plate_in_printed_digits_is_a_body(tmp_path: Path) -> None:
    code, _ = judged(tmp_path / "plate.urdf", urdf(["0.000833", "0.000833", "0.001667", "0", "0", "0"], mass="1"))
    assert code == 0
    code, document = judged(tmp_path / "no.urdf", urdf(["0.000833", "0.000833", "0.001671", "0", "0", "0"], mass="1"))
    assert (code, document["realisable"]) == (1, False)


def test_free_rotations_are_said_to_be_stable_or_not(tmp_path: Path) -> None:
    """About the middle axis of moments 3, 2, 4 the rate is √((4 − 3)(3 − 2)/(4·2)) of the angular velocity."""
    _, document = judged(tmp_path / "a.urdf", urdf(["3", "2", "4", "0", "0", "0"], mass="9", centre="0 0 0"))
    rotations = document["rotations"]
    assert [rotation["verdict"] for rotation in rotations] == ["unstable", "stable", "stable"]  # type: ignore[attr-defined]
    assert rotations[0]["rate"] == pytest.approx(8**-0.5)  # type: ignore[index]
    shown = heavytop("body", tmp_path / "a.urdf").stdout
    assert "about axis 1: unstable, rate 0.3536 of the angular velocity" in shown
    _, document = judged(tmp_path / "b.urdf", urdf(["0.1", "0.1", "0.05", "0", "0", "0"], mass="9", centre="0 0 0"))
    assert [rotation["verdict"] for rotation in document["rotations"]] == ["unstable", "unstable", "stable"]  # type: ignore[attr-defined]
    shown = " ".join(heavytop("body", tmp_path / "b.urdf").stdout.split())
    assert (
        "about axis 1: unstable: a part ε of Ω along the axis of symmetry turns it away linearly, by 0.5 ε t" in shown
    )


def test_usd_and_the_ball_joint_of_mjcf(tmp_path: Path) -> None:
    text = """#usda 1.0
(
    metersPerUnit = 0.01
)
def Xform "arm" (prepend apiSchemas = ["PhysicsMassAPI"])
{
    float physics:mass = 2
    point3f physics:centerOfMass = (10, 0, 20)
    float3 physics:diagonalInertia = (300, 200, 400)
    quatf physics:principalAxes = (0, 1, 0, 0)
}
"""
    code, document = judged(tmp_path / "a.usda", text)
    assert (code, document["centre"], document["inertia"][:3]) == (0, ["0.1", "0", "0.2"], ["0.03", "0.02", "0.04"])  # type: ignore[index]
    joint = '<joint type="ball" pos="0 0 0.2"/>'
    code, document = judged(tmp_path / "b.xml", mjcf(SIX, extra=joint))
    assert document["centre"] == ["0.1", "0", "0"]
    code, document = judged(tmp_path / "b.xml", mjcf(SIX, extra=joint), "--pivot", "0.1,0,0.1")
    assert document["centre"] == ["0", "0", "0.1"]


def test_usd_in_binary_in_packages_and_in_instances(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    from pxr import Gf, Usd, UsdGeom, UsdPhysics, UsdUtils

    def stage(name: str) -> Usd.Stage:
        made = Usd.Stage.CreateNew(str(tmp_path / name))
        UsdGeom.SetStageMetersPerUnit(made, 0.01)
        return made

    layer = stage("a.usdc")
    layer.SetDefaultPrim(layer.DefinePrim("/r", "Xform"))
    mass = UsdPhysics.MassAPI.Apply(layer.DefinePrim("/r/arm", "Xform"))
    mass.CreateMassAttr().Set(2.5, 1.0)  # a time sample
    mass.CreateCenterOfMassAttr(Gf.Vec3f(10, 0, 20))
    mass.CreateDiagonalInertiaAttr(Gf.Vec3f(3100, 2800, 1900))
    mass.CreatePrincipalAxesAttr(Gf.Quatf(0.8, 0, 0.6, 0))
    layer.Save()
    UsdUtils.CreateNewUsdzPackage(str(tmp_path / "a.usdc"), str(tmp_path / "b.usdz"))
    for name, target in (("c.usdc", "a.usdc"), ("d.usda", "gone.usdc")):
        layer = stage(name)
        robot = layer.DefinePrim("/robot")
        robot.GetReferences().AddReference(target)
        robot.SetInstanceable(True)
        layer.Save()
    (tmp_path / "e.usdc").write_bytes((tmp_path / "a.usdc").read_bytes()[:200])
    for name in ("a.usdc", "b.usdz", "c.usdc"):
        body = read_body(tmp_path / name, "arm")
        assert (body.mass, body.centre) == (Fraction("2.5"), (Fraction("0.1"), 0, Fraction("0.2")))
        assert body.six == tuple(map(Fraction, ("0.199408", "0.28", "0.300592", "0", "-0.032256", "0")))
    for name, says in (("d.usda", "Could not open asset @gone.usdc@"), ("e.usdc", "possibly truncated")):
        run = heavytop("body", tmp_path / name)
        assert run.returncode == 2
        assert says in run.stderr and "Error in '" not in run.stderr  # noqa: PT018


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.urdf", '<!DOCTYPE r [<!ENTITY x "y">]><robot name="&x;"/>', "declares entities"),
        ("a.urdf", "<robot", "is not XML"),
        ("a.urdf", "<html/>", "root <html>"),
        ("a.urdf", '<robot name="r"><link name="a"/></robot>', "holds no mass properties"),
        ("a.txt", "1 2 3", "in no format that is known"),
        ("a.urdf", urdf(["a", *SIX[1:]]), "ixx = 'a'"),
        ("a.urdf", urdf(SIX, mass="1e-400"), "1e-30 to 1e30"),
        ("a.urdf", urdf(["1e-300", "1e-300", "1e-300", "0", "0", "0"]), "1e-30 to 1e30"),
        ("a.urdf", urdf(SIX, centre="0 0 1e300"), "1e-30 to 1e30"),
        ("a.xml", mjcf([*SIX, "1", "2", "3"]), "fullinertia has 9 numbers"),
        ("a.toml", "mass = [", "is not TOML"),
        ("a.usd", "PXR-USDC....", "binary USD"),
    ],
)
def test_what_cannot_be_read_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, text: str, says: str
) -> None:
    monkeypatch.setitem(sys.modules, "pxr", None)
    (tmp_path / name).write_text(text)
    run = heavytop("body", tmp_path / name)
    assert run.returncode == 2
    assert says in run.stderr
    assert not run.stdout


def test_several_links_want_a_name(tmp_path: Path) -> None:
    path = tmp_path / "a.urdf"
    path.write_text(urdf(SIX).replace("</robot>", urdf(SIX).partition('<link name="base"/>')[2].replace("arm", "hand")))
    assert "holds 2 bodies: arm, hand" in heavytop("body", path).stderr
    assert heavytop("body", path, "--link", "hand").returncode == 0
    assert heavytop("body", path, "--link", "foot").returncode == 2
    path.write_text(path.read_text().replace('"2.5"', '"${m}"', 1))
    assert heavytop("body", path, "--link", "hand").returncode == 0, "a fault of another link is no fault of this one"
    assert heavytop("body", path, "--link", "arm").returncode == 2
    model = sdf(SIX)[19:-6]
    other = model.replace('name="m"', 'name="n"')
    (world := tmp_path / "world.sdf").write_text(f"<sdf><world>{model}{other}</world></sdf>")
    assert "m::arm, n::arm" in heavytop("body", world).stderr
    assert heavytop("body", world, "--link", "n::arm").returncode == 0


def test_a_file_stands_where_a_body_may(tmp_path: Path) -> None:
    path = tmp_path / "a.urdf"
    path.write_text(urdf(SIX))
    body = ht.Body.from_file(path)
    assert body == ht.Body("2.5", "9.81", ("0.1", "0", "0.2"), SIX, "centre of mass")
    assert read_body(path).mass == Fraction(5, 2)
    table = heavytop("body", path, "--json").stdout
    plan = tmp_path / "plan.toml"
    start = 'omega = ["1", "2", "3"]\nquaternion = ["1", "0", "0", "0"]\n'
    drift = '[[measure]]\nkind = "drift"\ncases = ["mine"]\nruns = [{ precision = "double", horizon = "1" }]\n'
    plan.write_text(f'name = "own"\n[[top]]\nname = "mine"\nfile = "{path}"\n{start}{drift}')
    run = heavytop("run", "--plan", plan, "--out", tmp_path / "report", "--workers", "1")
    assert run.returncode == 0, run.stderr
    own = tmp_path / "own.toml"
    own.write_text(json.loads(table)["toml"])
    assert read_body(own).six == read_body(path).six


def test_the_command_that_it_prints_runs(tmp_path: Path) -> None:
    import shlex

    path = tmp_path / "a.urdf"
    path.write_text(urdf(SIX))
    printed = heavytop("body", path).stdout
    assert max(map(len, printed.splitlines())) <= 80
    command = printed.partition("free tumble:")[2].replace("\\\n", "")
    assert heavytop(*shlex.split(command)[1:]).returncode == 0


def test_the_command_line_takes_a_body_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(urdf(SIX))
    start = ("--omega", "1,2,3", "--quaternion", "1,0,0,0", "--times", "1")
    run = json.loads(heavytop("propagate", "--file", path, *start, "--json").stdout)
    state = ht.State(omega=(1, 2, 3), attitude=ht.Attitude.quaternion(1, 0, 0, 0))
    assert run["states"] == ht.propagate(ht.Body.from_file(path), state, ["1"], attitude=False).texts()
    known = json.loads(
        heavytop("reference", "--file", path, "--gravity", "0", *start, "--digits", "20", "--json").stdout
    )
    assert known["method"].startswith("validated")
    for extra, words in ((("--mass", "1"), "--file and --mass were given"), (("--link", "leg"), "has no link 'leg'")):
        done = heavytop("propagate", "--file", path, *extra, *start)
        assert done.returncode == 2
        assert words in done.stderr


RIGHT_AS_WRITTEN: dict[str, tuple[str, bytes]] = {
    "a default namespace": ("urdf", urdf(SIX).replace("<robot ", '<robot xmlns="http://www.ros.org" ').encode()),
    "a mark of UTF-8": ("urdf", b"\xef\xbb\xbf" + urdf(SIX).encode()),
    "UTF-16": ("urdf", ('<?xml version="1.0" encoding="utf-16"?>' + urdf(SIX)).encode("utf-16")),
    "Latin-1": ("urdf", ('<?xml version="1.0" encoding="latin-1"?><!-- \xe9 -->' + urdf(SIX)).encode("latin-1")),
    "lines of Windows": ("sdf", b"\r\n" + sdf(SIX).replace("><", ">\r\n<").encode()),
    "an included file": (
        "xml",
        mjcf(SIX).replace("mujoco>", "mujocoinclude>").replace("<worldbody>", "").replace("</worldbody>", "").encode(),
    ),
}


@pytest.mark.parametrize("name", RIGHT_AS_WRITTEN)
def test_a_right_file_is_read_however_it_is_written(name: str, tmp_path: Path) -> None:
    suffix, content = RIGHT_AS_WRITTEN[name]
    (path := tmp_path / f"arm.{suffix}").write_bytes(content)
    assert read_body(path).six == tuple(map(Fraction, SIX))


REFUSED: dict[str, tuple[str, str, str]] = {
    "xacro": ("urdf", urdf(SIX, mass="${m}"), "xacro FILE -o FILE.urdf"),
    "a mass of 0": ("urdf", urdf(SIX, mass="0"), "mass must be positive; got 0"),
    "inertiafromgeom": (
        "xml",
        mjcf(SIX).replace("<worldbody>", '<compiler inertiafromgeom="true"/><worldbody>'),
        "saveLastXML",
    ),
    "geoms alone": ("xml", '<mujoco><worldbody><body><geom size="1"/></body></worldbody></mujoco>', "saveLastXML"),
    "fullinertia turned": ("xml", mjcf(SIX).replace("<inertial ", '<inertial quat="1 0 0 0" '), "contradict"),
    "auto": ("sdf", sdf(SIX).replace("<inertial>", '<inertial auto="true">'), "expand-auto-inertials"),
    "a matrix that is not symmetric": (
        "toml",
        "mass = 1\ncentre = [0, 0, 0]\ninertia = [[1, 2, 0], [0, 1, 0], [0, 0, 1]]",
        "symmetric",
    ),
    "no word on the point": ("toml", "mass = 1\ncentre = [1, 0, 0]\ninertia = [1, 1, 1]", "about"),
    "a tensor of zeros": (
        "usda",
        '#usda 1.0\ndef "a" {\n physics:mass = 1\n physics:diagonalInertia = (0, 0, 0)\n}',
        "in numbers",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_another_program_has_to_compute_is_refused_with_the_way_out(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    suffix, text, remedy = REFUSED[name]
    (path := tmp_path / f"arm.{suffix}").write_text(text)
    run = heavytop("body", path)
    assert run.returncode == 2
    assert remedy in run.stderr


@pytest.mark.parametrize(
    "frame",
    [
        'euler="90 0 0"',
        'axisangle="2 0 0 90"',
        'xyaxes="3 0 0 5 0 2"',
        'zaxis="0 -7 0"',
        'quat="1 1 0 0"',
    ],
)
def test_every_frame_of_mjcf_is_read(frame: str, tmp_path: Path) -> None:
    """A quarter of a turn about x exchanges the second and the third moment."""
    (path := tmp_path / "arm.xml").write_text(
        '<mujoco><worldbody><body><geom type="mesh" mesh="m"/>'
        f'<inertial pos="0 0 0" mass="1" diaginertia="2 3 4" {frame}/></body></worldbody></mujoco>'
    )
    assert [round(float(value), 15) for value in read_body(path).six] == [2, 4, 3, 0, 0, 0]


def test_shapes_of_mjcf_are_those_of_their_default_class(tmp_path: Path) -> None:
    """The tensor of a box turned the other way, whose size and type are those of a class within another."""
    (path := tmp_path / "arm.xml").write_text(
        '<mujoco><default><geom size=".05 .2 .4"/><default class="b"><geom type="box"/></default></default>'
        '<worldbody><body><geom class="b" euler="0 0 40"/>'
        '<inertial pos="0 0 0" mass="12" diaginertia="0.8 0.65 0.17" euler="0 0 -40"/></body></worldbody></mujoco>'
    )
    assert judged(path, path.read_text())[1]["slips"][0]["name"] == "conjugate_axes"  # type: ignore[index]


def test_angles_of_mjcf_are_of_its_sequence_and_a_ball_joint_of_its_class(tmp_path: Path) -> None:
    """Principal moments 3, 2, 1.5 turned by 90 degrees about z, then about the turned y; and about the fixed y."""
    path = tmp_path / "arm.xml"
    inertial = '<inertial pos="0 0 0" mass="1" diaginertia="3 2 1.5" euler="90 90 0"/>'
    for sequence, moments in (("zyx", (2, Fraction(3, 2), 3)), ("ZYX", (Fraction(3, 2), 3, 2))):
        path.write_text(
            f'<mujoco><compiler eulerseq="{sequence}"/><default><default class="b"><joint type="ball"/></default>'
            f'</default><worldbody><body childclass="b"><joint pos="0 0 -1"/>{inertial}</body></worldbody></mujoco>'
        )
        found = read_body(path)
        assert found.six[:3] == moments
        assert found.joint == (0, 0, -1)


INERTIAL = '<inertial><origin xyz="0.1 0 0.2"/><mass value="2"/><inertia ixx="1" iyy="1" izz="1" {}/></inertial>'
PRODUCTS = 'ixy="0" ixz="0.1" iyz="0"'


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("ixz=", "Ixz=", "unknown attribute Ixz of <inertia>"),
        ('ixz="0.1"', "", "ixz is missing"),
        (PRODUCTS, "", "ixy is missing"),
        ("xyz=", "xzy=", "unknown attribute xzy of <origin>"),
        ("value=", "Value=", "unknown attribute Value of <mass>"),
        ("<inertial>", '<inertial auto="true">', "unknown attribute auto of <inertial>"),
        ('<origin xyz="0.1 0 0.2"/>', '<Origin xyz="0.1 0 0.2"/>', "unknown element Origin of <inertial>"),
        ('xyz="0.1 0 0.2"', 'rpy="0 0 0" quat_xyzw="0 0 0 1"', "origin has rpy and quat_xyzw"),
    ],
)
def test_what_a_urdf_misspells_or_leaves_out_is_named(tmp_path: Path, old: str, new: str, fault: str) -> None:
    text = f'<robot name="r"><link name="leg">{INERTIAL.format(PRODUCTS)}</link></robot>'
    path = tmp_path / "a.urdf"
    path.write_text(text)
    assert ht.Body.from_file(path).tensor[0][2] != 0
    path.write_text(text.replace(old, new))
    run = heavytop("body", path)
    assert (run.returncode, fault in run.stderr) == (2, True), run.stderr


def test_misspelt_numbers_of_sdf_and_mjcf_are_named_and_the_defaults_of_sdf_hold(tmp_path: Path) -> None:
    path = tmp_path / "a.sdf"
    path.write_text(sdf(SIX).replace("<ixz>-0.02</ixz>", ""))
    assert read_body(path).six == (*map(Fraction, SIX[:4]), 0, Fraction(SIX[5]))
    path.write_text(sdf(SIX).replace("ixz>", "Ixz>"))
    with pytest.raises(ht.InputError, match="unknown element Ixz of <inertia>"):
        read_body(path)
    path.write_text(sdf(SIX).replace("<pose>", '<pose degree="true">'))
    with pytest.raises(ht.InputError, match="unknown attribute degree of <pose>"):
        read_body(path)
    path.write_text(mjcf(SIX).replace("pos=", 'Quat="0 1 0 0" pos='))
    with pytest.raises(ht.InputError, match="unknown attribute Quat of <inertial>"):
        read_body(path)


def test_attributes_of_the_schema_and_of_namespaces_are_read(tmp_path: Path) -> None:
    path = tmp_path / "a.urdf"
    turned = urdf(SIX).replace('rpy="0 0 0"', 'quat_xyzw="0 0 1 0" x:note="1"').replace("<robot", '<robot xmlns:x="x"')
    path.write_text(turned)
    assert read_body(path).six[3:] == (Fraction("0.05"), Fraction("0.02"), Fraction("-0.04"))


def test_corrected_mass_and_centre_are_printed_and_nothing_is_null(tmp_path: Path) -> None:
    path = tmp_path / "a.urdf"
    for text, expected in (
        (urdf(SIX, mass="1e4"), 'corrected: mass = "10"'),
        (urdf(SIX, centre="100 0 200"), 'corrected: centre = ["0.1", "0", "0.2"]'),
        (urdf(SLIPS["row_major"][0]), "corrected: I11 = 0.31, I22 = 0.28, I12 = 0.05, I13 = -0.02, I23 = 0.04"),
    ):
        path.write_text(text)
        output = heavytop("body", path).stdout
        assert expected in output
        assert "null" not in output


def test_a_link_is_chosen_from_python_as_the_message_says(tmp_path: Path) -> None:
    path = tmp_path / "a.urdf"
    path.write_text(urdf(SIX).replace("</robot>", f'<link name="leg">{INERTIAL.format(PRODUCTS)}</link></robot>'))
    with pytest.raises(ht.InputError, match='link="arm" in Python'):
        ht.Body.from_file(path)
    assert ht.Body.from_file(path, link="leg").mass == 2


SHAPE = '<visual><origin xyz="0 0 .3"/><geometry><box size=".1 .3 .6"/></geometry></visual>'
UNIFORM = (0.075, 0.37 / 6, 1 / 60)
"""Moments of 2 kg in that box."""
TWICE = (0.075 - 0.18, 0.37 / 6 - 0.18, 1 / 60)
"""Less Steiner's part, 2 · 0.3²."""


@pytest.mark.parametrize(
    ("moments", "shape", "names"),
    [
        (TWICE, SHAPE, ["about_centre"]),
        (TWICE, "", ["about_centre", "negative_moment"]),
        ([2 * TWICE[0] / 3, 2 * TWICE[1] / 3, 0.02], SHAPE, ["about_centre"]),
        ([1e4 * value for value in UNIFORM], SHAPE, ["centimetres"]),
        ([1e4 * value for value in UNIFORM], "", ["centimetres", "grams"]),
        ([value / 0.0254**2 for value in UNIFORM], SHAPE, ["inches"]),
        ([value / 0.0254**2 / 0.45359237 for value in UNIFORM], SHAPE, ["inches"]),
        ([1e7 * value for value in UNIFORM], SHAPE, ["grams"]),
        ([40 * value for value in UNIFORM], SHAPE, ["beyond_shape"]),
        ([2.9 * value for value in UNIFORM], SHAPE, []),
        ([UNIFORM[1], UNIFORM[2], UNIFORM[0]], SHAPE, ["exchanged_axes"]),
        ([-UNIFORM[0], -UNIFORM[1], UNIFORM[2]], SHAPE, ["negative_moment"]),
    ],
)
def test_a_slip_agrees_with_the_shape_in_the_same_file(
    tmp_path: Path, moments: Sequence[float], shape: str, names: list[str]
) -> None:
    six = [repr(value) for value in (*moments, 0.0, 0.0, 0.0)]
    document = judged(tmp_path / "a.urdf", urdf(six, mass="2", centre="0 0 .3", extra=shape))[1]
    assert [slip["name"] for slip in document["slips"]] == names  # type: ignore[attr-defined, index]
    if names and shape and names != ["beyond_shape"] and sum(moments) != pytest.approx(2 * sum(TWICE[:2]) / 3 + 0.02):
        mended = [float(value) for value in document["slips"][0]["inertia"]]  # type: ignore[index]
        assert mended[:3] == pytest.approx(UNIFORM, rel=1e-9)


def test_one_sign_of_three_products_is_named_by_the_shape(tmp_path: Path) -> None:
    turned = SHAPE.replace('xyz="0 0 .3"', 'xyz="0 0 .3" rpy=".5 .4 .3"')
    right = urdf([repr(value) for value in (*UNIFORM, 0.0, 0.0, 0.0)], "2", "0 0 .3", turned, ".5 .4 .3")
    (path := tmp_path / "a.urdf").write_text(right)
    six = [repr(float(value)) for value in read_body(path).six]
    assert judged(path, urdf(six, "2", "0 0 .3", turned))[0] == 0
    six[4] = repr(-float(six[4]))
    code, document = judged(path, urdf(six, "2", "0 0 .3", turned))
    assert (code, document["slips"][0]["name"]) == (1, "signs_of_products")  # type: ignore[index]


BALL = '<inertial pos="0.1 0 0.2" mass="2" diaginertia="0.03 0.05 0.04"/>'
FRAMED = f'<frame euler="0 0 90" pos="0 0 1">{BALL}</frame>'
LINK = (
    '<sdf version="1.9">{before}<model name="m"><frame name="f"><pose degrees="1">0 0 0 0 0 90</pose></frame>'
    '<frame name="g" attached_to="arm"><pose>1 0 0 0 0 0</pose></frame><link name="arm"><pose>0 0 1 0 0 0</pose>'
    "{exempt}<inertial><pose {form}>0.1 0 0.2 {angles}</pose><mass>2</mass><inertia><ixx>0.03</ixx><iyy>0.05</iyy>"
    "<izz>0.04</izz></inertia></inertial></link>{joint}</model>{after}</sdf>"
)
JOINT = '<joint name="j" type="ball"><parent>world</parent><child>{}</child><pose {}>0 0 -0.5 0 0 0</pose></joint>'


def in_mjcf(body: str, before: str = "") -> tuple[str, str]:
    return "xml", f'<mujoco>{before}<worldbody><body name="arm">{body}</body></worldbody></mujoco>'


def in_sdf(
    form: str = "", angles: str = "0 0 0", joint: str = "", gravity: str = "", exempt: str = ""
) -> tuple[str, str]:
    around = (f'<world name="w">{gravity}', "</world>") if gravity else ("", "")
    return "sdf", LINK.format(form=form, angles=angles, joint=joint, before=around[0], after=around[1], exempt=exempt)


# As MuJoCo 4.0.0 and Drake 1.56 read them: centre of mass from the pivot, mass, I11 I22 I33, gravity.
READ = {
    "bounds": (in_mjcf(BALL, '<compiler boundmass="5" boundinertia=".045"/>'), "0.1 0 0.2 5 0.045 0.05 0.045 9.81"),
    "joint in a frame": (
        in_mjcf(f'<frame pos="0 0 1"><joint type="ball"/></frame>{BALL}'),
        "0.1 0 -0.8 2 0.03 0.05 0.04 9.81",
    ),
    "inertial in a frame": (in_mjcf(FRAMED), "0 0.1 1.2 2 0.05 0.03 0.04 9.81"),
    "gravity": (in_mjcf(BALL, '<option gravity="0 0 -1.62"/>'), "0.1 0 0.2 2 0.03 0.05 0.04 1.62"),
    "no gravity": (in_mjcf(BALL, '<option><flag gravity="disable"/></option>'), "0.1 0 0.2 2 0.03 0.05 0.04 0"),
    "degrees": (in_sdf('degrees="1"', "90 90 0"), "0.1 0 0.2 2 0.05 0.04 0.03 9.81"),
    "ball": (in_sdf(joint=JOINT.format("arm", "")), "0.1 0 0.7 2 0.03 0.05 0.04 9.81"),
    "ball in the model": (
        in_sdf(joint=JOINT.format("arm", 'relative_to="f"')),
        "0.1 0 1.7 2 0.03 0.05 0.04 9.81",
    ),
    "ball of a frame": (in_sdf(joint=JOINT.format("g", "")), "-0.9 0 0.7 2 0.03 0.05 0.04 9.81"),
    "moon": (in_sdf(gravity="<gravity>0 0 -1.62</gravity>"), "0.1 0 0.2 2 0.03 0.05 0.04 1.62"),
    "world": (in_sdf(gravity="<gui/>"), "0.1 0 0.2 2 0.03 0.05 0.04 9.8"),
    "exempt": (in_sdf(exempt="<gravity>0</gravity>"), "0.1 0 0.2 2 0.03 0.05 0.04 0"),
}


@pytest.mark.parametrize("name", READ)
def test_frames_joints_bounds_and_gravity_are_those_of_the_format(tmp_path: Path, name: str) -> None:
    (suffix, text), numbers = READ[name]
    (path := tmp_path / f"a.{suffix}").write_text(text)
    body, expected = read_body(path), [Fraction(number) for number in numbers.split()]
    given = body.about(None)
    assert [*given.centre, given.mass, *given.six[:3], body.gravity_down] == expected
    assert ht.Body.from_file(path).gravity == expected[-1]
    assert f'gravity = "{numbers.split()[-1]}"' in heavytop("body", path).stdout
    assert ht.Body.from_file(path, gravity=3).gravity == 3


UNREAD = {
    "two tensors": (in_mjcf(BALL.replace("/>", ' fullinertia="1 1 1 0 0 0"/>')), "fullinertia and diaginertia"),
    "two inertials": (in_mjcf(BALL + FRAMED), "2 inertials"),
    "two orientations": (in_mjcf(BALL.replace("pos", 'euler="0 0 1" quat="1 0 0 0" pos')), "quat and euler"),
    "a bound": (("xml", mjcf(SIX).replace("<world", '<compiler boundinertia=".2"/><world')), "boundinertia"),
    "global": (in_mjcf(BALL, '<compiler coordinate="global"/>'), "MuJoCo 2.3.3"),
    "fused": (in_mjcf(BALL, '<compiler fusestatic="true"/>'), "fusestatic"),
    "gravity along y": (in_mjcf(BALL, '<option gravity="0 -9.81 0"/>'), "--gravity"),
    "no boolean": (in_sdf('degrees="yes"'), "degrees must be true or false; got 'yes'"),
    "quaternion": (in_sdf('rotation_format="quat_xyzw" degrees="true"', "0 0 0 1"), "without degrees"),
    "format": (in_sdf('rotation_format="xyz"'), "euler_rpy"),
    "inertial elsewhere": (in_sdf('relative_to="f"'), "relative_to 'f'"),
    "two balls": (in_sdf(joint=2 * JOINT.format("arm", "")), "2 ball joints"),
    "a frame of none": (in_sdf(joint=JOINT.format("arm", 'relative_to="q"')), "no frame 'q'"),
    "a circle": (in_sdf(joint=JOINT.format("arm", 'relative_to="j"')), "circle"),
    "another model": (in_sdf(joint=JOINT.format("n::arm", "")), "another model"),
    "a fluid": (("sdf", sdf(SIX).replace("<mass>", "<fluid_added_mass/><mass>")), "fluid"),
    "a rotor": (("toml", 'mass = 1\ninertia = [1, 1, 1]\nrotor = [0, 0, 1]'), "rotor"),
}  # fmt: skip


@pytest.mark.parametrize("name", UNREAD)
def test_what_a_format_defines_and_is_not_read_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    (suffix, text), fault = UNREAD[name]
    (path := tmp_path / f"a.{suffix}").write_text(text)
    run = heavytop("body", path)
    assert (run.returncode, fault in run.stderr) == (2, True), run.stderr
