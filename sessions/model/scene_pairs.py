"""The pairs of bodies a scene asks for: those declared, else all except ignored ones and those of one group."""

from collections.abc import Sequence

from sessions.model.scene import Scene


def wanted_pairs(scene: Scene, names: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs of names, in the order declared, else in the order of ``names``.

    Whether two bodies ever move relative to each other is for the poses to say and not asked here. Declared pairs of
    which a body is not among ``names`` are left out; ``absent_bodies`` names those bodies.
    """
    present = set(names)
    if scene.pairs is not None:
        return [pair for pair in scene.pairs if present.issuperset(pair)]
    ignored = {frozenset(pair) for pair in scene.ignore}
    group = {body.id: body.group for body in scene.bodies}
    return [
        (a, b)
        for place, a in enumerate(names)
        for b in names[place + 1 :]
        if frozenset((a, b)) not in ignored and not (group.get(a) and group.get(a) == group.get(b))
    ]


def absent_bodies(scene: Scene, names: Sequence[str]) -> list[str]:
    """Bodies of declared pairs that are not among ``names``, each once."""
    present = set(names)
    return list(dict.fromkeys(name for pair in scene.pairs or () for name in pair if name not in present))
