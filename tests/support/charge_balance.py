"""The same mass action in another formulation: the balance of charges, halved in forty digits; nothing of the product.

Ions are told by their charges, solids by their solubility products as handbooks write them. For a pH each family of
ions that share a solid is solved by itself, and the pH is where the charges cancel.
"""

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


def ten(power):
    return mpf(10) ** mpf(power)


def halved(function, low, high):
    """The root of a falling function of a logarithm."""
    low, high = mpf(low), mpf(high)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if function(middle) > 0 else (low, middle)
    return (low + high) / 2


class Solution:
    """``acids``, ``metals``, ``halides``: name -> mol/L; ``strong``: net charge of ions that only look on."""

    def __init__(self, acids, metals, halides, strong, solids, gas):
        self.acids, self.metals, self.halides = acids, metals, halides
        self.strong, self.solids, self.gas = strong, solids, gas

    def ph(self):
        return halved(lambda ph: self.charge(ten(-ph))[0], -2, 16)

    def result(self):
        ph = self.ph()
        return ph, self.charge(ten(-ph))[1]

    def charge(self, h):
        """Sum of the charges at a proton concentration, and the phases there."""
        phases = {}
        total = h - KW / h + self.strong
        for name, amount in self.acids.items():
            if name != "carbonate":
                total += amount * self.mean(name, h)
        for name, amount in self.metals.items():
            if name not in ("Ca", "Ba", "Ag"):
                total += self.metal(name, amount, h, phases)
        total += self.carbonates(h, phases)
        return total + self.silver(phases), phases

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
        bound = {METAL: mpf(CARBONATES[s][1]) for s in self.solids if s in CARBONATES for METAL in [CARBONATES[s][0]]}
        metals = {name: self.metals[name] for name in ("Ca", "Ba") if name in self.metals}
        charge = sum((2 * one for one in metals.values()), mpf(0))
        if not amount:
            return charge
        weights = self.weights("carbonate", h)
        whole = sum(weights)

        def solids(free):
            return {name: max(mpf(0), metals[name] - ksp / free) for name, ksp in bound.items() if name in metals}

        def missing(log):
            return amount - ten(log) * whole - sum(solids(ten(log)).values(), mpf(0))

        free = ten(halved(missing, -40, 2)) if bound else amount / whole
        if self.gas and free * weights[2] > BUBBLE:
            free = BUBBLE / weights[2]
            phases["CO2"] = amount - free * whole - sum(solids(free).values(), mpf(0))
        elif self.gas:
            phases["CO2"] = mpf(0)
        for solid in self.solids:
            if solid in CARBONATES and CARBONATES[solid][0] in metals:
                phases[solid] = solids(free)[CARBONATES[solid][0]]
                charge -= 2 * phases[solid]
        return charge + free * sum((k - 2) * one for k, one in enumerate(weights))

    def silver(self, phases):
        """Charge of silver and halides; a mole of solid takes one of each."""
        amount = self.metals.get("Ag", mpf(0))
        charge = amount - sum(self.halides.values(), mpf(0))
        if not amount:
            return charge
        products = {s: HALIDES[s] for s in self.solids if s in HALIDES and HALIDES[s][0] in self.halides}

        def formed(free):
            return {s: max(mpf(0), self.halides[x] - mpf(ksp) / free) for s, (x, ksp) in products.items()}

        log = halved(lambda log: amount - ten(log) - sum(formed(ten(log)).values(), mpf(0)), -40, 2)
        phases.update(formed(ten(log)))
        return charge
