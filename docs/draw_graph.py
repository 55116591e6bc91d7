"""Write docs/asset-graph.svg from the asset graph itself."""

from pathlib import Path

from pipelines.collection import ASSETS
from pipelines.freshness import Node, nodes

HERE = Path(__file__).parent
WIDE, HIGH, STEP_X, STEP_Y = 168, 34, 214, 54
COLOUR = {
    "sources": "#f4f1ea",
    "capture": "#dbe9f6",
    "motion": "#d9efe0",
    "music": "#fbe6d4",
    "catalog": "#ece2f3",
    "search": "#e3f0f0",
    "dance": "#f9dede",
}
SOURCES = {"clips": "clips/**", "song": "songs/*", "request": "what was asked", "character": "character"}
# Columns by how far an asset is from the files; rows so that lines seldom cross.
PLACES = {
    "clips": (0, 1),
    "song": (0, 5.5),
    "clip": (1, 0),
    "pose": (1, 1),
    "skeleton": (1, 2),
    "calibration": (1, 3),
    "clip_fault": (1, -1),
    "canonical_pose": (2, 1.5),
    "motion_beat": (2, 0.3),
    "motion_tempo": (3, -0.6),
    "motion_turn": (2, -0.8),
    "motion_graph_node": (3, 0.3),
    "motion_graph_edge": (3, 1.4),
    "song (table)": (1, 4.0),
    "music_beat": (1, 5.0),
    "music_tempo": (1, 6.0),
    "music_loudness": (1, 7.0),
    "motion_feature": (3, 2.6),
    "music_feature": (2, 4.6),
    "music_segment": (2, 5.7),
    "motion_encoder": (4, -0.4),
    "motion_embedding": (5, -0.4),
    "motion_index": (6, -0.9),
    "label_proposal": (6, 0.1),
    "match": (3, 3.8),
    "music_repeat": (3, 5.2),
    "percussion": (2, 6.8),
    "melody": (2, 7.8),
    "performance": (2, 8.8),
    "basic_motion": (3, 8.4),
    "key_pose": (4, 8.4),
    "choreography_model": (5, 6.2),
    "music_evidence": (5, 7.4),
    "choreography": (6, 2.8),
    "dance_pose": (7, 2.0),
    "frame_lineage": (7, 3.6),
    "dance_quality": (8, 2.0),
    "usd_animation": (8, 3.6),
    "files": (9, 3.6),
}


def box(name: str, label: str, colour: str, note: str = "") -> str:
    """One rounded box with its name and a smaller note."""
    x, y = corner(name)
    text = f'<text x="{x + WIDE / 2}" y="{y + (15 if note else 21)}" class="n">{label}</text>'
    if note:
        text += f'<text x="{x + WIDE / 2}" y="{y + 28}" class="s">{note}</text>'
    return f'<rect x="{x}" y="{y}" width="{WIDE}" height="{HIGH}" rx="6" fill="{colour}" class="b"/>{text}'


def corner(name: str) -> tuple[float, float]:
    """Upper left corner of a box."""
    column, row = PLACES[name]
    return 12 + STEP_X * column, 84 + STEP_Y * row


def line(start: str, end: str) -> str:
    """Draw a curve from one box to another, rightwards, or straight within a column."""
    (x0, y0), (x1, y1) = corner(start), corner(end)
    if abs(x0 - x1) < 1:
        down = y1 > y0
        xa, ya, yb = x0 + WIDE / 2, y0 + (HIGH if down else 0), y1 + (0 if down else HIGH)
        return f'<path d="M{xa},{ya} L{xa},{yb}" class="l"/>'
    a, b = (x0 + WIDE, y0 + HIGH / 2), (x1, y1 + HIGH / 2)
    bend = (b[0] - a[0]) / 2
    return f'<path d="M{a[0]},{a[1]} C{a[0] + bend},{a[1]} {b[0] - bend},{b[1]} {b[0]},{b[1]}" class="l"/>'


def shown(node: Node) -> str:
    """Name of a node's box: the table of songs is told from the files of songs."""
    return "song (table)" if node.name == "song" else node.name


def picture() -> str:
    """Draw the whole graph."""
    graph = nodes(ASSETS)
    lines, boxes = [], []
    cut = {"session": "a session", "song": "a song", "dance": "a song × method", "whole": "whole catalogue"}
    for node in graph.values():
        if node.sources in ("clips", "song"):
            lines.append(line(node.sources, shown(node)))
        lines += [line(shown(graph[name]), shown(node)) for name in node.inputs]
        boxes.append(box(shown(node), node.name, COLOUR[node.group], cut[node.kind]))
    boxes += [box(name, SOURCES[name], COLOUR["sources"], "your files") for name in ("clips", "song")]
    lines.append(line("usd_animation", "files"))
    boxes.append(box("files", "dances/*.usdc .usdz", COLOUR["sources"], "with the song inside"))
    groups = [g for g in COLOUR if g != "sources"]
    legend = "".join(
        f'<rect x="{12 + 110 * i}" y="8" width="12" height="12" fill="{COLOUR[g]}" class="b"/>'
        f'<text x="{30 + 110 * i}" y="18" class="k">{g}</text>'
        for i, g in enumerate(groups)
    )
    width, height = 24 + STEP_X * 9 + WIDE, 84 + STEP_Y * 9 + HIGH + 12
    style = (
        ".b{stroke:#555;stroke-width:1}.l{fill:none;stroke:#888;stroke-width:1}"
        "text{font-family:sans-serif;fill:#222}.n{font-size:13px;text-anchor:middle}"
        ".s{font-size:9.5px;text-anchor:middle;fill:#666}.k{font-size:12px}"
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">'
        f'<style>{style}</style><rect width="100%" height="100%" fill="#fff"/>'
        f"{legend}{''.join(lines)}{''.join(boxes)}</svg>\n"
    )


if __name__ == "__main__":
    (HERE / "asset-graph.svg").write_text(picture())
