"""Every kind holds what is asked of it; what was found is kept in `out/stress` and goes on where it stopped."""

import pytest

from tests.stress.kinds import KINDS
from tests.stress.results import ROOT, Results
from tests.stress.running import children, run_kind, views_of
from tests.stress.summary import faults

VIEWS = 20


def test_there_are_thirty_kinds_or_more_of_twenty_views():
    assert sum(kind.views >= VIEWS for kind in KINDS.values()) >= 30


@pytest.fixture(scope="module")
def asked():
    """The detectors, each in a process of its own."""
    processes = children()
    yield processes
    for child in processes.values():
        child.close()


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_kind_holds(name, asked):
    wanted = {detector: views_of(KINDS[name], detector) for detector in asked}
    assert faults(run_kind(KINDS[name], wanted, asked, Results(ROOT / "out" / "stress"))) == []
