"""Checks of whole files: good ones pass USD's validators and ours, and no file takes us down."""

import numpy as np
import pytest
from pxr import Usd, UsdSkel

from assets.formats import usd, usd_check, usd_package
from assets.formats.usd_contract import StageFinding
from schemas import stage_contract as contract


@pytest.fixture
def written(swaying, song_wav):
    path = song_wav.with_name("dance.usdc")
    usd.write_stage(path, swaying, audio="song.wav", provenance={"song_id": "song"})
    usd_package.write_package(path.with_suffix(".usdz"), path)
    return path


@pytest.mark.parametrize("suffix", [".usdc", ".usdz"])
def test_nothing_to_say_of_what_we_write(written, suffix):
    assert usd_check.inspect(written.with_suffix(suffix)) == []
    assert usd_check.check(written.with_suffix(suffix)) == []


def test_the_package_stands_alone(written, song_wav):
    song_wav.unlink()
    assert usd_check.check(written.with_suffix(".usdz")) == []
    assert {finding.rule for finding in usd_check.check(written)} >= {"odori:song"}


def test_validators_of_usd_are_asked(written):
    stage = Usd.Stage.Open(str(written))
    stage.GetPrimAtPath(contract.MESH_PATH).RemoveAPI(UsdSkel.BindingAPI)
    stage.Export(str(written.with_name("broken.usda")))
    findings = usd_check.inspect(written.with_name("broken.usda"))
    (finding,) = [f for f in findings if f.rule.startswith("usdSkelValidators:SkelBindingApiAppliedValidator")]
    assert (finding.severity, finding.prim_path) == ("error", contract.MESH_PATH)


def test_a_packed_member_off_its_boundary_is_told(written):
    package = written.with_suffix(".usdz").read_bytes()
    # The padding of the first member shrinks by one byte: everything behind it moves.
    shifted = package[:28] + (int.from_bytes(package[28:30], "little") - 1).to_bytes(2, "little")
    shifted += package[30:42] + (int.from_bytes(package[42:44], "little") - 1).to_bytes(2, "little")
    shifted += package[44:63] + package[64:]
    path = written.with_name("shifted.usdz")
    path.write_bytes(shifted)
    assert any(finding.severity == "error" for finding in usd_check.check(path))


@pytest.mark.parametrize(
    "content",
    [None, b"", b"not a stage", b"PXR-USDC" + bytes(200), b"#usda 1.0\ndef Xform {", b"PK\x03\x04" + bytes(60)],
    ids=["missing", "empty", "text", "empty crate", "broken text", "broken zip"],
)
@pytest.mark.parametrize("suffix", [".usdc", ".usda", ".usdz", ".usd", ""])
def test_what_is_no_stage_gives_one_finding(tmp_path, content, suffix):
    path = tmp_path / f"a{suffix}"
    if content is not None:
        path.write_bytes(content)
    (finding,) = usd_check.inspect(path)
    assert (finding.severity, finding.rule) == ("error", "file")
    assert str(path) in finding.sentence


def test_damaged_files_are_told_and_never_crash(written):
    whole = np.frombuffer(written.read_bytes(), np.uint8)
    rng = np.random.default_rng(5)
    for round_number in range(4):
        damaged = whole.copy()
        if round_number % 2:
            damaged[-rng.integers(400, 3000) :][:200] = rng.integers(0, 256, 200)
        else:
            damaged = damaged[: rng.integers(100, len(damaged))]
        path = written.with_name(f"damaged{round_number}.usdc")
        path.write_bytes(damaged.tobytes())
        findings = usd_check.check(path)
        assert findings
        assert findings[0].severity == "error"


def test_a_file_that_crashes_usd_is_told(written, monkeypatch):
    monkeypatch.setattr(usd_check.sys, "executable", "/bin/false")
    (finding,) = usd_check.check(written)
    assert finding.rule == "file"
    assert "crashes USD" in finding.sentence


@pytest.mark.parametrize("name", ["assets", "pxr", "json", "kernels"])
def test_a_folder_with_modules_of_our_names_changes_nothing(written, tmp_path, monkeypatch, name):
    (tmp_path / "here" / name).mkdir(parents=True)
    (tmp_path / "here" / name / "__init__.py").write_text("raise SystemExit(3)")
    monkeypatch.chdir(tmp_path / "here")
    assert usd_check.check(written) == []


def test_a_validator_that_does_not_load_is_no_fault_of_the_file(written, monkeypatch):
    monkeypatch.setattr(usd_check, "__name__", "assets.formats.nowhere")
    with pytest.raises(ChildProcessError, match=r"want it checked, got no validator: .*nowhere"):
        usd_check.check(written)


def test_a_file_that_hangs_usd_is_told(written):
    (finding,) = usd_check.check(written, time_limit_s=0.01)
    assert finding.rule == "file"
    assert "0.01 s" in finding.sentence


def test_errors_come_first_and_the_order_is_always_the_same(written):
    stage = Usd.Stage.Open(str(written))
    stage.RemovePrim(contract.AUDIO_PATH)
    stage.GetDefaultPrim().ClearCustomData()
    stage.Export(str(written.with_name("less.usda")))
    findings = usd_check.inspect(written.with_name("less.usda"))
    assert [finding.severity for finding in findings] == ["error", "warning"]
    assert usd_check.check(written.with_name("less.usda")) == findings


@pytest.mark.parametrize(
    ("name", "wanted", "unwanted"),
    [
        ("doxygen__skinnedArm.usda", {"odori:unit", "odori:joints", "odori:samples"}, "usd"),
        ("testUsdImagingGLUsdSkel__twoBends.usda", {"odori:up-axis", "odori:binding-api"}, "usdGeom"),
        ("testUsdSkelRoot__root.usda", {"odori:default-prim", "usdValidation:StageMetadataChecker"}, "odori:skel-root"),
        ("baseline__lbs.bakedInterval.usda", {"odori:skel-root", "usdSkelValidators:SkelBindingApiValidator"}, "file"),
    ],
)
def test_stages_of_other_hands_are_told_what_they_lack(data_dir, name, wanted, unwanted):
    rules = [finding.rule for finding in usd_check.check(data_dir / "usd" / name)]
    assert all(any(rule.startswith(want) for rule in rules) for want in wanted)
    assert not any(rule.startswith(unwanted) for rule in rules)


def test_a_finding_is_plain_data():
    finding = StageFinding("error", "odori:unit", "/Dance", "metersPerUnit: want 1, got 0.01")
    assert {finding} == {StageFinding("error", "odori:unit", "/Dance", "metersPerUnit: want 1, got 0.01")}
