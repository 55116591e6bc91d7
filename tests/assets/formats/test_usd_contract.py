"""Each rule of the contract speaks up when its part of a good stage is broken, and only then."""

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdMedia, UsdSkel, Vt

from assets.formats import usd, usd_contract
from schemas import stage_contract as contract


@pytest.fixture
def stage(swaying, song_wav):
    path = song_wav.with_name("dance.usdc")
    usd.write_stage(path, swaying, audio="song.wav", provenance={"song_id": "song"})
    return Usd.Stage.Open(str(path))


def told(stage):
    return {(finding.severity, finding.rule) for rule in usd_contract.RULES for finding in rule(stage)}


def skeleton(stage):
    return UsdSkel.Skeleton(stage.GetPrimAtPath(contract.SKELETON_PATH))


def animation(stage):
    return UsdSkel.Animation(stage.GetPrimAtPath(contract.ANIMATION_PATH))


def mesh(stage):
    return UsdGeom.Mesh(stage.GetPrimAtPath(contract.MESH_PATH))


def song(stage):
    return UsdMedia.SpatialAudio(stage.GetPrimAtPath(contract.AUDIO_PATH))


def without_joint(stage, joint):
    for schema in (skeleton(stage), animation(stage)):
        attribute = schema.GetJointsAttr()
        attribute.Set([path.replace(joint, "other") for path in attribute.Get()])


def with_children_first(stage):
    for schema in (skeleton(stage), animation(stage)):
        attribute = schema.GetJointsAttr()
        attribute.Set(list(reversed(attribute.Get())))


def with_rotation(stage, frame, change):
    attribute = animation(stage).GetRotationsAttr()
    value = change(np.array(attribute.Get(frame)))
    attribute.Set(Vt.QuatfArray.FromNumpy(value.astype(np.float32)), frame)


def with_rest(stage, change):
    attribute = skeleton(stage).GetRestTransformsAttr()
    matrix = np.array(attribute.Get())
    change(matrix)
    attribute.Set(Vt.Matrix4dArray.FromNumpy(matrix))


def with_weights(stage, name, change):
    attribute = mesh(stage).GetPrim().GetAttribute(f"primvars:skel:{name}")
    value = np.array(attribute.Get())
    attribute.Set(type(attribute.Get()).FromNumpy(change(value)))


def spoil(array, index, value):
    array[index] = value
    return array


def test_a_written_stage_keeps_the_contract(stage):
    assert told(stage) == set()


@pytest.mark.parametrize(
    ("rule", "severity", "spoiled"),
    [
        ("up-axis", "error", lambda s: UsdGeom.SetStageUpAxis(s, "Z")),
        ("unit", "error", lambda s: UsdGeom.SetStageMetersPerUnit(s, 0.01)),
        ("rate", "error", lambda s: s.SetFramesPerSecond(24)),
        ("rate", "error", lambda s: s.ClearMetadata("timeCodesPerSecond")),
        ("range", "error", lambda s: s.ClearMetadata("endTimeCode")),
        ("default-prim", "error", lambda s: s.ClearDefaultPrim()),
        ("default-prim", "error", lambda s: s.SetDefaultPrim(s.GetPrimAtPath(contract.MESH_PATH))),
        ("binding-api", "error", lambda s: s.GetDefaultPrim().RemoveAPI(UsdSkel.BindingAPI)),
        ("binding-api", "error", lambda s: skeleton(s).GetPrim().RemoveAPI(UsdSkel.BindingAPI)),
        ("kind", "warning", lambda s: Usd.ModelAPI(s.GetDefaultPrim()).SetKind("assembly")),
        ("extent", "warning", lambda s: s.GetDefaultPrim().RemoveProperty("extent")),
        ("skel-root", "error", lambda s: s.GetDefaultPrim().SetTypeName("Xform")),
        ("skeleton", "error", lambda s: s.DefinePrim("/Dance/Second", "Skeleton")),
        ("skeleton", "error", lambda s: s.RemovePrim(contract.SKELETON_PATH)),
        ("joints", "error", lambda s: without_joint(s, "leftToes")),
        ("joints", "error", with_children_first),
        ("rest", "error", lambda s: skeleton(s).GetRestTransformsAttr().Clear()),
        ("rest", "error", lambda s: with_rest(s, lambda m: spoil(m, (4, 0, 0), 2.0))),
        ("rest", "error", lambda s: with_rest(s, lambda m: spoil(m, (4, 3, 0), np.nan))),
        ("bind", "warning", lambda s: with_rest(s, lambda m: spoil(m, (4, 3, 1), 0.5))),
        ("animation", "error", lambda s: s.RemovePrim(contract.ANIMATION_PATH)),
        ("animation", "error", lambda s: skeleton(s).GetPrim().RemoveProperty("skel:animationSource")),
        ("joint-order", "error", lambda s: animation(s).GetJointsAttr().Set(["hips"])),
        ("samples", "error", lambda s: s.SetEndTimeCode(100)),
        ("samples", "error", lambda s: animation(s).GetRotationsAttr().ClearAtTime(7)),
        ("samples", "error", lambda s: animation(s).GetTranslationsAttr().ClearAtTime(40)),
        ("samples", "error", lambda s: animation(s).GetTranslationsAttr().Set(Vt.Vec3fArray([Gf.Vec3f(0)]), 9)),
        ("samples", "error", lambda s: with_rotation(s, 5, lambda q: spoil(q, (3, 1), np.nan))),
        ("unit-quaternions", "error", lambda s: with_rotation(s, 5, lambda q: spoil(q, 3, 1.0))),
        ("hemisphere", "warning", lambda s: with_rotation(s, 5, lambda q: -q)),
        ("scales", "warning", lambda s: animation(s).GetScalesAttr().Clear()),
        ("body", "error", lambda s: s.RemovePrim(contract.MESH_PATH)),
        ("body", "error", lambda s: mesh(s).GetPrim().RemoveAPI(UsdSkel.BindingAPI)),
        ("mesh", "error", lambda s: mesh(s).GetFaceVertexIndicesAttr().Set([0, 1, 999999])),
        ("mesh", "warning", lambda s: mesh(s).GetNormalsAttr().Clear()),
        ("weights", "error", lambda s: with_weights(s, "jointIndices", lambda v: spoil(v, 3, 22))),
        ("weights", "error", lambda s: with_weights(s, "jointWeights", lambda v: spoil(v, 3, 0.5))),
        ("weights", "error", lambda s: with_weights(s, "jointWeights", lambda v: v[:5].copy())),
        ("song", "warning", lambda s: s.RemovePrim(contract.AUDIO_PATH)),
        ("song", "error", lambda s: song(s).GetFilePathAttr().Clear()),
        ("song", "error", lambda s: song(s).GetFilePathAttr().Set(Sdf.AssetPath("./none.wav"))),
        ("song", "error", lambda s: song(s).GetFilePathAttr().Set(Sdf.AssetPath("/none.wav"))),
        ("song", "error", lambda s: song(s).GetFilePathAttr().Set(Sdf.AssetPath("./dance.usdc"))),
        ("song", "warning", lambda s: song(s).GetAuralModeAttr().Set("spatial")),
        ("song", "warning", lambda s: song(s).CreateStartTimeAttr().Set(Sdf.TimeCode(0))),
        ("provenance", "error", lambda s: s.GetDefaultPrim().ClearCustomData()),
        ("provenance", "error", lambda s: s.GetDefaultPrim().SetCustomDataByKey("odori:clip", "/home/me/a.bvh")),
    ],
)
def test_a_broken_part_is_told(stage, rule, severity, spoiled):
    spoiled(stage)
    assert (severity, f"odori:{rule}") in told(stage)


def test_an_empty_stage_lacks_everything_that_matters():
    stage = Usd.Stage.CreateInMemory()
    rules = {rule for _, rule in told(stage)}
    assert {"odori:up-axis", "odori:rate", "odori:default-prim", "odori:skel-root", "odori:provenance"} <= rules


def test_sentences_say_what_was_wanted_and_what_came(stage):
    stage.RemovePrim(contract.MESH_PATH)
    UsdGeom.SetStageUpAxis(stage, "Z")
    without_joint(stage, "leftToes")
    sentences = [finding.sentence for rule in usd_contract.RULES for finding in rule(stage)]
    assert len(sentences) >= 3
    assert all(": want " in sentence for sentence in sentences)
    assert "joints: want the 22 VRM names, got no leftToes" in sentences
