"""What the pages of evidence say beside their tables: the meaning of each table first."""

from __future__ import annotations

from pipelines.nightly.gates.speed import LARGEST_RATIO
from tests.pipelines.nightly.studies.simulated_nights import OTHER, SAME

POWER = """
# Planted faults that a night catches

Each fault was planted in the candidate alone, by test code; the product has no switch for it. A night *catches*
a fault if it ends with exit code 1. It names the *right slice* if a failed gate names a slice of the lens and
the system that the fault is in, and no slice of another lens. The gates, margins and levels are those of
[](../guide/nightly.md).
"""
SIMULATED = f"""
Simulated nights take every frame from a pool of real noise draws: pictures of the recipe `nightly` in both
regimes that differ by noise alone, read by today's detection. Poses follow from the points to first order. Each
night runs the gates `accuracy`, `fresh` with its second look, `failures`, `tail` and `speed` of the product,
all of their tests together: five lenses, two regimes, a detector and three settings of the solver.

- **{SAME}**: candidate and baseline read the same pictures, as in every night of the product. What the fault
  itself does not change is equal on both sides.
- **{OTHER}**: the candidate's pictures have other noise. So far apart are two systems of the same accuracy at
  the most; it shows what the sample sizes alone can see.

Processor times are drawn with a scatter of 1 % of a night's ratio, as on an idle machine; the real nights below ran on
a crowded one, where it was 5 to 6 %, and show what that does. Eight of 2400 frames have no circle in some draw:
two take another draw's, and in one pose and lens it is never found, so that this lens has one pose less.

In each cell: share of 200 nights that catch the fault, share that also name the right slice.
"""
SMALLEST = f"""
By bisection over the size: 8 nights a step for {SAME}, of which all must catch it, 40 for {OTHER}, of which 95
% must. The size is found within a factor of 1.2; 95 % of 40 nights are known within 7 %. On the same pictures
the margins decide, or, sooner, what the poses make of the points.
"""
DRIFT = """
Corners of one lens move by 0.0001 px more every night, against a baseline that stays. The table has the night
that first ends with exit code 1, by the gates that compare with the frozen baseline's numbers (`accuracy`,
`failures`, `tail`).
"""
EARLY = """
The solver returns the pose of so many steps before its last, on the same pictures. For each setting: how far
poses then are from their end in their stated deviations, median and largest over 800 frames, in the worst of
six components. Gate `replay` tells every one of these as *changed*, since no bit of a pose is the same; it
never fails by itself. Exit code 1 needs a change above a margin, 0.2 deviations of a pose's mean or 10 % of its
normalised square.
"""
REAL = f"""
Whole nights of the product on real pictures, 20 poses and five lenses in the regime `typical`: rendered,
developed, detected, solved, scored, judged, with the baseline's code in a process of its own. Each history has
its own pinned pictures; fresh views have seeds of their own. `speed` ran where detection is slower; it fails
above {LARGEST_RATIO}.
"""
QUIET = """
# Nights without a fault are quiet

An *alarm* is exit code 1 although nothing is worse. The gates together may give one in a hundred nights.
"""
QUIET_SIMULATED = f"""
Candidate and baseline are the same code on pictures with {OTHER}, drawn as told in [](nightly-power.md): far
more differs than in a real night, where both see the same pictures. Gate `accuracy` *warns* where a metric is
neither shown to be worse nor to be equal, which needs more poses; a warning leaves the exit code at 0.
"""
QUIET_REAL = """
Whole nights of the product with new seeds and the same code. On the same pictures and seeds the same code has
no difference at all: not a number of a frame is another. So only processor time can scatter; the last column
has its ratio to the baseline's, over all nights. The machine was shared, which the interleaved turns have to
stand.
"""
SCATTER = """
What the simulated nights scatter with, from the pool: for each metric the mean over lenses and poses, its
standard deviation over the poses of a lens, and that of one frame over its noise draws.
"""
CHANGES = """
# Changes that are no regressions

Nights in which something is other than in the baseline's run, and nothing is worse: they must end with exit
code 0, gates *passed* or *changed*, and tell the reason. Each ran in a process of its own on real pictures,
eight poses and five lenses. `regenerate` renders pinned frames again, `replay` compares poses from points that
never change; the column has what they said.
"""
