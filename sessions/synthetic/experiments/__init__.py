"""Made-up experiments: a module performs the procedure, and the TOML file of its name declares bench and effects.

Pours: `sessions.synthetic.experiments.silver_chloride`, `sessions.synthetic.experiments.acid_dilution`,
`sessions.synthetic.experiments.marble`, `sessions.synthetic.experiments.ammonia_calorimetry`. Run in from a burette:
`sessions.synthetic.experiments.titration`, `sessions.synthetic.experiments.carbonate_titration`. Over a flame:
`sessions.synthetic.experiments.copper_sulfate`, `sessions.synthetic.experiments.flame_test`. Gas:
`sessions.synthetic.experiments.gas_collection`. For classes: `sessions.synthetic.experiments.practice`.
"""
