"""Characters of other programs: their rest pose, names and mesh stay theirs, the dance goes on top."""

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdSkel

from assets.formats import usd_cast, usd_character, usd_check, usd_package
from assets.formats.errors import FormatError
from kernels.skeleton import kinematics
from kernels.skeleton.body_fit import fit
from kernels.skeleton.canonical import JOINTS


@pytest.fixture
def cast(write_hero, swaying, tmp_path):
    """Write a dance by a hero of any make: (hero's settings) to rig, fitted dance and stage."""

    def write(name="hero.usda", **made):
        (tmp_path / "made").mkdir()
        hero = write_hero(tmp_path / "made" / name, **made)
        rig = usd_character.read_rig(hero)
        fitted = fit(swaying, rig.character.figure)
        stage = tmp_path / "graph.usdc"
        told = {"clips": [], "character": usd_character.facts(rig)}
        usd_cast.write_cast_stage(stage, fitted, rig, usd_character.flat_copy(hero), provenance=told)
        return rig, fitted, stage

    return write


def joints_of(stage, frame):
    """World places of joints and points of a stage at a frame, by USD's own skinning."""
    opened = Usd.Stage.Open(str(stage))
    prim = next(p for p in opened.Traverse() if p.IsA(UsdSkel.Root))
    cache = UsdSkel.Cache()
    cache.Populate(UsdSkel.Root(prim), Usd.PrimDefaultPredicate)
    skeleton = UsdSkel.Skeleton(next(p for p in opened.Traverse() if p.IsA(UsdSkel.Skeleton)))
    query = cache.GetSkelQuery(skeleton)
    world = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(skeleton.GetPrim()))
    place = (np.array(query.ComputeJointSkelTransforms(frame)) @ world)[:, 3, :3]
    return dict(zip([str(j).rsplit("/")[-1] for j in query.GetJointOrder()], place, strict=True))


@pytest.mark.parametrize(
    "made",
    [
        {},
        {"metres": 1.0, "up": "Y", "size": 1.3, "arm_rad": 0.0},
        {"metres": 0.0254, "up": "Y"},
        {"inner_scale": 2.5},
    ],
    ids=["cm, Z up", "m, Y up", "inches", "scaled above"],
)
def test_joints_stand_where_the_dance_has_them(cast, made):
    rig, fitted, stage = cast(**made)
    assert rig.character.scale_ratio == pytest.approx(made.get("size", 0.8) * 1.1, abs=1e-4)
    position, _ = kinematics.place(fitted)
    for frame in (0, 17, 40):
        found = joints_of(stage, frame)
        for k, name in enumerate(JOINTS):
            if name not in ("spine", "chest", "upperChest"):
                np.testing.assert_allclose(found[f"hero_{name}"], position[frame, k], atol=5e-4, err_msg=name)


def test_the_contract_is_kept_and_the_files_own_poses_too(cast, tmp_path):
    _, _, stage = cast()
    usd_package.write_package(tmp_path / "graph.usdz", stage)
    for path in (stage, tmp_path / "graph.usdz"):
        findings = usd_check.inspect(path)
        assert [f for f in findings if f.severity == "error"] == []
    opened = Usd.Stage.Open(str(stage))
    source = Usd.Stage.Open(str(tmp_path / "made" / "hero.usda"))
    here, there = (
        UsdSkel.Skeleton(s.GetPrimAtPath(p)) for s, p in ((opened, "/Dance/Rig/Skel"), (source, "/Hero/Rig/Skel"))
    )
    for name in ("GetJointsAttr", "GetRestTransformsAttr", "GetBindTransformsAttr"):
        assert getattr(here, name)().Get() == getattr(there, name)().Get()
    mesh = opened.GetPrimAtPath("/Dance/Rig/Geo")
    assert (
        UsdGeom.Mesh(mesh).GetPointsAttr().Get()
        == UsdGeom.Mesh(source.GetPrimAtPath("/Hero/Rig/Geo")).GetPointsAttr().Get()
    )
    assert opened.GetRootLayer().GetPrimAtPath("/Dance/Rig/Geo") is None  # it is referenced, not copied in
    low = np.array(list(joints_of(stage, 20).values()))[:, 1].min()
    assert -0.01 < low < 0.1


def test_copies_take_the_character_along(cast, tmp_path):
    _, _, stage = cast()
    (tmp_path / "sent").mkdir()
    usd_package.copy_stage(tmp_path / "sent" / "waltz.usdc", stage)
    assert (tmp_path / "sent" / "waltz_character" / "character.usdc").is_file()
    assert joints_of(tmp_path / "sent" / "waltz.usdc", 3).keys() == joints_of(stage, 3).keys()


def test_same_character_same_bytes(cast, tmp_path, write_hero, swaying):
    rig, fitted, stage = cast()
    first = stage.read_bytes(), (tmp_path / "graph_character" / "character.usdc").read_bytes()
    hero = tmp_path / "made" / "hero.usda"
    told = {"clips": [], "character": usd_character.facts(rig)}
    usd_cast.write_cast_stage(stage, fitted, rig, usd_character.flat_copy(hero), provenance=told)
    assert (stage.read_bytes(), (tmp_path / "graph_character" / "character.usdc").read_bytes()) == first


def test_textures_come_along(cast, tmp_path):
    (tmp_path / "skin of 1.png").write_bytes(b"\x89PNG picture")
    _, _, stage = cast(texture="../skin of 1.png")
    file = stage.parent / "graph_character" / "textures" / "0_skin_of_1.png"
    assert file.read_bytes() == b"\x89PNG picture"
    opened = Usd.Stage.Open(str(stage))
    value = opened.GetPrimAtPath("/Dance/Looks/Skin").GetAttribute("inputs:file").Get()
    assert value.resolvedPath == str(file)
    usd_package.write_package(tmp_path / "graph.usdz", stage)
    packed = Usd.Stage.Open(str(tmp_path / "graph.usdz"))
    value = packed.GetPrimAtPath("/Dance/Looks/Skin").GetAttribute("inputs:file").Get()
    assert value.resolvedPath.endswith("graph.usdz[graph_character/textures/0_skin_of_1.png]")


def test_a_packed_character_can_be_danced_with(write_hero, swaying, tmp_path):
    hero = write_hero(tmp_path / "hero.usdc")
    from pxr import UsdUtils

    assert UsdUtils.CreateNewUsdzPackage(str(hero), str(tmp_path / "hero.usdz"))
    rig = usd_character.read_rig(tmp_path / "hero.usdz")
    assert rig.character.scale_ratio == pytest.approx(0.88, abs=1e-4)


def test_several_skeletons_are_named(write_hero, tmp_path):
    two = write_hero(tmp_path / "two.usda", rigs=("Ann", "Bob"))
    with pytest.raises(FormatError, match=r"got 2: /Hero/Ann/Skel, /Hero/Bob/Skel; name one as two"):
        usd_character.read_rig(two)
    assert usd_character.read_rig(two, prim="/Hero/Bob/Skel").skeleton_path == "/Hero/Bob/Skel"
    with pytest.raises(FormatError, match=r"want a Skeleton at /Hero/Cat, got none there; it has /Hero/Ann/Skel"):
        usd_character.read_rig(two, prim="/Hero/Cat")


def test_what_cannot_dance_is_a_sentence(write_hero, tmp_path):
    empty = Usd.Stage.CreateNew(str(tmp_path / "empty.usda"))
    empty.DefinePrim("/A", "Xform")
    empty.Save()
    with pytest.raises(FormatError, match="want a Skeleton under a SkelRoot, got none"):
        usd_character.read_rig(tmp_path / "empty.usda")
    (tmp_path / "text.usda").write_text("hello")
    with pytest.raises(FormatError, match="want a USD stage"):
        usd_character.read_rig(tmp_path / "text.usda")
    hero = Usd.Stage.Open(str(write_hero(tmp_path / "hero.usda")))
    skeleton = UsdSkel.Skeleton(hero.GetPrimAtPath("/Hero/Rig/Skel"))
    skeleton.GetRestTransformsAttr().Set([])
    assert usd_character._rest(skeleton, np.full(22, -1), 22).translation.shape == (22, 3)  # the bind pose stands in
    skeleton.GetBindTransformsAttr().Set([])
    hero.Save()
    with pytest.raises(FormatError, match="want a rest or bind transform for each of 22 joints, got 0 and 0"):
        usd_character.read_rig(tmp_path / "hero.usda")
    flat = Usd.Stage.Open(str(write_hero(tmp_path / "flat.usda")))
    UsdGeom.Xformable(flat.GetPrimAtPath("/Hero")).AddScaleOp().Set((1.0, 2.0, 1.0))
    flat.Save()
    with pytest.raises(FormatError, match="uneven scales"):
        usd_character.read_rig(tmp_path / "flat.usda")


def test_real_rigs_that_are_no_bodies_are_refused(data_dir):
    for file in sorted((data_dir / "usd").glob("*.usda")):
        with pytest.raises(FormatError, match=r"want the skeleton of a human body|want a Skeleton under a SkelRoot"):
            usd_character.read_rig(file)


def test_names():
    assert usd_character.is_file("hero.usdz")
    assert usd_character.is_file("a/hero.USD:/Hero/Skel")
    assert not usd_character.is_file("ayame-step_01")
    assert usd_character.split("a/hero.usd:/Hero/Skel") == ("a/hero.usd", "/Hero/Skel")
    assert usd_character.split("hero.usdc") == ("hero.usdc", "")
    assert Sdf.Path(usd_character.ANIMATION_PATH).IsAbsolutePath()


def test_a_giant_is_in_another_unit_than_its_file_says(write_hero, tmp_path):
    with pytest.raises(FormatError, match=r"0\.2 to 10 m, got 1\d\d m; say in the file what its unit is"):
        usd_character.read_rig(write_hero(tmp_path / "giant.usda", size=100.0))


def test_files_of_windows_are_named_and_their_textures_too():
    assert usd_character.is_file(r"C:\heroes\hero.usdz")
    assert usd_character.split(r"C:\heroes\hero.usd:/Hero/Skel") == (r"C:\heroes\hero.usd", "/Hero/Skel")
    assert usd_character.split("C:/heroes/hero.usdc") == ("C:/heroes/hero.usdc", "")


@pytest.mark.parametrize("written", [r"..\looks\skin?.png", "../looks/skin?.png", "C:/looks/skin?.png"])
def test_a_texture_is_named_by_its_file_whatever_system_wrote_the_path(write_hero, tmp_path, written):
    copy = usd_character.flat_copy(write_hero(tmp_path / "hero.usda", texture=written))
    attribute = copy.layer.GetAttributeAtPath("/Hero/Looks/Skin.inputs:file")
    assert attribute.default.path == "./skin_.png"
