"""Named selections of the asset graph; which partitions run is decided by freshness."""

import dagster as dg

JOB_OF_GROUP = {
    "capture": "rebuild_motion",
    "motion": "rebuild_motion",
    "music": "rebuild_music",
    "catalog": "rebuild_catalog",
    "dance": "make_dance",
}

rebuild_motion = dg.define_asset_job(
    "rebuild_motion",
    dg.AssetSelection.groups("capture", "motion"),
    description="Read, retarget and analyse the clips of capture sessions.",
)
rebuild_music = dg.define_asset_job(
    "rebuild_music", dg.AssetSelection.groups("music"), description="Read songs and find their beats."
)
rebuild_catalog = dg.define_asset_job(
    "rebuild_catalog", dg.AssetSelection.groups("catalog"), description="Build the motion graph over all clips."
)
make_dance = dg.define_asset_job(
    "make_dance", dg.AssetSelection.groups("dance"), description="Dance a song with a method, to the finished stage."
)
JOBS = [rebuild_motion, rebuild_music, rebuild_catalog, make_dance]
