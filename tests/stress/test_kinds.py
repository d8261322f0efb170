"""Every kind holds what is asked of it; what was found is kept in `out/stress` and goes on where it stopped."""

import pytest

from tests.stress.kinds import KINDS
from tests.stress.results import ROOT, Results
from tests.stress.running import children, run_kind
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
    assert faults(run_kind(KINDS[name], range(KINDS[name].views), asked, Results(ROOT / "out" / "stress"))) == []
