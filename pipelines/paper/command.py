"""`paper`: measure the chosen parts, then write `paper.html` and `claims.md`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import Progress
from threadpoolctl import threadpool_limits

from datasets.errors import UserError
from datasets.store.atomic import write_text
from datasets.store.refusals import refused
from pipelines.engines.engine import Engine
from pipelines.engines.local import LocalEngine
from pipelines.machine import versions
from pipelines.pages.template import rendered
from pipelines.paper.claims import Claim, PaperSection, Verdict

PAGE, CLAIMS = "paper.html", "claims.md"
TEMPLATE = Path(__file__).with_name("page.html")
IMAGE_PARTS = ("images", "wide", "experiment")
Measure = Callable[[], Sequence[PaperSection]]
MAX_SEEDS = 1000
MARKS = {Verdict.HOLDS: "better", Verdict.PARTLY: "partly", Verdict.FAILS: "worse"}  # classes of the style sheet


def parts(out: Path, seeds: int, engine: Engine, tell: Callable[[str], None]) -> dict[str, Measure]:
    """The parts by name, in the order of the page."""
    from pipelines.paper.beyond import beyond
    from pipelines.paper.derivation import derivation
    from pipelines.paper.experiment import measure as experiment
    from pipelines.paper.rendered import images, wide
    from pipelines.paper.simulation.fisheye import fisheye
    from pipelines.paper.simulation.pinhole import pinhole
    from pipelines.paper.simulation.precision import precision
    from pipelines.paper.simulation.principal_point import principal_point
    from pipelines.paper.simulation.sensitivity import sensitivity

    return {
        "precision": lambda: [precision(seeds)],
        "principal-point": lambda: [principal_point(seeds)],
        "pinhole": lambda: [pinhole(seeds)],
        "fisheye": lambda: [fisheye(seeds)],
        "sensitivity": lambda: [sensitivity(max(1, seeds // 4))],
        "derivation": lambda: [derivation(seeds)],
        "beyond": beyond,
        "images": lambda: [images(out / "images", engine, tell)],
        "wide": lambda: [wide(out / "wide", engine, tell)],
        "experiment": lambda: [experiment(out / "experiment", tell)],
    }


def reproduce(out: Path, only: Sequence[str], seeds: int, points_only: bool, workers: int) -> tuple[Path, Path]:
    """Measure and write; the two files.

    only: names of parts, all if empty. points_only: leave out what renders.

    Raises:
        UserError: an unknown part, a number out of range, or a folder that cannot be written.
    """
    if not 1 <= seeds <= MAX_SEEDS:
        raise UserError(f"{seeds} draws of noise are not usable; give --seeds from 1 to {MAX_SEEDS}")
    engine, sections = LocalEngine(workers), list[PaperSection]()
    # The batches are of small matrices, which threads only slow down.
    with Progress(console=Console()) as progress, threadpool_limits(1):
        known = parts(out, seeds, engine, lambda text: progress.update(bar, description=text))
        chosen = _chosen(list(known), only, points_only)
        _make_folder(out)
        bar = progress.add_task("", total=len(chosen))
        for name in chosen:
            progress.update(bar, description=name)
            sections += known[name]()
            progress.advance(bar)
    claims = [claim for section in sections for claim in section.claims]
    return write(out, sections, claims, seeds)


def _chosen(known: Sequence[str], only: Sequence[str], points_only: bool) -> list[str]:
    """Names of the parts to measure, in the order of the page.

    Raises:
        UserError: an unknown part, or nothing is left.
    """
    for name in only:
        if name not in known:
            raise UserError(f"unknown part {name!r}; choose one of {', '.join(known)}")
    left_out = IMAGE_PARTS if points_only else ()
    chosen = [name for name in known if name in (only or known) and name not in left_out]
    if not chosen:
        raise UserError(f"--points-only leaves out {', '.join(only)}; drop one of the two options")
    return chosen


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise refused(out, error) from error


def write(out: Path, sections: Sequence[PaperSection], claims: Sequence[Claim], seeds: int) -> tuple[Path, Path]:
    """`paper.html` and `claims.md` in a folder.

    Raises:
        UserError: the disk refuses.
    """
    counts = Counter(claim.verdict for claim in claims)
    html = rendered(
        TEMPLATE,
        sections=sections,
        claims=claims,
        sentence=_sentence(counts),
        held=counts[Verdict.HOLDS],
        kinds=[(verdict.replace(" ", "-"), verdict.value) for verdict in Verdict if counts[verdict]],
        marks=MARKS,
        versions=versions(),
        seeds=seeds,
    )
    found = out / PAGE, out / CLAIMS
    for path, text in zip(found, (html, markdown(claims)), strict=True):
        write_text(path, text)
    return found


def _sentence(counts: Counter[Verdict]) -> str:
    """What the claims come to."""
    if not counts:
        return "The parts that were measured judge no claim of the paper."
    return (
        f"Of {counts.total()} claims {counts[Verdict.HOLDS]} hold, {counts[Verdict.PARTLY]} hold partly and "
        f"{counts[Verdict.FAILS]} do not."
    )


def markdown(claims: Sequence[Claim]) -> str:
    """The claims as a table."""
    head = (
        "no.",
        "section",
        "the paper says",
        "its number",
        "by its equations",
        "as released",
        "verdict",
        "why",
        "command",
    )
    lines = [
        "# The paper's claims",
        "",
        "Kang et al., EPOSIT. Each claim in our words, its number, and what we measure by the paper's equations and by "
        "the behaviour of its released code; in brackets 95 % intervals. Errors are estimate minus truth.",
        "",
        f"| {' | '.join(head)} |",
        f"|{'---|' * len(head)}",
    ]
    for number, claim in enumerate(claims, start=1):
        cells = (
            str(number), claim.section, claim.text, claim.paper, claim.equations, claim.released, str(claim.verdict),
            claim.why, f"`python -m pipelines paper --only {claim.part}`",
        )  # fmt: skip
        lines.append(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |")
    return "\n".join([*lines, ""])
