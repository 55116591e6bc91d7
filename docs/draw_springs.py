"""Write docs/spring-gaps.svg: how the gaps at the joints go up and down over the iterations of the springs."""

import math
from pathlib import Path

import numpy as np

from kernels.calibration.calibrate import calibrate
from kernels.calibration.cleaning import clean
from kernels.calibration.poses import body_model, gaps
from kernels.calibration.springs import relax_springs
from kernels.calibration.tree_solver import Stream, solve_tree
from kernels.synthetic import suit_performer

HERE = Path(__file__).parent
WIDE, HIGH = 640, 300
LEFT, TOP, RIGHT, BOTTOM = 56, 30, 620, 258
MOST_STEPS, LEAST_MM, MOST_MM = 100, 0.01, 10.0


def measured() -> tuple[dict[int, float], float]:
    """Root mean square gap in mm, by iterations of the springs, and after one step on the tree."""
    made = suit_performer.made_up(7, n_frames=3000)
    cleaned = clean(made.recording)
    model = body_model(calibrate(cleaned))
    whole = np.flatnonzero(~cleaned.is_filled.any(axis=1))[::10]
    recording = made.recording
    received = Stream(
        recording.position_xyz_m[whole], recording.rotation_wxyz[whole], np.ones((len(whole), len(recording.sensors)))
    )

    def gap_mm(steps: int, is_tree: bool = False) -> float:
        solved = (solve_tree if is_tree else relax_springs)(model, received, iterations=steps)
        return 1000 * float(np.sqrt(np.mean(gaps(model, solved.position_xyz_m, solved.rotation_wxyz) ** 2)))

    return {n: gap_mm(n) for n in (*range(1, 31), 40, 50, 65, 80, 100)}, gap_mm(1, is_tree=True)


def place(steps: float, gap_mm: float) -> tuple[float, float]:
    """Where a point is drawn: both axes logarithmic."""
    x = LEFT + (RIGHT - LEFT) * math.log(steps) / math.log(MOST_STEPS)
    share = math.log(gap_mm / LEAST_MM) / math.log(MOST_MM / LEAST_MM)
    return round(x, 1), round(BOTTOM - (BOTTOM - TOP) * share, 1)


def picture() -> str:
    """Draw the whole picture."""
    gap_mm, tree_mm = measured()
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDE} {HIGH}" font-family="sans-serif" font-size="11">',
        f'<rect width="{WIDE}" height="{HIGH}" fill="#ffffff"/>',
        f'<text x="{LEFT}" y="18">gap at the joints, mm, root mean square of all joints and frames</text>',
    ]
    for value in (0.01, 0.1, 1, 10):
        y = place(1, value)[1]
        parts.append(f'<path d="M{LEFT},{y} H{RIGHT}" stroke="#dddddd"/>')
        parts.append(f'<text x="{LEFT - 6}" y="{y + 4}" text-anchor="end">{value:g}</text>')
    for steps in (1, 2, 3, 5, 10, 20, 30, 50, 100):
        x = place(steps, 1)[0]
        parts.append(f'<text x="{x}" y="{BOTTOM + 16}" text-anchor="middle">{steps}</text>')
    parts.append(f'<text x="{(LEFT + RIGHT) / 2}" y="{BOTTOM + 34}" text-anchor="middle">iterations of springs</text>')
    points = [place(n, gap) for n, gap in gap_mm.items()]
    line = " ".join(f"{x},{y}" for x, y in points)
    parts.append(f'<polyline points="{line}" fill="none" stroke="#c94f1d" stroke-width="1.5"/>')
    parts += [f'<circle cx="{x}" cy="{y}" r="2.5" fill="#c94f1d"/>' for x, y in points]
    below = "0.000000001" if tree_mm < 1e-9 else f"{tree_mm:.1g}"
    parts.append(
        f'<text x="{LEFT + 8}" y="{BOTTOM - 8}" fill="#2a4fa8">Gauss-Newton on the tree: below {below} mm '
        "from the first step on</text>"
    )
    return "\n".join([*parts, "</svg>\n"])


if __name__ == "__main__":
    (HERE / "spring-gaps.svg").write_text(picture())
