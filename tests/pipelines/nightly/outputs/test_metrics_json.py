"""metrics.json: it has the form that its schema states, and the schema says of each number what the history says."""

import dataclasses
import json

import jsonschema
import pytest

from pipelines.nightly.history import FINDINGS
from pipelines.nightly.outputs import metrics_json
from pipelines.nightly.record import Timing
from tests.pipelines.nightly import simulated
from tests.pipelines.nightly.whole_nights import results

SCHEMA = json.loads(metrics_json.SCHEMA_PATH.read_text())
FAULT = simulated.corner_bias(0.002)


def _validate(held):
    jsonschema.validate(held, SCHEMA, jsonschema.Draft202012Validator)


def test_the_schema_is_one_and_has_the_version():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert SCHEMA["properties"]["schema_version"]["const"] == metrics_json.SCHEMA_VERSION
    assert SCHEMA["$id"].endswith(f":{metrics_json.SCHEMA_VERSION}")


TIMING = Timing("detect", 1.06, 1.05, 1.07, 17.0, 18.0)


@pytest.mark.parametrize("options", [{}, {"fault": FAULT, "failing": (3,)}, {"failing": (3,), "waived": True}])
def test_a_night_is_valid_and_has_no_key_beyond_the_schema(options):
    found = results(**options)
    timed = dataclasses.replace(found, night=dataclasses.replace(found.night, timings=(TIMING,)))
    held = json.loads(metrics_json.text(timed))
    _validate(held)
    assert held.keys() == SCHEMA["properties"].keys() == set(SCHEMA["required"])
    for name in ("gates", "speed", "findings", "slices"):
        item = SCHEMA["properties"][name]["items"]
        assert {frozenset(entry) for entry in held[name]} == {frozenset(item["properties"])}
        assert set(item["required"]) == item["properties"].keys()


@pytest.mark.parametrize(
    ("name", "value"), [("exit", 2), ("run_id", None), ("schema_version", "2"), ("findings", [{}]), ("gates", {})]
)
def test_the_schema_refuses_another_form(name, value):
    held = json.loads(metrics_json.text(results())) | {name: value}
    with pytest.raises(jsonschema.ValidationError):
        _validate(held)


def test_numbers_mean_what_the_history_says():
    found = SCHEMA["properties"]["findings"]["items"]["properties"]
    meanings = {field.name: field.metadata[b"meaning"].decode() for field in FINDINGS if field.name != "run_id"}
    assert {name: item["description"] for name, item in found.items()} == meanings


def test_the_numbers_are_the_nights():
    night = results(FAULT)
    held = json.loads(metrics_json.text(night))
    assert held["exit"] == 1
    assert held["sentence"] == night.night.sentence
    (worse,) = [row for row in held["findings"] if row["verdict"] == "worse" and row["suite"] == "pinned"]
    assert (worse["slice"], worse["metric"], worse["unit"]) == ("typical/equisolid/edge-fit", "corner_x", "px")
    assert worse["effect"] == pytest.approx(0.002, rel=1e-9)  # the same pictures: the scatter cancels
    (gate,) = [gate for gate in held["gates"] if gate["gate"] == "accuracy"]
    assert gate["findings"] == [{"slice": worse["slice"], "metric": "corner_x"}]
    assert all(held["facts"][name] == value for name, value in night.night.facts)


def test_a_number_that_is_not_finite_is_null():
    night = results()
    first = night.findings["pinned"][0]
    odd = dataclasses.replace(first, change=dataclasses.replace(first.change, old=float("-inf"), p=float("nan")))
    held = json.loads(metrics_json.text(dataclasses.replace(night, findings={"pinned": [odd]})))
    assert (held["findings"][0]["old"], held["findings"][0]["p"]) == (None, None)
    _validate(held)
