"""All assets in one list, and which of them are fresh: for definitions, sensor, schedule and command."""

from collections.abc import Sequence

import dagster as dg

from assets import capture, choreography, dance, graph, hmm, matching, motion, music, percussion, search, stage
from pipelines.freshness import Freshness, nodes
from pipelines.studio.folder import StudioFolder

ASSETS: Sequence[dg.AssetsDefinition] = [
    asset
    for asset in dg.load_assets_from_modules(
        [capture, motion, music, percussion, graph, hmm, matching, search, choreography, dance, stage]
    )
    if isinstance(asset, dg.AssetsDefinition)
]


def freshness(studio: StudioFolder) -> Freshness:
    """States of a studio's assets, by this asset graph."""
    return Freshness(nodes(ASSETS), studio.lake, studio)
