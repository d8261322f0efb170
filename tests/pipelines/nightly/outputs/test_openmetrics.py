"""metrics.prom: the parsers of Prometheus's own client read it, in the new format and in the old one."""

import dataclasses

import pytest
from prometheus_client import parser as old_format
from prometheus_client.openmetrics import parser as new_format

from pipelines.nightly.outputs import openmetrics
from pipelines.nightly.record import Timing
from tests.pipelines.nightly import simulated
from tests.pipelines.nightly.whole_nights import results

FAULT = simulated.corner_bias(0.002)
ODD = (("back\\slash", 'a "quote"'), ("new line", "a\nb\\n"), ("accent", "é"))


def _samples(night, parser=new_format):
    text = openmetrics.text(night)
    return {
        (sample.name.removeprefix("eposit_nightly_"), *sorted(sample.labels.items())): sample.value
        for family in parser.text_string_to_metric_families(text)
        for sample in family.samples
    }


def _key(name, **labels):
    return (name, *sorted(labels.items()))


@pytest.mark.parametrize("night", [results(), results(FAULT, failing=(3,), facts=ODD)], ids=["quiet", "bad"])
def test_both_parsers_read_the_same(night):
    found = _samples(night)
    assert found
    assert _samples(night, old_format) == found
    assert openmetrics.text(night).endswith("\n# EOF\n")


def test_the_numbers_are_the_nights():
    found = _samples(results(FAULT, failing=(3, 4)))
    slice = {"regime": "typical", "camera": "equisolid", "system": "edge-fit"}
    metric = slice | {"suite": "pinned", "metric": "corner_x", "unit": "px"}
    assert found[_key("exit")] == 1
    assert found[_key("effect", **metric)] == pytest.approx(0.002, rel=1e-9)
    for end in ("low", "high"):  # the same pictures: the scatter cancels
        assert found[_key(end, **metric)] == pytest.approx(0.002, rel=1e-9)
    assert found[_key("margin", **metric)] == 0.0005
    assert found[_key("gate", gate="accuracy", state="failed")] == 1
    assert found[_key("gate", gate="accuracy", state="passed")] == 0
    assert found[_key("started_seconds")] == 1777863600  # 2026-05-04 03:00:00 UTC
    failed = slice | {"camera": "perspective", "suite": "pinned", "side": "new"}
    assert found[_key("failed_frames", **failed)] == 2
    assert found[_key("frames", **failed)] == 20


def test_processor_times_are_in_seconds():
    night = results()
    timed = dataclasses.replace(night.night, timings=(Timing("detect", 1.06, 1.05, 1.07, 17.0, 18.0),))
    found = _samples(dataclasses.replace(night, night=timed))
    assert found[_key("stage_ratio", stage="detect")] == 1.06
    assert [found[_key("stage_seconds", stage="detect", side=side)] for side in ("old", "new")] == [0.017, 0.018]


def test_facts_are_labels_of_the_run():
    (run,) = [key for key in _samples(results(facts=ODD)) if key[0] == "run"]
    labels = dict(run[1:])
    assert [labels[name] for name in ("fact_back_slash", "fact_new_line", "fact_accent")] == [value for _, value in ODD]


def test_a_number_that_is_not_finite_is_read():
    night = results()
    first = night.findings["pinned"][0]
    odd = dataclasses.replace(first, change=dataclasses.replace(first.change, old=float("-inf"), new=float("nan")))
    found = _samples(dataclasses.replace(night, findings={"pinned": [odd]}))
    values = {key[0]: value for key, value in found.items()}
    assert values["old"] == float("-inf")
    assert values["new"] != values["new"]
