"""Named selections of the asset graph; which partitions run is decided by freshness."""

import dagster as dg

JOB_OF_GROUP = {
    "capture": "rebuild_motion",
    "motion": "rebuild_motion",
    "music": "rebuild_music",
    "catalog": "rebuild_catalog",
    "search": "index_motion",
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
    "rebuild_catalog",
    dg.AssetSelection.groups("catalog"),
    description="Build the motion graph and the model of the dancer over all clips.",
)
embed_motion = dg.define_asset_job(
    "embed_motion",
    dg.AssetSelection.assets("motion_embedding"),
    description="Embed the clips of capture sessions, so that they can be searched.",
)
index_motion = dg.define_asset_job(
    "index_motion",
    dg.AssetSelection.groups("search") - dg.AssetSelection.assets("motion_embedding"),
    description="Train the encoder of motions, index their embeddings, propose labels.",
)
match_songs = dg.define_asset_job(
    "match_songs", dg.AssetSelection.assets("match"), description="Find the clips that match each segment of a song."
)
make_dance = dg.define_asset_job(
    "make_dance",
    dg.AssetSelection.groups("dance") - dg.AssetSelection.assets("match"),
    description="Dance a song with a method, to the finished stage.",
)
JOBS = [rebuild_motion, rebuild_music, rebuild_catalog, embed_motion, index_motion, match_songs, make_dance]


def job_of(asset: str, group: str) -> str:
    """Name of the job an asset is made by: assets of one job are cut alike."""
    return {"match": "match_songs", "motion_embedding": "embed_motion"}.get(asset) or JOB_OF_GROUP[group]
