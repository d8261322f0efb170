"""All kinds, by name."""

from tests.stress.kinds import boards, cameras, light, optics, pictures, several

KINDS = {kind.name: kind for module in (optics, light, cameras, several, pictures, boards) for kind in module.KINDS}
