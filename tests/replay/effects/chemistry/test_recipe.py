"""Equations are read as processes of the ledger: what each mol makes, and the acid or hydroxide that it needs."""

from support.liquid_worlds import glass

from replay.effects.chemistry.contents import contents_of_scene
from replay.effects.chemistry.recipe import recipe_of
from replay.effects.effect_plan import plan
from sessions.model.scene import Scene, SceneEffect


def process_of(equation, solutes, solid=""):
    """The process of one equation in a flask that holds solutes, mol/L, and perhaps a gram of a solid."""
    powder = {"solid": {"formula": solid, "mass_g": 1.0}} if solid else {}
    effects = (SceneEffect("mixing", {"in": ["flask"]}), SceneEffect("reaction", {"equation": equation}))
    flask = glass("flask", volume_ml=50.0, solutes=solutes, properties=powder)
    scene = Scene(bodies=(flask,), effects=effects)
    tables = {kind: step.declared for kind, step in plan(scene).steps.items()}
    (process,) = recipe_of(tables, contents_of_scene(scene, "scene.toml")).processes
    return process


def test_process_needs_the_acid_or_hydroxide_of_its_reagents():
    """``protons``: mol that an equation takes from an acid among its reagents, below 0 of hydroxide that it takes.

    Zinc takes two of acid or of hydroxide. Iodine takes neither: arsenite is the anion of a weak acid, which counts as
    neither, although it takes protons up. ``solutes``: mol/L in a flask; ``solid``: of which a gram lies there.
    """
    for equation, solutes, solid, protons in [
        ("Zn + 2 HCl -> ZnCl2 + H2", {"HCl": 1.0}, "Zn", 2),
        ("Zn + H2SO4 -> ZnSO4 + H2", {"H2SO4": 1.0}, "Zn", 2),
        ("Zn + 2 NaOH + 2 H2O -> Na2Zn(OH)4 + H2", {"NaOH": 1.0}, "Zn", -2),
        ("I2 + AsO3^3- + H2O -> 2 I- + AsO4^3- + 2 H+", {"I2": 1e-4, "KI": 0.1, "Na3AsO3": 0.1}, "", 0),
        ("I2 + H3AsO3 + H2O -> 2 I- + H3AsO4 + 2 H+", {"I2": 1e-4, "KI": 0.1, "H3AsO3": 0.1}, "", 0),
        ("I2 + 2 S2O3^2- -> 2 I- + S4O6^2-", {"I2": 1e-4, "KI": 0.1, "Na2S2O3": 0.1}, "", 0),
    ]:
        assert process_of(equation, solutes, solid).acid == protons, equation
