"""The same mass action in another formulation: the balance of charges, halved in forty digits; nothing of the product.

Ions are told by their charges, solids by their solubility products as handbooks write them. For a pH each family of
ions that share a solid is solved by itself, and the pH is where the charges cancel.
"""

from functools import cache

from mpmath import mp, mpf

mp.dps = 40
HALVINGS = 120
KW = mpf(10) ** mpf("-13.995")

# name -> charge without protons, pKa falling from the last proton to the first
ACIDS = {
    "acetate": (-1, ["4.756"]), "sulfate": (-2, ["1.99", "-3.0"]), "phosphate": (-3, ["12.32", "7.21", "2.16"]),
    "ammonia": (0, ["9.25"]), "fluoride": (-1, ["3.20"]), "carbonate": (-2, ["10.33", "6.35"]),
}  # fmt: skip
# name -> charge, pK of the first hydrolysis
METALS = {"Fe": (3, "2.19"), "Cu": (2, "8.0"), "Mg": (2, None), "Ca": (2, None), "Ba": (2, None), "Zn": (2, "8.96")}
DIMER = {"Cu": "10.36"}
# hydroxide -> metal, number of hydroxides, Ksp
HYDROXIDES = {"Mg(OH)2": ("Mg", 2, "5.61e-12"), "Fe(OH)3": ("Fe", 3, "2.79e-39"), "Zn(OH)2": ("Zn", 2, "3e-17")}
CARBONATES = {"CaCO3": ("Ca", "3.36e-9"), "BaCO3": ("Ba", "2.58e-9")}
HALIDES = {"AgCl": ("Cl", "1.77e-10"), "AgBr": ("Br", "5.35e-13"), "AgI": ("I", "8.52e-17")}
BUBBLE = mpf("3.3e-4") * mpf("101325") / 1000


@cache
def ten(power):
    return mpf(10) ** mpf(power)


def free_ion(total, whole, partners):
    """Concentration of an ion: each free mole dissolves ``whole``, and a partner is moles beside its product.

    What is dissolved and solid together rises with the free ion. So a solid forms only where those that need less of
    the ion leave more than it needs, and with the solids that form the balance is a quadratic equation.
    """
    free, missing, products = total / whole, total, mpf(0)
    for amount, product in sorted(partners, key=lambda partner: partner[1] / partner[0]):
        if free * amount <= product:
            break
        missing, products = missing - amount, products + product
        root = (missing**2 + 4 * whole * products) ** mpf("0.5")
        free = (missing + root) / (2 * whole) if missing > 0 else 2 * products / (root - missing)
    return free


class Solution:
    """``acids``, ``metals``, ``halides``: name -> mol/L; ``strong``: net charge of ions that only look on."""

    def __init__(self, acids, metals, halides, strong, solids, gas):
        self.acids, self.metals, self.halides = acids, metals, halides
        self.strong, self.solids, self.gas = strong, solids, gas

    def result(self):
        """pH, where the falling sum of the charges is zero, and the phases there."""
        low, high = mpf(-2), mpf(16)
        for _ in range(HALVINGS):
            ph = (low + high) / 2
            low, high = (ph, high) if self.charge(mpf(10) ** -ph)[0] > 0 else (low, ph)
        return ph, self.charge(mpf(10) ** -ph)[1] | self.silver()

    def charge(self, h):
        """Sum of the charges at a proton concentration, and the phases there."""
        phases = {}
        # A mole of solid silver takes a positive and a negative charge.
        total = h - KW / h + self.strong + self.metals.get("Ag", 0) - sum(self.halides.values(), mpf(0))
        for name, amount in self.acids.items():
            if name != "carbonate":
                total += amount * self.mean(name, h)
        for name, amount in self.metals.items():
            if name not in ("Ca", "Ba", "Ag"):
                total += self.metal(name, amount, h, phases)
        return total + self.carbonates(h, phases), phases

    @staticmethod
    def weights(name, h):
        found = [mpf(1)]
        for pka in ACIDS[name][1]:
            found.append(found[-1] * h * ten(pka))
        return found

    def mean(self, name, h):
        """Mean charge of an acid's family."""
        weights = self.weights(name, h)
        return sum((ACIDS[name][0] + k) * one for k, one in enumerate(weights)) / sum(weights)

    def metal(self, name, amount, h, phases):
        """Charge of a metal's ions; what is beyond the product of its hydroxide is solid."""
        charge, pk = METALS[name]
        single = ten("-" + pk) / h if pk else mpf(0)
        double = ten("-" + DIMER[name]) / h**2 if name in DIMER else mpf(0)
        # amount = free (1 + single) + 2 double free^2
        free = amount / (1 + single)
        if double:
            free = ((1 + single) ** 2 + 8 * double * amount) ** mpf("0.5") - (1 + single)
            free /= 4 * double
        for solid in self.solids:
            if HYDROXIDES.get(solid, ("",))[0] == name:
                _, many, ksp = HYDROXIDES[solid]
                most = mpf(ksp) * (h / KW) ** many
                phases[solid] = mpf(0)
                if free > most:
                    free = most
                    phases[solid] = amount - free * (1 + single)
        return free * (charge + single * (charge - 1)) + double * free**2 * (2 * charge - 2)

    def carbonates(self, h, phases):
        """Charge of carbonates and of the metals that they bind, with the gas that bubbles."""
        amount = self.acids.get("carbonate", mpf(0))
        metals = {name: self.metals[name] for name in ("Ca", "Ba") if name in self.metals}
        bound = {s: (metals[CARBONATES[s][0]], mpf(CARBONATES[s][1])) for s in self.solids if s in CARBONATES}
        charge = sum((2 * one for one in metals.values()), mpf(0))
        if not amount:
            return charge
        weights = self.weights("carbonate", h)
        whole = sum(weights)

        def formed(free):
            return {name: max(mpf(0), metal - product / free) for name, (metal, product) in bound.items()}

        free = free_ion(amount, whole, bound.values())
        if self.gas:
            free, before = min(free, BUBBLE / weights[2]), free
            phases["CO2"] = amount - free * whole - sum(formed(free).values(), mpf(0)) if free < before else mpf(0)
        phases |= formed(free)
        charge -= 2 * sum(formed(free).values(), mpf(0))
        return charge + free * sum((k - 2) * one for k, one in enumerate(weights))

    def silver(self):
        """Solids of silver, which no pH changes."""
        if "Ag" not in self.metals:
            return {}
        bound = {s: (self.halides[HALIDES[s][0]], mpf(HALIDES[s][1])) for s in self.solids if s in HALIDES}
        free = free_ion(self.metals["Ag"], mpf(1), bound.values())
        return {name: max(mpf(0), halide - product / free) for name, (halide, product) in bound.items()}
