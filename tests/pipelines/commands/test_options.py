"""The command line says in words of its own what the stages know: both must agree."""

import inspect

from pipelines.adapters.limits import Limits
from pipelines.commands import options, stages
from pipelines.detection import Detector
from pipelines.stages.settings import CAMERAS, POINTS, USES, Setting


def defaults(command):
    return {name: parameter.default for name, parameter in inspect.signature(command).parameters.items()}


def help_of(annotated):
    return annotated.__metadata__[0].help


def test_defaults_are_those_of_a_setting():
    own = defaults(Setting) | {"solver": None}  # which is told from the default's own name
    assert own.items() <= defaults(stages.estimate).items()
    assert defaults(stages.score)["camera"] == own["camera"]
    assert defaults(stages.detect)["detector"] == own["detector"]
    for command in (stages.run, stages.estimate):
        assert defaults(command)["timeout"] == Limits().seconds
        assert defaults(command)["memory_mb"] == Limits().memory_mb
    assert f"[default: {Setting().solver}]" in help_of(options.SolverName)


def test_every_choice_is_told():
    for annotated, choices in (
        (options.DetectorName, Detector),
        (options.PointsName, POINTS),
        (options.CameraName, CAMERAS),
        (options.Use, USES),
    ):
        assert [choice for choice in choices if choice not in help_of(annotated)] == []
