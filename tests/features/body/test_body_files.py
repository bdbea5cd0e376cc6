"""Bodies out of files of robots: every format, every slip, and bodies that are right."""

import json
import random
import sys
from collections.abc import Sequence
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import heavytop as ht
from heavytop.top.body_files import read_body
from heavytop.top.inertia_slips import MassProperties, minus, realisable, rows, second_moments, six_of, slips, steiner
from support.in_process import heavytop

SIX = ("0.31", "0.28", "0.19", "0.05", "-0.02", "0.04")
"""I11, I22, I33, I12, I13, I23 of a body of 2.5 kg."""
FORMATS = {
    "urdf": '<robot name="r"><link name="base"/><link name="arm"><inertial><origin xyz="{centre}" rpy="{rpy}"/>'
    '<mass value="{mass}"/><inertia ixx="{0}" ixy="{3}" ixz="{4}" iyy="{1}" iyz="{5}" izz="{2}"/></inertial>'
    "{extra}</link></robot>",
    "xml": '<mujoco><worldbody><body name="arm"><inertial pos="{centre}" mass="{mass}" fullinertia="{texts}"/>'
    "{extra}</body></worldbody></mujoco>",
    "sdf": '<sdf version="1.9"><model name="m"><link name="arm"><inertial><pose>{centre} {rpy}</pose>'
    "<mass>{mass}</mass><inertia><ixx>{0}</ixx><iyy>{1}</iyy><izz>{2}</izz><ixy>{3}</ixy><ixz>{4}</ixz><iyz>{5}</iyz>"
    "</inertia></inertial>{extra}</link></model></sdf>",
    "toml": 'mass = "{mass}"\ncentre = {place}\ninertia = {six}\nabout = "{about}"',
}


def written(
    suffix: str, six: Sequence[str], mass: str = "2.5", centre: str = "0.1 0 0.2", extra: str = "", rpy: str = "0 0 0"
) -> str:
    """The file of this format of six numbers, or of three moments."""
    six = [*six, "0", "0", "0"] if len(six) == 3 else [*six]
    parts = {"mass": mass, "centre": centre, "extra": extra, "rpy": rpy, "about": extra or "centre of mass"}
    return FORMATS[suffix].format(*six, six=six, texts=" ".join(six), place=centre.split(), **parts)


urdf, mjcf, sdf, toml = (partial(written, suffix) for suffix in FORMATS)


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """A right file."""
    (path := tmp_path / "a.urdf").write_text(urdf(SIX))
    return path


def judged(path: Path, text: str, *options: str) -> tuple[int, Any]:
    path.write_text(text)
    run = heavytop("body", path, "--json", *options)
    return run.returncode, json.loads(run.stdout)


def first_slip(path: Path, text: str) -> tuple[int, str]:
    code, document = judged(path, text)
    return code, document["slips"][0]["name"]


def floats(values: Sequence[str]) -> list[float]:
    return [float(value) for value in values]


def in_order(six: Sequence[str], places: Sequence[int]) -> list[str]:
    return [six[place] for place in places]


# The place of each number of D order (I11 I22 I33 I12 I13 I23) where the numbers were written in the other order.
SLIPS: dict[str, tuple[list[str], str]] = {
    "order_urdf": (in_order(SIX, (0, 3, 4, 1, 5, 2)), "mended"),
    "order_of_slots": (in_order(SIX, (0, 3, 5, 1, 2, 4)), "mended"),
    "row_major": (in_order(SIX, (0, 3, 4, 3, 1, 5)), "open"),
    "negative_moment": (["0.31", "-0.28", *SIX[2:]], "mended"),
    "rod": (["0", "0.28", "0.28", "0", "0", "0"], "same"),
    "rod in three digits": (["0.126", "0.214", "0.338", "0.163", "-0.0147", "0.0112"], "same"),
    "rod turned": (["0.506", "0.526", "0.775", "-0.387", "0.226", "0.22"], "same"),  # smallest moment 0.00044
    "millimetres": ([str(float(value) * 1e6) for value in SIX], "mended"),
}


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("slip", SLIPS)
def test_each_slip_is_named_in_each_format(tmp_path: Path, suffix: str, slip: str) -> None:
    six, mend = SLIPS[slip]
    if (slip, suffix) == ("millimetres", "toml"):
        pytest.skip("a TOML file has units of its own")
    code, document = judged(tmp_path / f"a.{suffix}", written(suffix, six))
    assert code == 1
    assert document["slips"][0]["name"] == {"order_of_slots": "order_urdf"}.get(slip, slip).partition(" ")[0]
    mended = document["slips"][0]["inertia"]
    if mend == "mended":
        assert floats(mended) == pytest.approx(floats(SIX), rel=1e-12)
    if mend == "open":
        assert mended[2] is None


def test_signs_of_products_about_centre_about_pivot_and_no_mass_anywhere(tmp_path: Path) -> None:
    # all products p, moments d: d + 2p, d − p, d − p; with p = 0.07 the largest exceeds the sum, with −0.07 it does not
    assert judged(tmp_path / "a.urdf", urdf(["0.2"] * 3 + ["-0.07"] * 3))[0] == 0
    assert first_slip(tmp_path / "b.urdf", urdf(["0.2"] * 3 + ["0.07"] * 3)) == (1, "signs_of_products")
    assert first_slip(tmp_path / "c.toml", toml(SIX, centre="1 0 0.5", extra="pivot")) == (1, "about_centre")
    part = six_of(steiner(Fraction("2.5"), (Fraction("0.1"), Fraction(0), Fraction("0.2"))))
    at_pivot = [str(float(Fraction(a) + b)) for a, b in zip((*SIX[:3], 0, 0, 0), part, strict=True)]
    assert first_slip(tmp_path / "d.urdf", urdf(at_pivot)) == (1, "about_pivot")
    assert first_slip(tmp_path / "e.urdf", urdf(["0.0"] * 3)) == (1, "point_mass")


BOX = '<collision><origin xyz="0.1 0 0.2" rpy="0 0 0.7"/><geometry><box size="0.1 0.4 0.8"/></geometry></collision>'


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
        assert slips(MassProperties(six_of(tensor), Fraction(6), (Fraction(0),) * 3, si=True)) == []
        largest = max(trace - s[i][i] for i in range(3))
        assert not realisable(minus(tensor, rows((largest, *[Fraction(0)] * 5))))


def test_a_tensor_multiplied_in_double_is_read_by_its_upper_entries(tmp_path: Path) -> None:
    """Rounded in the last bit below the diagonal; and its first six numbers, written row by row into six places."""
    nine = [0.3, 0.05, -0.02, 0.05 + 2**-57, 0.28, 0.04, -0.02, 0.04, 0.19]
    body = ht.Body(1, 9.81, (0, 0, 0), nine)
    assert body.tensor[1][0] == body.tensor[0][1] == Fraction(0.05)
    assert judged(tmp_path / "a.toml", f"mass = 1\ninertia = {nine}")[0] == 0
    (tmp_path / "p.toml").write_text('mass = 1\ncentre = [0, 0, 0.1]\ninertia = [1, 1, 1]\nabout = "pivot"')
    assert (
        "principal moments   0.99, 0.99, 1   about the centre of mass" in heavytop("body", tmp_path / "p.toml").stdout
    )
    by_row = urdf([repr(nine[i]) for i in (0, 3, 5, 1, 2, 4)])
    assert first_slip(tmp_path / "a.urdf", by_row) == (1, "row_major")


@pytest.mark.parametrize(
    ("moments", "verdicts", "said"),
    [
        ("3 2 4", "unstable stable stable", "unstable, rate 0.3536 of the angular velocity"),
        (
            "0.1 0.1 0.05",
            "unstable unstable stable",
            "unstable: a component ε of Ω along the axis of symmetry makes it drift away linearly, by 0.5 ε t",
        ),
        ("0.0833333 0.0833334 1e-9", "unstable unstable stable", "unstable"),  # a rod, beyond the triangle by rounding
        ("2 1 1 0.0005 0 0", "stable unstable unstable", "stable"),  # a plate: 2.0000002 was written as 2
        pytest.param(f"1.{5000 * '3'} 1 1 0 0 0", "stable unstable unstable", "stable", id="5000 digits"),
        ("200 100 100 0.05 0 0", "stable unstable unstable", "stable"),
        ("10 5 5.00001 0.00672027 -0.007475 0", "stable unstable unstable", "stable"),
    ],
)
def test_free_rotations_are_said_to_be_stable_or_not(tmp_path: Path, moments: str, verdicts: str, said: str) -> None:
    """About the middle axis of moments 3, 2, 4 the rate is √((4 − 3)(3 − 2)/(4·2)) of the angular velocity."""
    _, document = judged(tmp_path / "a.urdf", urdf(moments.split(), mass="9", centre="0 0 0"))
    assert [rotation["verdict"] for rotation in document["rotations"]] == verdicts.split()
    assert f"about axis 1: {said}" in " ".join(heavytop("body", tmp_path / "a.urdf").stdout.split())
    assert moments != "3 2 4" or document["rotations"][0]["rate"] == pytest.approx(8**-0.5)


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


@pytest.mark.parametrize(("gravity", "said"), [("-1", "must not be negative"), ("nan", "not a finite number")])
def test_a_table_of_a_plan_has_a_gravity_that_a_plan_takes(tmp_path: Path, gravity: str, said: str) -> None:
    (tmp_path / "arm.urdf").write_text(urdf(["1", "2", "2.5"]))
    refused = heavytop("body", tmp_path / "arm.urdf", "--gravity", gravity)
    assert (refused.returncode, refused.stdout) == (2, "")
    assert said in refused.stderr


def test_several_links_want_a_name(tmp_path: Path) -> None:
    path = tmp_path / "a.urdf"
    path.write_text(urdf(SIX).replace("</robot>", urdf(SIX).partition('<link name="base"/>')[2].replace("arm", "hand")))
    assert "holds 2 bodies: arm, hand" in heavytop("body", path).stderr
    assert heavytop("body", path, "--link", "hand").returncode == 0
    assert heavytop("body", path, "--link", "foot").returncode == 2
    path.write_text(path.read_text().replace('"2.5"', '"${m}"', 1))
    assert heavytop("body", path, "--link", "hand").returncode == 0, "a fault of another link is no fault of this one"
    assert heavytop("body", path, "--link", "arm").returncode == 2
    chain = "".join(
        f'<link name="{b}">{INERTIAL}</link><joint type="fixed"><parent link="{a}"/><child link="{b}"/></joint>'
        for a, b in (("leg", "b"), ("b", "c"), ("leg", "light"))
    ).replace(f'"light">{INERTIAL}', '"light"><inertial><mass value="0.0"/></inertial>')
    light = '<body><geom size="1" mass="0"/></body>'
    welded = f'<body>{BALL}<frame><body name="d">{BALL}<body>{BALL}<joint/></body></body></frame></body>{light}'
    for (suffix, text), link in ((leg("</robot>", f"{chain}</robot>"), "leg"), (in_mjcf(BALL + welded), "arm")):
        (path := tmp_path / f"chain.{suffix}").write_text(text)
        note = json.loads(heavytop("body", path, "--link", link, "--json").stdout)["note"]
        assert note.endswith("not included: 2 bodies.")
    model = sdf(SIX)[19:-6]
    other = model.replace('name="m"', 'name="n"')
    (world := tmp_path / "world.sdf").write_text(f"<sdf><world>{model}{other}</world></sdf>")
    assert "m::arm, n::arm" in heavytop("body", world).stderr
    assert heavytop("body", world, "--link", "n::arm").returncode == 0


def test_a_file_stands_where_a_body_may(arm: Path, tmp_path: Path) -> None:
    assert ht.Body.from_file(arm) == ht.Body("2.5", "9.81", ("0.1", "0", "0.2"), SIX, "centre of mass")
    table = heavytop("body", arm, "--json").stdout
    plan = tmp_path / "plan.toml"
    start = 'omega = ["1", "2", "3"]\nquaternion = ["1", "0", "0", "0"]\n'
    drift = '[[measure]]\nkind = "drift"\ncases = ["mine"]\nruns = [{ precision = "double", horizon = "1" }]\n'
    plan.write_text(f'name = "own"\n[[top]]\nname = "mine"\nfile = "{arm}"\n{start}{drift}')
    run = heavytop("run", "--plan", plan, "--out", tmp_path / "report", "--workers", "1")
    assert run.returncode == 0, run.stderr
    (own := tmp_path / "own.toml").write_text(json.loads(table)["toml"])
    assert read_body(own).six == read_body(arm).six


def test_the_command_line_takes_a_body_from_a_file(arm: Path) -> None:
    start = ("--omega", "1,2,3", "--quaternion", "1,0,0,0", "--times", "1")
    run = json.loads(heavytop("propagate", "--file", arm, *start, "--json").stdout)
    state = ht.State(omega=(1, 2, 3), attitude=ht.Attitude.quaternion(1, 0, 0, 0))
    assert run["states"] == ht.propagate(ht.Body.from_file(arm), state, ["1"], attitude=False).texts()
    known = heavytop("reference", "--file", arm, "--gravity", "0", *start, "--digits", "20", "--json")
    assert json.loads(known.stdout)["method"].startswith("validated")
    for extra, words in ((("--mass", "1"), "--file and --mass were given"), (("--link", "leg"), "has no link 'leg'")):
        done = heavytop("propagate", "--file", arm, *extra, *start)
        assert done.returncode == 2
        assert words in done.stderr


def test_shapes_of_mjcf_are_those_of_their_default_class(tmp_path: Path) -> None:
    """The tensor of a box turned the other way, whose size and type are those of a class within another."""
    assert first_slip(
        tmp_path / "arm.xml",
        '<mujoco><default><geom size=".05 .2 .4"/><default class="b"><geom type="box"/></default></default>'
        '<worldbody><body><geom class="b" euler="0 0 40"/>'
        '<inertial pos="0 0 0" mass="12" diaginertia="0.8 0.65 0.17" euler="0 0 -40"/></body></worldbody></mujoco>',
    ) == (1, "conjugate_axes")


INERTIAL = (
    '<inertial><origin xyz="0.1 0 0.2"/><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0.1" iyz="0"/>'
    "</inertial>"
)


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
    path.write_text(urdf(SIX).replace("</robot>", f'<link name="leg">{INERTIAL}</link></robot>'))
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
        ([0.2, 0.5, 0.71], "", ["about_centre"]),
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
    document = judged(tmp_path / "a.urdf", urdf([*map(repr, moments)], mass="2", centre="0 0 .3", extra=shape))[1]
    assert [slip["name"] for slip in document["slips"]] == names
    assert names[1:] != ["negative_moment"] or document["slips"][1]["sentence"].startswith("Possibly, signs of m")
    if names and shape and names != ["beyond_shape"] and sum(moments) != pytest.approx(2 * sum(TWICE[:2]) / 3 + 0.02):
        assert floats(document["slips"][0]["inertia"])[:3] == pytest.approx(UNIFORM, rel=1e-9)


def test_one_sign_of_three_products_is_named_by_the_shape(tmp_path: Path) -> None:
    turned = SHAPE.replace('xyz="0 0 .3"', 'xyz="0 0 .3" rpy=".5 .4 .3"')
    (path := tmp_path / "a.urdf").write_text(urdf([*map(repr, UNIFORM)], "2", "0 0 .3", turned, ".5 .4 .3"))
    six = [repr(float(value)) for value in read_body(path).six]
    assert judged(path, urdf(six, "2", "0 0 .3", turned))[0] == 0
    six[4] = repr(-float(six[4]))
    assert first_slip(path, urdf(six, "2", "0 0 .3", turned)) == (1, "signs_of_products")


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


def principal(moments: str, frame: str, before: str = "", joint: str = "") -> tuple[str, str]:
    """1 kg in MJCF with these moments about the axes of a frame."""
    return in_mjcf(f'{joint}<inertial pos="0 0 0" mass="1" diaginertia="{moments}" {frame}/>', before)


def of_class(sequence: str) -> tuple[str, str]:
    """Angles in this sequence, and the ball joint of a default class."""
    before = f'<compiler eulerseq="{sequence}"/><default><default class="b"><joint type="ball"/></default></default>'
    return principal("3 2 1.5", 'euler="90 90 0"', before, '<joint class="b" pos="0 0 -1"/>')


BEGIN = "0.1 0 0.2 2.5 0.31 0.28 0.19 9.81"
ARM = f"{BEGIN} 0.05 -0.02 0.04"
MOMENTS = "2 0.03 0.05 0.04"
CARRIED = f"0.1 0 0.2 {MOMENTS}"
BALANCED = '<compiler balanceinertia="true"/>'
SCENE = (
    '#usda 1.0\n(\n metersPerUnit = 0.01\n)\ndef "s" {{\n physics:gravityMagnitude = {}\n}}\n'
    'def "a" {{\n physics:mass = 2\n'
    " physics:diagonalInertia = (300, 500, 400)\n /* physics:mass = 3 */\n {}physics:centerOfMass = (10, 0, 20)\n}}\n"
)


def in_usd(gravity: str, lines: str) -> tuple[str, str]:
    """2 kg with this magnitude of gravity in its scene, and these lines before its centre of mass."""
    return "usda", SCENE.format(gravity, lines)


def in_gazebo(name: str, value: str) -> tuple[str, str]:
    element = f'<gazebo reference="arm"><{name}>{value}</{name}></gazebo></robot>'
    return "urdf", urdf(SIX).replace("</robot>", element)


INCLUDED = mjcf(SIX).replace("mujoco>", "mujocoinclude>").replace("<worldbody>", "").replace("</worldbody>", "")
ENCODED = '<?xml version="1.0" encoding="{}"?><!-- \xe9 -->' + urdf(SIX)
TURNED = urdf(SIX).replace('rpy="0 0 0"', 'quat_xyzw="0 0 1 0" x:note="1"').replace("<robot", '<robot xmlns:x="x"')
QUARTER = "0 0 0 1 2 4 3 9.81"
# As MuJoCo 4.0.0 and Drake 1.56 read them: centre of mass from the pivot, mass, I11 I22 I33, gravity, and products.
READ: dict[str, tuple[tuple[str, str | bytes], str]] = {
    "a default namespace": (("urdf", urdf(SIX).replace("<robot ", '<robot xmlns="http://www.ros.org" ')), ARM),
    "a mark of UTF-8": (("urdf", b"\xef\xbb\xbf" + urdf(SIX).encode()), ARM),
    "UTF-16": (("urdf", ENCODED.format("utf-16").encode("utf-16")), ARM),
    "Latin-1": (("urdf", ENCODED.format("latin-1").encode("latin-1")), ARM),
    "lines of Windows": (("sdf", b"\r\n" + sdf(SIX).replace("><", ">\r\n<").encode()), ARM),
    "an included file": (("xml", INCLUDED), ARM),
    "a product that SDF leaves out": (("sdf", sdf(SIX).replace("<ixz>-0.02</ixz>", "")), f"{BEGIN} 0.05 0 0.04"),
    "attributes of the schema and of namespaces": (("urdf", TURNED), f"{BEGIN} 0.05 0.02 -0.04"),
    # a quarter of a turn about x exchanges the second and the third moment
    "euler": (principal("2 3 4", 'euler="90 0 0"'), QUARTER),
    "axisangle": (principal("2 3 4", 'axisangle="2 0 0 90"'), QUARTER),
    "xyaxes": (principal("2 3 4", 'xyaxes="3 0 0 5 0 2"'), QUARTER),
    "zaxis": (principal("2 3 4", 'zaxis="0 -7 0"'), QUARTER),
    "quat": (principal("2 3 4", 'quat="1 1 0 0"'), QUARTER),
    # by 90 degrees about z, then about the turned y; and about the fixed y
    "angles about turned axes": (of_class("zyx"), "0 0 1 1 2 1.5 3 9.81"),
    "angles about fixed axes": (of_class("ZYX"), "0 0 1 1 1.5 3 2 9.81"),
    "bounds": (in_mjcf(BALL, '<compiler boundmass="5" boundinertia=".045"/>'), "0.1 0 0.2 5 0.045 0.05 0.045 9.81"),
    "balanced": (in_mjcf(BALL.replace("0.04", "0.1"), BALANCED), "0.1 0 0.2 2 0.06 0.06 0.06 9.81"),
    "not balanced": (in_mjcf(BALL, BALANCED), f"{CARRIED} 9.81"),
    "joint in a frame": (
        in_mjcf(f'<frame pos="0 0 1"><joint type="ball"/></frame>{BALL}'),
        f"0.1 0 -0.8 {MOMENTS} 9.81",
    ),
    "inertial in a frame": (in_mjcf(FRAMED), "0 0.1 1.2 2 0.05 0.03 0.04 9.81"),
    "gravity": (in_mjcf(BALL, '<option gravity="0 0 -1.62"/>'), f"{CARRIED} 1.62"),
    "no gravity": (in_mjcf(BALL, '<option><flag gravity="disable"/></option>'), f"{CARRIED} 0"),
    "degrees": (in_sdf('degrees="1"', "90 90 0"), "0.1 0 0.2 2 0.05 0.04 0.03 9.81"),
    "ball": (in_sdf(joint=JOINT.format("arm", "")), f"0.1 0 0.7 {MOMENTS} 9.81"),
    "ball in the model": (in_sdf(joint=JOINT.format("arm", 'relative_to="f"')), f"0.1 0 1.7 {MOMENTS} 9.81"),
    "ball of a frame": (in_sdf(joint=JOINT.format("g", "")), f"-0.9 0 0.7 {MOMENTS} 9.81"),
    "moon": (in_sdf(gravity="<gravity>0 0 -1.62</gravity>"), f"{CARRIED} 1.62"),
    "world": (in_sdf(gravity="<gui/>"), f"{CARRIED} 9.8"),
    "moon of SDF 1.4": (in_sdf(gravity="<physics><gravity>0 0 -1.62</gravity></physics>"), f"{CARRIED} 1.62"),
    "moon in USD, beside names of other programs": (
        in_usd('162\n string paths = "/s/*/a"', "float user:Mass = 3\n "),
        f"{CARRIED} 1.62",
    ),
    "a shape within a body of USD": (
        in_usd("162", 'def "c" (doc = "{") {\n physics:mass = 7\n}\n '),
        f"{CARRIED} 1.62",
    ),
    "earth in USD": (in_usd("-inf", ""), f"{CARRIED} 9.81"),
    "no gravity in USD": (in_usd("162", "physxRigidBody:disableGravity = 1\n "), f"{CARRIED} 0"),
    "no gravity in Gazebo": (in_gazebo("turnGravityOff", "true"), ARM.replace("9.81", "0")),
    "gravity in Gazebo": (in_gazebo("gravity", "1"), ARM),
    "exempt": (in_sdf(exempt="<gravity>0</gravity>"), f"{CARRIED} 0"),
}


@pytest.mark.parametrize("name", READ)
def test_a_file_is_read_exactly_as_its_format_defines(tmp_path: Path, name: str) -> None:
    (suffix, text), numbers = READ[name]
    (path := tmp_path / f"a.{suffix}").write_bytes(text if isinstance(text, bytes) else text.encode())
    *expected, gravity = map(Fraction, numbers.split()[:8])
    products = numbers.split()[8:] or [0] * 3
    body = read_body(path)
    given = body.about(None)
    assert [*given.centre, given.mass, *given.six, body.gravity_down] == [*expected, *map(Fraction, products), gravity]
    assert ht.Body.from_file(path).gravity == gravity
    assert f'gravity = "{numbers.split()[7]}"' in heavytop("body", path).stdout
    assert ht.Body.from_file(path, gravity=3).gravity == 3


def leg(old: str, new: str) -> tuple[str, str]:
    """A URDF with one link, and this slip of the pen in it."""
    return "urdf", f'<robot name="r"><link name="leg">{INERTIAL}</link></robot>'.replace(old, new)


REFUSED = {
    "entities": (("urdf", '<!DOCTYPE r [<!ENTITY x "y">]><robot name="&x;"/>'), "declares entities"),
    "no XML": (("urdf", "<robot"), "is not XML"),
    "a page": (("urdf", "<html/>"), "is <html>"),
    "a link without mass": (("urdf", '<robot name="r"><link name="a"/></robot>'), "holds no mass properties"),
    "no format": (("txt", "1 2 3"), "is not known"),
    "a letter": (("urdf", urdf(["a", *SIX[1:]])), "ixx = 'a'"),
    "a tiny mass": (("urdf", urdf(SIX, mass="1e-400")), "1e-30 to 1e30"),
    "tiny moments": (("urdf", urdf(["1e-300", "1e-300", "1e-300"])), "1e-30 to 1e30"),
    "a far centre": (("urdf", urdf(SIX, centre="0 0 1e300")), "1e-30 to 1e30"),
    "nine numbers": (("xml", mjcf([*SIX, "1", "2", "3"])), "fullinertia has 9 numbers"),
    "no TOML": (("toml", "mass = ["), "is not TOML"),
    "binary USD": (("usd", "PXR-USDC...."), "binary USD"),
    # what another program has to compute, with the way out
    "xacro": (("urdf", urdf(SIX, mass="${m}")), "xacro FILE -o FILE.urdf"),
    "a decimal comma": (
        ("urdf", urdf(SIX, mass="2,5")),
        "mass must be 1 number; got '2,5'.\n  Give one, with a decimal",
    ),
    "two of three": (("urdf", urdf(SIX, centre="0.1 0.2")), "xyz must be 3 numbers; got '0.1 0.2'"),
    "a mass of 0": (("urdf", urdf(SIX, mass="0")), "mass must be positive; got 0"),
    "inertiafromgeom": (("xml", mjcf(SIX).replace("<w", '<compiler inertiafromgeom="true"/><w', 1)), "saveLastXML"),
    "geoms alone": (in_mjcf('<geom size="1"/>'), "saveLastXML"),
    "fullinertia turned": (("xml", mjcf(SIX).replace("<inertial ", '<inertial quat="1 0 0 0" ')), "contradict"),
    "auto": (("sdf", sdf(SIX).replace("<inertial>", '<inertial auto="true">')), "expand-auto-inertials"),
    "not symmetric": (("toml", "mass = 1\ninertia = [[1, 2, 0], [0, 1, 0], [0, 0, 1]]"), "symmetric"),
    "no word on the point": (("toml", "mass = 1\ncentre = [1, 0, 0]\ninertia = [1, 1, 1]"), "about"),
    "another point": (("toml", 'mass = 1\ninertia = [1, 1, 1]\nabout = "com"'), "\"centre of mass\"; got 'com'"),
    "gravity downwards": (("toml", "mass = 1\ngravity = -9.81\ninertia = [1, 1, 1]"), "got -9.81.\n  Give its size"),
    "a default of SDF": (("sdf", sdf(SIX).replace("<mass>2.5</mass>", "")), "where 1 is meant"),
    "a tensor of zeros": (
        ("usda", '#usda 1.0\ndef "a" {\n physics:mass = 1\n physics:diagonalInertia = (0, 0, 0)\n}'),
        "in numbers",
    ),
    # what is misspelt or left out
    "Ixz of URDF": (leg("ixz=", "Ixz="), "unknown attribute Ixz of <inertia>"),
    "no ixz": (leg('ixz="0.1"', ""), "ixz is missing"),
    "no products": (leg('ixy="0" ixz="0.1" iyz="0"', ""), "ixy is missing"),
    "xzy": (leg("xyz=", "xzy="), "unknown attribute xzy of <origin>"),
    "Value": (leg("value=", "Value="), "unknown attribute Value of <mass>"),
    "auto of URDF": (leg("<inertial>", '<inertial auto="true">'), "unknown attribute auto of <inertial>"),
    "Origin": (leg("<origin", "<Origin"), "unknown element Origin of <inertial>"),
    "rpy and quat_xyzw": (leg('xyz="0.1 0 0.2"', 'rpy="0 0 0" quat_xyzw="0 0 0 1"'), "has both rpy and quat_xyzw"),
    "gravty": (in_mjcf(BALL, '<option gravty="0 0 -1.62"/>'), "<option>: unknown gravty.\n  Did you mean gravity?"),
    "Disable": (in_mjcf(BALL, '<option><flag gravity="Disable"/></option>'), "enable or disable; got 'Disable'"),
    "xyzz": (of_class("xyzz"), "three of the letters x y z X Y Z; got 'xyzz'"),
    "radians": (in_mjcf(BALL, '<compiler angle="radians"/>'), "degree or radian; got 'radians'"),
    "settotalmas": (in_mjcf(BALL, '<compiler settotalmas="5"/>'), "Did you mean settotalmass?"),
    "armature": (in_mjcf(f'<joint type="ball" armature="1"/>{BALL}'), "armature of its ball joint"),
    "centreOfMass": (("usda", in_usd("9.81", "")[1].replace("centerO", "centreO")), "Did you mean centerOfMass?"),
    "gravty of SDF": (in_sdf(gravity="<gravty>0 0 -1.62</gravty>"), "<world>: unknown gravty"),
    "Ixz of SDF": (("sdf", sdf(SIX).replace("ixz>", "Ixz>")), "unknown element Ixz of <inertia>"),
    "degree": (in_sdf('degree="true"'), "unknown attribute degree of <pose>"),
    "Quat": (("xml", mjcf(SIX).replace("pos=", 'Quat="0 1 0 0" pos=')), "unknown attribute Quat of <inertial>"),
    "center": (("toml", "mass = 1\ncenter = [0, 0, 1]\ninertia = [1, 1, 1]"), "unknown key 'center'"),
    "weight": (("toml", "mass = 1\nweight = 1\ninertia = [1, 1, 1]"), "unknown key 'weight'"),
    "two masses": (leg("<origin", '<mass value="3"/><origin'), "<inertial> has several <mass>"),
    "two inertials of URDF": (leg("</link>", f"{INERTIAL}</link>"), "<link> has several <inertial>"),
    "two ixx": (("sdf", sdf(SIX).replace("<ixx>", "<ixx>9</ixx><ixx>")), "<inertia> has several <ixx>"),
    # what the format defines and is not read
    "two tensors": (in_mjcf(BALL.replace("/>", ' fullinertia="1 1 1 0 0 0"/>')), "fullinertia and diaginertia"),
    "two inertials": (in_mjcf(BALL + FRAMED), "2 inertials"),
    "two orientations": (in_mjcf(BALL.replace("pos", 'euler="0 0 1" quat="1 0 0 0" pos')), "quat and euler"),
    "a bound": (("xml", mjcf(SIX).replace("<world", '<compiler boundinertia=".2"/><world')), "boundinertia"),
    "global": (in_mjcf(BALL, '<compiler coordinate="global"/>'), "MuJoCo 2.3.3"),
    "fused": (in_mjcf(BALL, '<compiler fusestatic="true"/>'), "fusestatic"),
    "y up in USD": (("usda", in_usd("9.81", "")[1].replace("(", '(\n upAxis = "Y"', 1)), "along -z; got 0, -0.0981, 0"),
    "w up in USD": (("usda", in_usd("9.81", "")[1].replace("(", '(\n upAxis = "W"', 1)), "X, Y or Z; got 'W'"),
    "x down in USD": (in_usd("1\n physics:gravityDirection = (2, 0, 0)", ""), "along -z; got 0.01, 0, 0"),
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
    "a rotor": (("toml", "mass = 1\ninertia = [1, 1, 1]\nrotor = [0, 0, 1]"), "rotor"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_read_is_refused_with_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    for module in ("mujoco", "pxr"):
        monkeypatch.setitem(sys.modules, module, None)
    (suffix, text), fault = REFUSED[name]
    (path := tmp_path / f"a.{suffix}").write_text(text)
    run = heavytop("body", path)
    assert (run.returncode, run.stdout, fault in run.stderr) == (2, "", True), run.stderr
